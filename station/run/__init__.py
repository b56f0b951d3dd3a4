"""One restoration as a run.

Its inputs, the checks around it, the files that it leaves.
"""
