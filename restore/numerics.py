"""Limits of floating-point arithmetic."""

# Replaces a divisor of zero. It is far below every quantity of a scan, such as the variances of inverse depths (about
# 1e-18 mm⁻²) and their squares; and a quotient with it stays finite for numerators up to 1e8.
TINY = 1e-300
