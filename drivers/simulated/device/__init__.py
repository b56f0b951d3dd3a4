"""The simulated device: it answers command bytes.

It keeps its own time, and can be made to fail.
"""
