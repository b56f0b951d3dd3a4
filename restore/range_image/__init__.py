"""Range images: the camera that took them, the sheet among all that was measured, its surface without noise."""
