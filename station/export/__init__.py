"""The output files of a run."""
