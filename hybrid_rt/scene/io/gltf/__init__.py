"""glTF 2.0 files, .gltf and .glb."""
