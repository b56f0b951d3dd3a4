"""The verdict on a capture.

Measures of the scan and its page, compared with the limits of a preset.

measures   numbers from the scan, the page and its coverage
same_page  how alike the print of two pages is
checks     green, amber or red of each measure
thresholds limits of each measure, amber and red
"""
