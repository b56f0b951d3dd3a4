"""The paper's tables and ours, printed by `make bench`."""
