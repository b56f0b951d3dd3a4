"""What is derived from an original: restoration and quality check."""
