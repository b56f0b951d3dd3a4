"""The simulated device: it answers command bytes, keeps its own time, and can be made to fail."""
