"""A scan prepared for flattening.

One surface, its coarse and fine meshes, and their flat positions.
"""
