"""Arguments of wrong types end in one clear sentence, never in an exception from deep inside."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import restore
from restore import BadInput, RangeScan, RestoreError, Settings, SurfaceMesh, formats
from restore.mesh.ordered_grid import grid_faces
from restore.runtime.arguments import checks_types
from restore.scan import Floats

X, Y = np.meshgrid(np.linspace(0, 90, 20), np.linspace(0, 60, 14))
POINTS = np.stack([X, -Y, 0 * X - 700.0], axis=-1)
PICTURE = np.full((61, 91, 3), 200, np.uint8)
SCAN = RangeScan(POINTS, PICTURE, np.stack([X, Y], axis=-1))
MESH = SurfaceMesh(
    POINTS.reshape(-1, 3), grid_faces(np.ones(X.shape, bool)), np.stack([X.ravel(), Y.ravel()], axis=1), PICTURE
)


@checks_types
def example(scan: RangeScan | None, path: Path | str, *, many: Sequence[float] = (), call: Callable[[], None] = print):
    """A function with arguments of many kinds."""


@checks_types
def framed(array: Floats) -> int:
    """The length of an array."""
    return len(array)


@checks_types
def collecting(first: Any, *others: int, **more: Any) -> tuple[Any, ...]:
    """Whatever it is given."""
    return first, others, more


def test_what_may_be_anything_and_what_is_collected_is_not_checked():
    assert collecting("a", 1, 2, b=None) == ("a", (1, 2), {"b": None})


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((3, "a"), "example() takes a RangeScan or None as scan, not 'int'"),
        ((None, 3), "example() takes a Path or a str as path, not 'int'"),
    ],
)
def test_the_sentence_names_function_argument_and_types(arguments, sentence):
    with pytest.raises(TypeError) as reported:
        example(*arguments)
    assert str(reported.value) == sentence


def test_items_of_sequences_and_functions_are_checked_too():
    with pytest.raises(TypeError, match="as many, not 'list' of 'str'"):
        example(None, "a", many=["b"])
    with pytest.raises(TypeError, match="takes a function as call"):
        example(None, "a", call=3)
    example(None, Path("a"), many=np.arange(3.0), call=len)
    example(SCAN, "a", many=[1, np.float32(2.5)])


def test_lists_are_as_good_as_arrays_and_missing_arguments_are_reported_by_python():
    assert framed([1, 2]) == 2
    with pytest.raises(TypeError, match=r"example\(\) missing 1 required positional argument: 'path'"):
        example(None)


@pytest.mark.parametrize(
    "wrong", [None, 3, "page.obj", [1, 2], {}, np.zeros((4, 4))], ids=lambda value: type(value).__name__
)
@pytest.mark.parametrize(
    "call",
    [
        restore.restore,
        restore.flatten,
        restore.separate_sheets,
        restore.super_resolve,
        restore.load_capture,
        lambda wrong: restore.fit_axis([wrong, wrong], [0.0, 90.0]),
        lambda wrong: restore.read_photographs([wrong]),
        lambda wrong: restore.rotate_page(wrong, 90),
        lambda wrong: restore.save_scan(wrong, "nowhere"),
        lambda wrong: restore.restore(MESH, [wrong]),
        lambda wrong: restore.restore(MESH, photos=[[wrong]]),
        lambda wrong: restore.flatten(MESH, ("no method", wrong)),
    ],
)
def test_no_public_function_trips_over_a_wrong_type(call, wrong):
    with pytest.raises((TypeError, RestoreError)) as reported:
        call(wrong)
    assert isinstance(reported.value, RestoreError) or "() takes " in str(reported.value)


def test_the_name_of_a_file_is_not_a_scan():
    with pytest.raises(TypeError, match="read the file with load_scan"):
        restore.restore("page.obj")


@pytest.mark.parametrize("path", [None, 3, b"page.obj", ["page.obj"]])
@pytest.mark.parametrize("call", [restore.load_scan, restore.load_capture, formats.read_image, formats.scan_stem])
def test_an_invalid_path_is_reported(call, path):
    with pytest.raises(TypeError, match="as path, not"):
        call(path)


GRIDS = {
    "points": (None, "a", POINTS.tolist(), POINTS.astype(object), POINTS.astype(int), POINTS[0]),
    "texture": ("a", PICTURE.tolist(), PICTURE[..., 0], PICTURE.astype(float)),
    "texture_xy": (None, "a", POINTS[..., :2].astype(int), POINTS[..., :2].astype(complex), POINTS),
    "provenance": (None, "a", [1], {"super_resolution": 3}, {"oversampling": "x"}),
}
MESHES = {
    "vertices": (None, "a", POINTS, MESH.vertices.astype(complex)),
    "faces": (None, "a", MESH.faces.astype(float), MESH.faces - 1),
    "texcoords": ("a", MESH.texcoords.tolist(), MESH.texcoords.astype(object), MESH.texcoords[:5]),
    "texture": ("a", PICTURE.tolist(), PICTURE[..., 0]),
    "provenance": GRIDS["provenance"],
}
FIELDS = [(SCAN, name, value) for name, values in GRIDS.items() for value in values]
FIELDS += [(MESH, name, value) for name, values in MESHES.items() for value in values]


@pytest.mark.parametrize(("scan", "name", "value"), FIELDS)
def test_fields_of_wrong_types_are_refused_with_a_hint(scan, name, value):
    wrong = replace(scan, **{name: value})
    for call in (lambda: restore.restore(wrong, Settings(dpi=30)), lambda: restore.separate_sheets(wrong)):
        with pytest.raises(BadInput) as reported:
            call()
        assert reported.value.hint
    if isinstance(scan, SurfaceMesh):
        with pytest.raises(BadInput):
            restore.flatten(wrong)
