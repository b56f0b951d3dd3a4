"""The Minolta Vivid 900 laser range scanner.

The vendor's commands are not public. The driver reads them from a *command profile*, a file that gives the bytes
of every command for one firmware. The profile that comes with it is Planish's own, for the simulated scanner.
"""
