"""A scan prepared for flattening: one surface, its coarse and fine meshes, and their flat positions."""
