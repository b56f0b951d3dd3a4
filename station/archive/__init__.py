"""`planish export`: a volume in the formats of archives and libraries.

volume      the record that all encoders read: a volume, its pages, their files, the events that made them
mets        METS 1.12.1, with premis (PREMIS 2.3) and mix (MIX 2.0) inside, and ALTO 4.4 in separate files
iiif        a IIIF Presentation 3 manifest with static tiles of Image 3, level 0
book        one PDF/A of all pages, with page labels and words
tiff        TIFF masters with profile and resolution
sheets      the sheets as meshes: GLB, PLY, OBJ
bag         a BagIt bag around any of these
formats     their names
deliver     one of the formats written to a new folder, whole or not at all
"""
