"""Units of length, limits of floating-point arithmetic, and robust statistics."""
