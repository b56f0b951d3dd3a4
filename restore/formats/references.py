"""Files that a scan refers to: its material files and its picture.

They are originals like the scan itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from restore.errors import BadInput
from restore.formats.obj import picture_name
from restore.formats.parsing.source import find_reference, is_file, read_bytes, with_newlines, without_mark
from restore.formats.ply import own_name
from restore.runtime.arguments import checks_types

# By the end of a file's name: where the name of another file stands in it.
_REFERENCES = {
    ".mtl": re.compile(rb"^[ \t]*map_(?:Kd|Ka|Ke)[ \t]+([^\r\n]*)", re.MULTILINE | re.IGNORECASE),
    ".obj": re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]*)", re.MULTILINE),
    ".ply": re.compile(rb"^comment[ \t]+TextureFile[ \t]+([^\r\n]*)", re.MULTILINE | re.IGNORECASE),
    ".wrl": re.compile(rb'\bfilename\s+"([^"]*)"'),
}


@checks_types
def referenced_files(path: Path) -> list[Path]:
    """Return the files that a scan file refers to, directly or not, as far as they exist.

    Raises BadInput when one of them cannot be read.
    """
    known = [path.resolve()]
    for file in known:  # grows on the way
        for base in (file, path):  # a material file's picture lies next to it, or next to the mesh
            for other in _referred_by(file, base):
                if other not in known:
                    known.append(other)
    return known[1:]


def _referred_by(path: Path, base: Path) -> Iterator[Path]:
    """Yield the files that one refers to by name.

    The names are looked for in the folder of `base`.
    """
    pattern = _REFERENCES.get(path.suffix.lower())
    for match in pattern.finditer(with_newlines(without_mark(read_bytes(path)))) if pattern and is_file(path) else ():
        try:
            name = own_name(base, picture_name(match[1].strip()))
            several = name.split()
            files = [find_reference(base, name), *(find_reference(base, one) for one in several if len(several) > 1)]
        except BadInput:
            continue  # the reader reports what is wrong with it
        yield from (file.resolve() for file in files if file is not None)
