"""Measurements of a scene: rays, range sensor, colour exposure, a capture."""
