"""What is right and what is wrong; imports nothing of what it judges."""
