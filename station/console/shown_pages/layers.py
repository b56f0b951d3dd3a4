"""Layers of a page as pictures: the page, its master, its coverage, the scanner's picture."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from restore import BadInput, CoverageClass, RangeScan, RestoreError, load_scan
from restore.scan import Bytes
from station.console.faults import ConsoleFault
from station.images.coverage import COLOURS
from station.page_files.page_model import decode_model
from station.session import Event, Session, scan_path
from station.session.captures.photographs import first_picture
from station.session.terms.parts import PAGE, STEM

MAX_PIXELS = 120_000_000  # of a picture that is shown: 360 MB as it is drawn
MAX_MODEL_BYTES = 2**27  # of the mesh of a page: an A3 page has 20 MB
ENDINGS = {
    "page": ".png",
    "master": "-master.png",
    "coverage": "-coverage.png",
    "strain": "-model.plm",
    "uncertainty": "-uncertainty.tif",
}
FILES = {layer: STEM + ending for layer, ending in ENDINGS.items()}
MODEL = FILES["strain"]
PREFIXES = ("", "left.", "right.")  # before the names of the layers of a leaf
FORMATS = ("PNG",)  # of pictures: no other decoder is let at them
ON_CAPTURE = "original"
STEPPING = ("sticks", "springs")  # methods whose steps are positions in space
OPACITY = {CoverageClass.OUTSIDE: 0, CoverageClass.MEASURED: 0, CoverageClass.INTERPOLATED: 110}
OPAQUE = 170  # what was not seen as it is


def layers_of(restored: Event | None, capture: Event | None) -> list[str]:
    """The layers that a page has."""
    return [*leaf_layers(restored, ""), *([] if capture is None else [ON_CAPTURE])]


def leaf_layers(restored: Event | None, prefix: str) -> list[str]:
    """Return the layers of a leaf.

    prefix: `left.` or `right.`, empty for a page that is the only one of its scan.
    """
    layers = [f"{prefix}{name}" for name in FILES]
    return [] if restored is None else [layer for layer in layers if file_of_layer(layer) in restored.files]


def file_of_layer(layer: str) -> str:
    """The name of the file of a layer.

    >>> file_of_layer("master"), file_of_layer("left.page")
    ('page-master.png', 'page-left.png')
    """
    part, _, name = layer.rpartition(".")
    return file_of_leaf(part, ENDINGS[name])


def file_of_leaf(prefix: str, ending: str) -> str:
    """The name of a file of a leaf.

    prefix: as for `leaf_layers`.

    >>> file_of_leaf("left.", "-alto.xml"), file_of_leaf("", ".png")
    ('page-left-alto.xml', 'page.png')
    """
    part = prefix.removesuffix(".")
    return f"{STEM}-{part}{ending}" if part else STEM + ending


def prefix_of(part: str, count: int) -> str:
    """What comes before the names of the layers of one of `count` parts of a scan."""
    return "" if count == 1 or part == PAGE else f"{part}."


def models_of(restored: Event | None, capture: Event | None) -> list[str]:
    """Return a page's models, `steps` only where the method moves the sheet through space."""
    found = [] if capture is None else ["scan"]
    if restored is None or not any(name.endswith(ENDINGS["strain"]) for name in restored.files):
        return found
    method = None if restored.restored is None else restored.restored.method
    return [*found, "mesh", *(["steps"] if method in STEPPING else [])]


def event_of(session: Session, number: int) -> Event:
    """The event of a number. Raises ConsoleFault."""
    if not 0 < number <= len(session.history.events):
        raise ConsoleFault("not_found", f"the session has no event {number}")
    return session.history.event(number)


def stored_file(session: Session, event: Event, name: str) -> Path:
    """Return the path of a file of an event, looked up in its record.

    Raises ConsoleFault when it is not there, or is a link.
    """
    if name not in event.files:
        raise ConsoleFault("not_found", f"event {event.number} has no file {name}")
    path = session.path(event, name)
    _refuse_links(session, path)
    return path


def scan_of(session: Session, event: Event) -> RangeScan | Any:
    """Return the scan of a capture.

    Raises ConsoleFault when its files are links, BadInput when they are damaged.
    """
    if event.kind != "capture":
        raise ConsoleFault("not_found", f"event {event.number} is not a scan")
    if event.captured.is_photographed:
        raise ConsoleFault("not_recorded", "photographs have no scan", "look at the restored page")
    for name in event.files:
        _refuse_links(session, session.path(event, name))
    return load_scan(scan_path(session, event), **event.captured.reading)


def _stored_set(session: Session, event: Event) -> Path:
    """The folder of a set of photographs. Raises ConsoleFault when its files are links."""
    for name in event.files:
        _refuse_links(session, session.path(event, name))
    return scan_path(session, event)


