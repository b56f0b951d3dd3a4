"""Range images: the camera model, the segmentation of the sheet, its denoised surface."""
