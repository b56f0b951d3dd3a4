"""One restoration as a run: what comes in, the checks around it, the files that it leaves."""
