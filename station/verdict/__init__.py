"""The verdict on a shot: measures of the scan and its page, and how they stand to the limits of a preset.

measures   numbers from the scan, the page and its coverage
same_page  how alike the print of two pages is
judge      green, amber or red of each measure
thresholds limits of each measure, amber and red
"""
