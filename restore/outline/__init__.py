"""The outline of the flat page: whether it is a rectangle, and its straight sides."""
