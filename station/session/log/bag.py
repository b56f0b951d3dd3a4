"""The bag of a session (RFC 8493): its tag files.

They grow by one event at a time and are functions of the events. Nothing here reads or writes: bytes in, bytes out.
"""

from __future__ import annotations

import hashlib
import unicodedata
from collections.abc import Mapping, Sequence

from restore import BadInput
from station.session.log.events import RECORD, Event
from station.storage.session_folder import BAGIT, LOG

PAYLOAD = "data"
BAG_INFO = "bag-info.txt"
MANIFEST, TAG_MANIFEST = "manifest-sha512.txt", "tagmanifest-sha512.txt"
FIXED = (BAGIT, BAG_INFO)
GROWING = (LOG, MANIFEST)
TAG_FILES = (*FIXED, *GROWING, TAG_MANIFEST)

DECLARATION = b"BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n"


def fixed_files(first: Event) -> dict[str, bytes]:
    """Return bagit.txt and bag-info.txt.

    They are functions of the first event, which says what the session is of.
    """
    volume = first.facts.get("volume")
    volume = volume if isinstance(volume, dict) else {}  # of a damaged record, which is reported where it is read
    info = {
        "Bag-Software-Agent": first.software,
        "Bagging-Date": first.time[:10],
        "External-Identifier": first.facts.get("id", ""),
        "External-Description": volume.get("title", ""),
        "Bag-Group-Identifier": volume.get("project", ""),
        "Source-Organization": volume.get("organisation", ""),
    }
    return {BAGIT: DECLARATION, BAG_INFO: _bag_info(info)}


def _bag_info(fields: Mapping[str, object]) -> bytes:
    """The fields, a line each; line breaks and tabs in a value become blanks."""
    texts = {name: " ".join(str(value).split()) for name, value in fields.items()}
    return "".join(f"{name}: {text}\n" for name, text in texts.items() if text).encode()


def manifest_lines(event: Event) -> bytes:
    """Return the lines of the payload manifest for one event.

    Its record, then its files by name.
    """
    files = {RECORD: event.sha512, **dict(sorted(event.files.items()))}
    return "".join(f"{digest}  {PAYLOAD}/{event.folder}/{name}\n" for name, digest in files.items()).encode()


def tag_manifest(digests: Mapping[str, str]) -> bytes:
    """The tag manifest: SHA-512 of each tag file."""
    return "".join(f"{digests[name]}  {name}\n" for name in (*FIXED, *GROWING)).encode()


def growing_files(events: Sequence[Event]) -> dict[str, bytes]:
    """The log and the payload manifest of these events."""
    return {
        LOG: b"".join(event.line for event in events),
        MANIFEST: b"".join(manifest_lines(event) for event in events),
    }


def tag_files(events: Sequence[Event]) -> dict[str, bytes]:
    """Every tag file of a session with these events."""
    files = {**fixed_files(events[0]), **growing_files(events)}
    return {**files, TAG_MANIFEST: tag_manifest({name: sha512(data) for name, data in files.items()})}


def sha512(data: bytes) -> str:
    """SHA-512 in hexadecimal digits."""
    return hashlib.sha512(data).hexdigest()


def check_name(name: str) -> None:
    """Raise BadInput for the path of a file that a manifest cannot hold.

    RFC 8493, 2.1.3 encodes %, CR and LF with per cent signs, which the Library of Congress's validator does not decode
    alike; other control characters break the lines of other programs.
    """
    try:
        name.encode()
    except UnicodeEncodeError as error:
        raise BadInput(f"{name!r} is not a name in UTF-8", "rename the file") from error
    if "%" in name or any(unicodedata.category(character) == "Cc" for character in name):
        raise BadInput(f"{name!r} holds a per cent sign or a control character", "rename the file")
