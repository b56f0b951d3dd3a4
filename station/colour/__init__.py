"""Colour calibration on a chart: an ICC profile, and quality figures of the picture.

chart    finds the chart in a picture
lab      CIE L*a*b* and colour differences
fit      curve and matrix from the chart to an ICC profile
figures  measured quality figures, and the levels of the guidelines that they meet
run      the command `planish colour`
"""
