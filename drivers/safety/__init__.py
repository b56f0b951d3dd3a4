"""Leaves the hardware safe after every end of a program: laser off, stage stopped."""
