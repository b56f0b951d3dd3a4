"""Colours measured on a chart: a profile that makes them true, and figures that tell how true they are.

chart    finds the chart in a picture
lab      CIE L*a*b* and colour differences
fit      curve and matrix from the chart to an ICC profile
figures  what was measured, and the levels of the guidelines that it meets
run      the command `planish colour`
"""
