"""Simulated cameras, projectors and buses, for tests and benches."""
