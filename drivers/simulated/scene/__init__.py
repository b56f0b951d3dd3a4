"""Scene in front of the simulated scanner.

Sheets, what is printed on them, table and light.
"""
