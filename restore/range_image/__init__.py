"""Range images: the segmentation of the sheet, its denoised surface, its border and its holes."""
