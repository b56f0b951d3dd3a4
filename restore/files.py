"""Opens regular files of a limited size only.

A pipe would block, a device never end.
"""

from __future__ import annotations

import errno
import os
import stat
import tomllib
from pathlib import Path
from typing import Any

VIDEO_SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm", ".3gp")
"""How the names of videos end, in lower case."""
MAX_TOML_BYTES = 2**16  # a configuration or a command profile is a screen or two of text
# tomllib takes memory by the square of a dotted key's parts, of which a line holds half as many as bytes.
MAX_TOML_LINE = 1000


def read_regular(path: Path, limit: int) -> bytes:
    """Read the whole of a regular file.

    Raises OSError, also for a file of another kind and one of more than `limit` bytes, ValueError for a name that no
    disk accepts.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    try:
        state = os.fstat(descriptor)
        if stat.S_ISDIR(state.st_mode):
            raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
        if not stat.S_ISREG(state.st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", str(path))
        if state.st_size > limit:
            raise OSError(errno.EFBIG, f"it is larger than {limit} bytes", str(path))
        with open(descriptor, "rb", closefd=False) as file:
            return file.read(state.st_size)
    finally:
        os.close(descriptor)


def read_toml(path: Path) -> dict[str, Any]:
    """Read the table of a TOML file.

    Raises OSError as `read_regular`, ValueError for a file that is not TOML within limits.
    """
    data = read_regular(path, MAX_TOML_BYTES)
    if max(map(len, data.split(b"\n"))) > MAX_TOML_LINE:
        raise ValueError(f"a line is longer than {MAX_TOML_LINE} bytes")
    try:
        return tomllib.loads(data.decode("utf-8-sig"))  # some editors begin a file with a byte order mark
    except RecursionError as error:
        raise ValueError("its values are nested too deeply") from error
