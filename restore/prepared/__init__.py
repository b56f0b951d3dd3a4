"""A scan prepared for flattening: a surface, coarse and fine meshes, flat positions."""
