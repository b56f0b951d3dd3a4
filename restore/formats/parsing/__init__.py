"""What all readers use: bytes of a file, images, meshes, grids."""