def read_layer(session: Session, event: Event, layer: str) -> Bytes:
    """Return a layer as a picture (h, w, 3) uint8, or, with transparency, (h, w, 4).

    Raises ConsoleFault, BadInput, OSError.
    """
    if layer == ON_CAPTURE and event.kind == "capture" and event.captured.is_photographed:
        return first_picture(_stored_set(session, event)).image
    if layer == ON_CAPTURE:
        texture = scan_of(session, event).texture
        if texture is None:
            raise ConsoleFault("not_found", "the scan has no colour image")
        return np.asarray(texture)
    path = stored_file(session, event, file_of_layer(layer))
    return READERS[layer.rpartition(".")[2]](path, session, event)


def read_model(session: Session, event: Event, model: str = MODEL) -> tuple[Mapping[str, NDArray[Any]], dict[str, Any]]:
    """Return the arrays (…) and the facts of a page's model.

    Raises ConsoleFault when the restoration kept none.
    """
    if model not in event.files:
        raise ConsoleFault(
            "not_recorded", "this restoration kept no model", "look at its scan; pages captured here keep one"
        )
    path = stored_file(session, event, model)
    if path.stat().st_size > MAX_MODEL_BYTES:
        raise ConsoleFault("damaged", f"{path.name} is too large")
    try:
        return decode_model(path.read_bytes())
    except ValueError as error:
        raise ConsoleFault("damaged", f"{path} is damaged: {error}", "planish verify shows more") from error


def coverage_legend(session: Session, event: Event, prefix: str = "") -> dict[str, Any]:
    """Return the classes of the page's pixels, with colours and fractions."""
    seen = _coverage_codes(stored_file(session, event, file_of_layer(f"{prefix}coverage")))
    counts = np.bincount(seen.ravel(), minlength=len(CoverageClass))
    total = max(int(counts[1:].sum()), 1)
    kinds = [kind for kind in CoverageClass if kind != CoverageClass.OUTSIDE]
    return {
        "kinds": [
            {
                "key": kind.name.lower(),
                "colour": "#{:02x}{:02x}{:02x}".format(*COLOURS[kind]) if OPACITY.get(kind, OPAQUE) else None,
                "fraction": float(counts[kind] / total),
            }
            for kind in kinds
        ]
    }


def encode_picture(picture: Bytes, kind: str, *, quality: int = 88) -> bytes:
    """A picture (h, w, 3 or 4) uint8 as `jpg` or `png`."""
    out = io.BytesIO()
    if kind == "jpg":
        Image.fromarray(picture[..., :3]).save(out, "JPEG", quality=quality)
    else:
        Image.fromarray(picture).save(out, "PNG", compress_level=1)
    return out.getvalue()


def _picture(path: Path, _session: Session, _event: Event) -> Bytes:
    with opened(path) as picture:
        return np.asarray(picture.convert("RGB"))


def _coverage(path: Path, _session: Session, _event: Event) -> Bytes:
    table = np.array([(*COLOURS[kind], OPACITY.get(kind, OPAQUE)) for kind in CoverageClass], np.uint8)
    return np.asarray(table[np.minimum(_coverage_codes(path), len(CoverageClass) - 1)])


def _coverage_codes(path: Path) -> Bytes:
    with opened(path) as picture:
        codes = np.asarray(picture)
    if codes.ndim != 2:
        raise BadInput(f"{path} is not a coverage", "planish verify shows more")
    return codes.astype(np.uint8)


@contextmanager
def opened(path: Path, formats: tuple[str, ...] = FORMATS) -> Iterator[Image.Image]:
    """Open a picture of a session, its size within limits.

    Its pixels are read when they are asked for. Raises BadInput.
    formats: as Pillow calls those that it may have.
    """
    try:
        with Image.open(path, formats=formats) as picture:
            width, height = picture.size
            if width * height > MAX_PIXELS:
                raise BadInput(f"{path} has {width} × {height} pixels: too many to be shown", "open it elsewhere")
            yield picture
    except (RestoreError, ConsoleFault, MemoryError):
        raise
    except Exception as error:  # a decoder raises whatever it trips over
        raise BadInput(f"{path} is damaged: {error}", "planish verify shows more") from error


def _refuse_links(session: Session, path: Path) -> None:
    """Raise ConsoleFault for a path that leads out of its session."""
    if path.is_symlink() or not path.resolve().is_relative_to(session.folder.resolve()) or not path.is_file():
        raise ConsoleFault("damaged", f"{path} is not a file of the session", "planish verify shows more")


READERS: Mapping[str, Callable[[Path, Session, Event], Bytes]] = {
    "page": _picture,
    "master": _picture,
    "coverage": _coverage,
}
