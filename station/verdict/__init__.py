"""The verdict on a capture: measures of scan and page against limits of a preset.

measures   numbers from the scan, the page and its coverage
same_page  how alike the print of two pages is
checks     green, amber or red of each measure
thresholds limits of each measure, amber and red
"""
