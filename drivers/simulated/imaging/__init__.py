"""Measurements of a scene by the simulated scanner.

Rays, range sensor, colour exposure, a capture.
"""
