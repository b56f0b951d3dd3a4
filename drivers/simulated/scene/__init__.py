"""What stands in front of the simulated scanner: sheets, what is printed on them, table and light."""
