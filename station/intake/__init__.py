"""Scans that arrive in a folder.

Each is restored once, or quarantined once with the reason.

listing     the content of a folder, and what still changes
companions  the files that belong to a scan
arrival     one scan with its files
records     what was done with each, and whether it is to be done
once        restores an arrival, or quarantines it
presets     `planish.toml`: the options of the scans in a folder and below
loop        `planish watch`
"""
