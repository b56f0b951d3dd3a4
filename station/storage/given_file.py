"""Read a file that a user named."""

from __future__ import annotations

from pathlib import Path

from restore import BadInput
from restore.files import read_regular


def read_given(path: Path, limit: int, what: str, hint: str) -> bytes:
    """Read a file that a user named, of at most `limit` bytes.

    what: how messages call it; hint: what to do about one that cannot be read.
    Raises BadInput for a file that is missing or cannot be read.
    """
    try:
        return read_regular(path, limit)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise BadInput(f"{path} does not exist", "check the name and the folder") from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise BadInput(f"cannot read {what}: {reason}", hint) from error
