"""The Minolta Vivid 900 laser range scanner.

The vendor's commands are not public. The driver is complete around a *command profile*, a file that says the bytes of
every command for one firmware. The profile that comes with it is Planish's own, for the simulated scanner.
"""
