"""What the simulated scanner measures of a scene: rays, range sensor, colour exposure, a shot."""
