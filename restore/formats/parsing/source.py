"""Reads files within limits.

Every fault of a file raises BadInput that names it.
"""

from __future__ import annotations

import codecs
import errno
import re
import unicodedata
import warnings
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.files import read_regular
from restore.runtime.arguments import checks_types
from restore.scan import Floats

# Remedies.
ONE_SHOT = "export one capture of the scanner, or a mesh of one page with fewer faces"
NO_FACES = "export the surface with its faces: a point cloud has to be meshed first"
NEXT_TO_SCAN = "put the file next to the scan, or export the scan into a single file"
UNREADABLE = "check the file's permissions and its disk"
MISSING = "put the file next to the scan, or give the image with planish restore --texture"
DAMAGED = "the file is damaged: export or copy it again"
CUT_SHORT = "copy or export the file again, and compare its size with the original's"

_WORD = re.compile(rb"\S+")
MAX_NAME = 1024  # of a file inside the folder of a scan
# A full 640 × 480 shot takes 100 MB in its longest form: OBJ text with normals and sixteen digits.
MAX_FILE_BYTES = 128 * 2**20
# The scanner gives 307,200 samples, the largest range cameras of its family 1280 × 1024; a little above those.
MAX_SAMPLES = 2**21


def read_bytes(path: Path, limit: int = MAX_FILE_BYTES) -> bytes:
    """Read a whole regular file.

    Raises BadInput when it is missing, unreadable, empty or larger than `limit` bytes.
    """
    try:
        data = read_regular(path, limit)
    except FileNotFoundError as error:
        raise BadInput(f"{path} does not exist", "check the name and the folder") from error
    except OSError as error:
        if error.errno == errno.EFBIG:
            raise BadInput(f"{path} is larger than {limit} bytes", ONE_SHOT) from error
        if error.errno in (errno.EISDIR, errno.EINVAL, errno.ENXIO):
            raise BadInput(f"{path} is not a regular file", "give the file itself") from error
        raise BadInput(
            f"{path} cannot be read: {error.strerror}", "check the file's permissions and its disk"
        ) from error
    except ValueError as error:
        raise BadInput(f"{path} cannot be read: {error}", UNREADABLE) from error
    if not data:
        raise BadInput(f"{path} is empty", "export or copy the scan again")
    return data


def without_mark(text: bytes) -> bytes:
    """The text without the byte order mark that editors put before UTF-8."""
    return text.removeprefix(codecs.BOM_UTF8)


def with_newlines(text: bytes) -> bytes:
    """The same lines, all ended by newlines where some end with carriage returns alone."""
    if text.count(b"\r") == text.count(b"\r\n"):
        return text
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def is_file(path: Path) -> bool:
    """True when there is a file; False also for names that are invalid on the disk."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """True when there is a folder; False also for names that are invalid on the disk."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


@checks_types
def scan_stem(path: Path | str) -> str:
    """Return the name of a scan without its folder and extension.

    `.abs.gz` is one extension, a folder has none.
    """
    path = Path(path)
    if is_folder(path):
        return path.resolve().name
    return Path(path.name[:-3] if path.name.lower().endswith(".abs.gz") else path.name).stem


def resolve_reference(path: Path, name: str) -> Path:
    """Return the file that `path` refers to by `name`.

    Only files inside the scan's own folder are ever opened. Raises BadInput for absolute names and names that leave the
    folder, by `..` or by a link.
    """
    if len(name) > MAX_NAME:
        raise BadInput(f"{path} refers to a file by a name of {len(name)} characters", MISSING)
    folder = path.parent.resolve()
    portable = name.replace("\\", "/")
    try:
        target = (folder / portable).resolve()
        inside = target.is_relative_to(folder) and ":" not in portable
    except (OSError, ValueError, RuntimeError):  # too long, a NUL, a circle of links
        inside = False
    if not inside:
        raise BadInput(f"{path} refers to {name!r} outside its own folder", MISSING)
    return target


def find_reference(path: Path, name: str) -> Path | None:
    """Find the file that `path` refers to by `name`.

    A name may differ from the file's in case or in how its letters are composed. One of another computer's folder, or
    of one outside, is looked for next to the scan: only files inside its own folder are ever opened.
    Returns None when it does not exist. Raises BadInput for one outside that does not exist there either.
    """
    try:
        file = resolve_reference(path, name)
    except BadInput:
        if len(name) > MAX_NAME:
            raise
        outside = True
    else:
        if is_file(file):
            return file
        outside = False
    folder, words = (
        path.parent.resolve(),
        [word for word in name.replace("\\", "/").split("/") if word not in (".", "")],
    )
    for parts in (words, words[-1:]):
        found: Path | None = folder
        for part in parts:
            found = None if found is None or part == ".." else _alike(found, part)
        if found is not None and is_file(found) and found.resolve().is_relative_to(folder):
            return found
    if outside:
        resolve_reference(path, name)  # raises what is wrong with it
    return None


def _alike(folder: Path, name: str) -> Path | None:
    """The entry of a folder whose name differs at most in case and composition."""
    wanted = unicodedata.normalize("NFC", name).casefold()
    try:
        names = sorted(entry.name for entry in folder.iterdir())
    except (OSError, ValueError):
        return None
    found = [one for one in names if unicodedata.normalize("NFC", one).casefold() == wanted]
    return folder / (name if name in found else found[0]) if found else None


def parse_numbers(text: bytes, path: Path, what: str) -> Floats:
    """Parse numbers (n,) between white space.

    Raises BadInput naming the first word that is not a number.
    """
    text = text.strip()
    if not text:
        return np.empty(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # how NumPy before 2.3 reports a bad word
            return np.fromstring(text, sep=" ")
    except (ValueError, DeprecationWarning) as error:
        words = (match[0] for match in _WORD.finditer(text))  # one by one: as a list they take twenty times the file
        word = next((word for word in words if not _is_number(word)), b"")
        raise BadInput(f"{path}: {what} holds {word[:40]!r}, which is not a number", DAMAGED) from error


def parse_integers(text: bytes, path: Path, what: str) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Parse whole numbers (n,) between white space. Raises BadInput for anything else."""
    values = parse_numbers(text, path, what)
    if values.size and not (values.min() > -(2**31) and values.max() < 2**31 and (values == np.rint(values)).all()):
        raise BadInput(f"{path}: {what} holds a number that cannot be an index", DAMAGED)
    return values.astype(np.int64)


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word
