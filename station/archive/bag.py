"""BagIt 1.0 (RFC 8493): a folder of files with their digests, and words about it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from station.session.log.bag import BAG_INFO, DECLARATION, MANIFEST, PAYLOAD, TAG_MANIFEST, check_name
from station.session.log.store import file_digest
from station.storage.disk import write_file
from station.storage.session_folder import BAGIT


def seal_bag(folder: Path, info: Mapping[str, str]) -> None:
    """Make a bag of a folder whose payload is in `data`.

    Write manifests, description and declaration.
    """
    payload = sorted(path for path in (folder / PAYLOAD).rglob("*") if path.is_file())
    octets = sum(path.stat().st_size for path in payload)
    described = {**info, "Payload-Oxum": f"{octets}.{len(payload)}"}
    lines = (f"{name}: {' '.join(text.split())}\n" for name, text in described.items() if text.strip())
    write_file(folder / MANIFEST, manifest(folder, payload))
    write_file(folder / BAG_INFO, "".join(lines).encode())
    write_file(folder / BAGIT, DECLARATION)
    write_file(folder / TAG_MANIFEST, manifest(folder, [folder / name for name in (BAG_INFO, BAGIT, MANIFEST)]))


def manifest(folder: Path, files: Iterable[Path]) -> bytes:
    """A line for each file with its SHA-512, as `sha512sum -c` reads it.

    Raises BadInput for a name that a manifest cannot hold, OSError.
    """
    names = {path.relative_to(folder).as_posix(): path for path in files}
    for name in names:
        check_name(name)
    return "".join(f"{file_digest(path)}  {name}\n" for name, path in names.items()).encode()
