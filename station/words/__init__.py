"""Text recognised on a page: words by Tesseract, columns, the text layer."""
