"""The verdict on a shot: measures of the scan and its page, and how they stand to the limits of a preset.

measures  numbers from the scan, the page and its coverage
judge     green, amber or red of each measure
"""
