"""Range images: segmentation, denoised surface, border and holes."""
