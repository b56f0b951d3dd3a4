"""Leaf sides of a volume in their order, and what lists show of them."""
