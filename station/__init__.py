"""Command line and sessions at the scanner: capture, restore, export, review.

cli           the command `planish`: the list of its commands
commands      each group of commands, their options, what they print
console       the web interface
capture_loop  a day at the scanner: keys, restorations in the background
batch         many scans on several processes or machines, and a report of the worst pages
archive       a volume in the formats of archives: BagIt, METS, IIIF, PDF/A, TIFF, meshes
session       a volume in a folder: captures, runs of stages, decisions, as events in a BagIt bag
intake        scans that arrive in a folder: restored once, or set aside once
colour        colour chart to ICC profile, and the quality levels of guidelines
run           one restoration: what comes in, the checks around it, the files that it leaves
verdict       measures of a shot, and their levels next to the limits of a preset
export        the table of output files; report, PDF, meshes
pictures      review pictures: panels side by side, strain map, frames of the flattening
words         text recognition by Tesseract, columns, the text layer
images        files of pictures: PNG, TIFF, colour profiles, metadata
storage       files written whole or not at all, folders with one writer
workers       processes that compute and end with their parent
config        a station's TOML file, and settings checked with the option's name in the message
progress      progress bars on a terminal
choices       values of options that are one of several words
version       version of the software
errors        every error with its exit code and remedy
"""
