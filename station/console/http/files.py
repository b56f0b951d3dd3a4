"""Files of the page: listed once, at the start.

Files that are not in the list are not served.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).parents[1] / "page"
INDEX = "index.html"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".map": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".ico": "image/x-icon",
    ".woff2": "font/woff2",
    ".wasm": "application/wasm",
    ".txt": "text/plain; charset=utf-8",
}


@dataclass(frozen=True)
class PageFile:
    """File of the page.

    Where it is, its media type, and a tag that changes with its contents.
    """

    path: Path
    media_type: str
    tag: str


def list_page(folder: Path = PAGE) -> Mapping[str, PageFile]:
    """Map the path below the page's folder to each file of a known type.

    Links are left out.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix in TYPES and path.is_file() and not path.is_symlink():
            tag = hashlib.sha256(path.read_bytes()).hexdigest()[:32]
            found[path.relative_to(folder).as_posix()] = PageFile(path, TYPES[path.suffix], tag)
    return found
