"""Routes of pictures and models.

Each is of an event, which never changes: browsers may keep what they got.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query
from fastapi.responses import Response

from station.console.faults import ConsoleFault
from station.console.routes.answers import FAULTS, IMMUTABLE, EventNumber, Looking, Prefix
from station.console.shown_pages import models
from station.console.shown_pages.layers import (
    coverage_legend,
    encode_picture,
    event_of,
    file_of_layer,
    read_layer,
    read_model,
    stored_file,
)
from station.console.shown_pages.strain import strain_pyramid, strain_scale
from station.console.shown_pages.tiles import KINDS, Pyramid, build_pyramid, describe
from station.console.shown_pages.uncertainty import uncertainty_pyramid, uncertainty_scale
from station.console.state.app_state import AppState
from station.session import Event, Session

router = APIRouter(prefix="/api", responses=FAULTS)
LEAF = "((left|right)[.])?"
Layer = Annotated[str, Path(pattern=f"^({LEAF}(page|master|strain|coverage|uncertainty)|original)$")]
Small = Annotated[str, Path(pattern=f"^({LEAF}(page|master)|original)$")]
Millimetres = Annotated[float, Query(ge=-10_000, le=10_000, allow_inf_nan=False)]
TYPES = {"jpg": "image/jpeg", "png": "image/png"}
KEPT = {"Cache-Control": IMMUTABLE}
STORED = ("page", "master")  # whose stored file is the whole picture
DRAWN: Mapping[str, Callable[[Session, Event, str], Pyramid]] = {
    "strain": strain_pyramid,
    "uncertainty": uncertainty_pyramid,
}


@router.get("/pictures/{event}/{layer}.dzi", response_class=Response)
def picture(app_state: Looking, event: EventNumber, layer: Layer) -> Response:
    """The Deep Zoom document of a layer."""
    return Response(
        describe(_pyramid(app_state, event, layer), KINDS[_name(layer)]), media_type="application/xml", headers=KEPT
    )


@router.get("/pictures/{event}/{layer}_files/{level}/{column}_{row}.{kind}", response_class=Response)
def tile(
    app_state: Looking,
    event: EventNumber,
    layer: Layer,
    level: Annotated[int, Path(ge=0, le=32)],
    column: Annotated[int, Path(ge=0, le=100_000)],
    row: Annotated[int, Path(ge=0, le=100_000)],
    kind: Literal["jpg", "png"],
) -> Response:
    """A tile of a layer."""
    if kind != KINDS[_name(layer)]:
        raise ConsoleFault("not_found", f"tiles of {layer} are {KINDS[_name(layer)]}")
    data = encode_picture(_pyramid(app_state, event, layer).tile(level, column, row), kind)
    return Response(data, media_type=TYPES[kind], headers=KEPT)


@router.get("/pictures/{event}/{layer}/thumbnail.jpg", response_class=Response)
def thumbnail(app_state: Looking, event: EventNumber, layer: Small) -> Response:
    """A layer within 240 pixels."""
    data = encode_picture(_pyramid(app_state, event, layer).thumbnail(), "jpg", quality=80)
    return Response(data, media_type=TYPES["jpg"], headers=KEPT)


@router.get("/pictures/{event}/{layer}/full", response_class=Response)
def full(app_state: Looking, event: EventNumber, layer: Layer) -> Response:
    """The whole of a layer, as PNG; of the strain of a large page a smaller one."""
    session = app_state.opened().session
    found = event_of(session, event)
    if _name(layer) in STORED:
        data = stored_file(session, found, file_of_layer(layer)).read_bytes()
    else:
        data = encode_picture(_pyramid(app_state, event, layer).whole(), "png")
    return Response(data, media_type=TYPES["png"], headers=KEPT)


@router.get("/pictures/{event}/strain/scale")
def scale(app_state: Looking, event: EventNumber, leaf: Prefix = "") -> dict[str, Any]:
    """The colours of the strain and its numbers."""
    session = app_state.opened().session
    arrays, _ = read_model(session, event_of(session, event), file_of_layer(f"{leaf}strain"))
    return strain_scale(arrays["strain"].astype(float))


@router.get("/pictures/{event}/uncertainty/scale")
def scale_of_uncertainty(app_state: Looking, event: EventNumber, leaf: Prefix = "") -> dict[str, Any]:
    """The colours of the uncertainty and its numbers."""
    session = app_state.opened().session
    return uncertainty_scale(session, event_of(session, event), leaf)


@router.get("/pictures/{event}/coverage/legend")
def legend(app_state: Looking, event: EventNumber, leaf: Prefix = "") -> dict[str, Any]:
    """Return the colours of the coverage and their fractions of the page."""
    session = app_state.opened().session
    return coverage_legend(session, event_of(session, event), leaf)


@router.get("/models/{event}/measure")
def measure(
    app_state: Looking,
    event: EventNumber,
    x0: Millimetres,
    y0: Millimetres,
    x1: Millimetres,
    y1: Millimetres,
    leaf: Prefix = "",
) -> dict[str, Any]:
    """The length between two points: on the page, on the sheet, through space."""
    return app_state.ruler(event, leaf).measure((x0, y0), (x1, y1))


@router.get("/models/{event}/{kind}", response_class=Response)
def model(
    app_state: Looking,
    event: EventNumber,
    kind: Literal["scan", "mesh", "steps"],
    faces: bool = True,
    leaf: Prefix = "",
) -> Response:
    """A model for the 3D view."""
    session = app_state.opened().session
    found = event_of(session, event)
    if kind == "scan":
        data = models.scan_model(session, found, faces=faces)
    else:
        data = (models.page_model if kind == "mesh" else models.steps_model)(session, found, leaf, found.on or 0)
    return Response(data, media_type="application/octet-stream", headers=KEPT)


def _pyramid(app_state: AppState, number: int, layer: str) -> Pyramid:
    session = app_state.opened().session
    event = event_of(session, number)
    if layer != "original" and file_of_layer(layer) not in event.files:
        raise ConsoleFault("not_found", f"event {number} has no {layer}")

    def build() -> Pyramid:
        if draw := DRAWN.get(name := _name(layer)):
            return draw(session, event, layer.removesuffix(name))
        return build_pyramid(read_layer(session, event, layer))

    return app_state.pyramids.get((session.identifier, number, layer), build)


def _name(layer: str) -> str:
    """The name of a layer without the leaf that it is of."""
    return layer.rpartition(".")[2]
