"""Pictures to look at.

raster   which triangle a pixel shows: a z-buffer
view     the page in space, from an oblique viewpoint
review   colour image, 3D view and restored page side by side
strain   how much the flattening stretched the page, and where
frames   eight frames of the flattening
canvas   captions and panels
"""
