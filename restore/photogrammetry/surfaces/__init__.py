"""The surface of a page: smooth, folded, or of facets."""
