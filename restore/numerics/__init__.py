"""Limits of floating-point arithmetic, and robust statistics."""
