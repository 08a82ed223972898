"""What is seen and traced: meshes, lights, files."""
