"""Damaged files of every kind that Planish reads, each in a process with limits on processor time and memory."""
