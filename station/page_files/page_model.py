"""The model of a restored page as it is read back.

It is checked before a compiled kernel takes its indices: kernels do not check an index, and one beyond its array ends
the process. A session may be damaged, or of another origin.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.page_files.model import decode_arrays

MAX_MM = 1e5  # from the middle of the sheet: a hundred metres of scroll
MAX_UV = 1e3  # widths and heights of the picture
RESOLUTIONS = (1.0, 1e5)  # of the picture, pixels per inch
# name → sizes; a letter is the same number everywhere. n: vertices, m: faces, k: steps, p, q: their vertices and faces.
PAGE = {"vertices": ("n", 3), "flat": ("n", 2), "strain": ("n",), "page_uv": ("n", 2), "faces": ("m", 3)}
STEPS = {"steps.positions": ("k", "p", 3), "steps.step": ("k",), "steps.faces": ("q", 3)}
OPTIONAL = {"uv": ("n", 2), "steps.uv": ("p", 2)}
INDICES = {"faces": "n", "steps.faces": "p"}
LIMITS = {"vertices": MAX_MM, "flat": MAX_MM, "steps.positions": MAX_MM, "page_uv": MAX_UV}


def decode_model(data: bytes) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """The arrays (…) and the facts of `encode_model`, every index and size checked.

    Raises ValueError for anything else. Every float is finite, every index one of a vertex.
    """
    arrays, facts = decode_arrays(data)
    dpi = facts.get("dpi")
    if not isinstance(dpi, int | float) or not RESOLUTIONS[0] <= dpi <= RESOLUTIONS[1]:
        raise ValueError("the resolution is missing or cannot be")
    steps = STEPS if any(name.startswith("steps.") for name in arrays) else {}
    sizes = _sizes(arrays, {**PAGE, **steps, **{name: OPTIONAL[name] for name in OPTIONAL if name in arrays}})
    for name, array in arrays.items():
        limit = LIMITS.get(name, np.inf)
        if array.dtype.kind == "f" and array.size and not (np.isfinite(array).all() and np.abs(array).max() <= limit):
            raise ValueError(f"{name} has values that cannot be")
    for name, of in INDICES.items():
        if name in arrays and arrays[name].max() >= sizes[of]:
            raise ValueError(f"{name} name {int(arrays[name].max())} of {sizes[of]} vertices")
    return arrays, facts


def _sizes(arrays: Mapping[str, NDArray[Any]], wanted: Mapping[str, tuple[str | int, ...]]) -> dict[str, int]:
    """Return the number that each letter stands for.

    Raises ValueError for arrays of other shapes.
    """
    found: dict[str, int] = {}
    for name, shape in wanted.items():
        array = arrays.get(name)
        is_index = name in (*INDICES, "steps.step")
        if array is None or array.ndim != len(shape) or array.size == 0 or (array.dtype.kind == "f") == is_index:
            raise ValueError(f"{name} is missing, empty or of another kind")
        for size, expected in zip(array.shape, shape, strict=True):
            if size != (expected if isinstance(expected, int) else found.setdefault(expected, size)):
                raise ValueError(f"{name} is {array.shape}, not {shape}")
    return found
