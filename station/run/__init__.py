"""One restoration as a run: its inputs, the checks around it, the files that it leaves."""
