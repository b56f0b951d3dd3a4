"""Sessions at the scanner: capture, restore, export, look.

cli         the command `planish`
config      a station's TOML file, and settings checked with the option's name in the message
session     one page: open → capture → store → restore → export
export      what can be written, one file a format, all or nothing
words       Tesseract: what stands on a page
ocr         the command that reads pages: text, ALTO, PDF/A
precision   how well a page was read
pages       restored pages read back
colour      a chart measured: a profile, and the levels it meets
pictures    the pictures to look at: side by side, strain, frames
progress    bars on a terminal, silence elsewhere
telling     results on stdout, faults on stderr
originals   what a run must never overwrite
errors      every fault with its exit code and what to do now
"""
