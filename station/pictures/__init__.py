"""Review pictures.

view     rendering of the mesh from an oblique viewpoint
review   colour image, 3D view and restored page side by side
strain   map of stretch and shear
frames   eight frames of the flattening
panels   pictures with captions, side by side
"""
