"""Models of cameras: the scanner's own picture, and those of photographs."""
