"""The outline of the flat page: rectangles, and straight sides."""
