"""Command line and sessions at the scanner: capture, restore, export, review.

cli         the command `planish`
config      a station's TOML file, and settings checked with the option's name in the message
batch       many scans on several processes or machines, and a report of the worst pages
archive     a volume in the formats of archives: BagIt, METS, IIIF, PDF/A, TIFF, meshes
one_page    one page: open → capture → store → restore → export
session     a volume in a folder: captures, runs of stages, decisions, as events in a BagIt bag
session_commands  `planish session`, `verify`, `repair`, `replay`, `reindex`
shift       a day at the scanner: keys, restorations in the background
verdict     measures of a shot, and their levels beside the limits of a preset
export      encoders of the output files, one module a format, and writing of all files or none
words       text recognition by Tesseract
ocr         `planish ocr`: text, ALTO and PDF/A of restored pages
text_layer  recognised lines and words, and the invisible text of a PDF
ocr_precision  precision of recognised words and characters against a transcript
pages       reader of restored pages
colour      colour chart to ICC profile, and the quality levels of guidelines
pictures    review pictures: panels side by side, strain map, frames of the flattening
progress    progress bars on a terminal
terminal    results on stdout, errors on stderr
overwrite_check  files that a run must never overwrite
errors      every error with its exit code and remedy
"""
