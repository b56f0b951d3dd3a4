"""The default method: the page whose edges are nearest to their lengths on the surface, and its steps."""
