"""Scans that arrive in a folder: each is restored once, or set aside once with the reason.

listing     what stands in a folder, and what still changes
companions  the files that belong to a scan
arrival     one scan with its files
records     what was done with each, and whether it is to be done
once        restores an arrival, or sets it aside
presets     `planish.toml`: the options of the scans in a folder and below
loop        `planish watch`
"""
