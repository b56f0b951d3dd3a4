"""Sheets whose flat truth is exact, and the measures that compare a result with it; for the tests and the bench."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
