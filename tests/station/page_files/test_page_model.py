"""A page's model that is read back: whatever somebody wrote into it, no index reaches a kernel unchecked."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.page_files.model import encode_arrays
from station.page_files.page_model import decode_model

N, P = 4, 3


def arrays(**changed) -> dict[str, np.ndarray]:
    """A page of two faces with steps, some of its arrays replaced; None leaves one out."""
    found = {
        "vertices": np.zeros((N, 3), np.float32),
        "flat": np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32),
        "strain": np.zeros(N, np.float32),
        "page_uv": np.zeros((N, 2), np.float32),
        "faces": np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
        "uv": np.zeros((N, 2), np.float32),
        "steps.positions": np.zeros((5, P, 3), np.float32),
        "steps.step": np.arange(5, dtype=np.uint32),
        "steps.faces": np.array([[0, 1, 2]], np.uint32),
        "steps.uv": np.zeros((P, 2), np.float32),
    }
    changed = {name.replace("__", "."): array for name, array in changed.items()}
    return {name: array for name, array in (found | changed).items() if array is not None}


def test_a_model_comes_back():
    found, facts = decode_model(encode_arrays(arrays(), {"dpi": 150.0}))
    assert facts == {"dpi": 150.0}
    assert set(found) == set(arrays())
    without = {name: None for name in arrays() if name.startswith("steps")} | {"uv": None}
    assert len(decode_model(encode_arrays({k: v for k, v in arrays().items() if k not in without}, facts))[0]) == 5


@pytest.mark.parametrize(
    "changed",
    [
        {"faces": np.array([[0, 1, N]], np.uint32)},
        {"faces": np.array([[0, 1, 2**32 - 1]], np.uint32)},
        {"faces": np.zeros((2, 4), np.uint32)},
        {"faces": np.zeros((0, 3), np.uint32)},
        {"faces": np.zeros((2, 3), np.float32)},
        {"faces": None},
        {"steps__faces": np.array([[0, 1, P]], np.uint32)},
        {"steps__uv": np.zeros((P + 1, 2), np.float32)},
        {"steps__positions": None},
        {"strain": np.zeros(N + 1, np.float32)},
        {"strain": np.full(N, np.nan, np.float32)},
        {"vertices": np.zeros((N, 2), np.float32)},
        {"vertices": np.full((N, 3), 1e30, np.float32)},
        {"flat": np.full((N, 2), np.inf, np.float32)},
        {"page_uv": np.full((N, 2), 1e9, np.float32)},
        {"page_uv": None},
    ],
)
def test_arrays_that_a_kernel_cannot_take_are_refused(changed):
    with pytest.raises(ValueError, match=r"\w"):
        decode_model(encode_arrays(arrays(**changed), {"dpi": 150.0}))


@pytest.mark.parametrize("dpi", [None, 0, -150.0, float("nan"), float("inf"), "150", [150.0]])
def test_a_resolution_that_cannot_be_is_refused(dpi):
    with pytest.raises(ValueError, match="resolution"):
        decode_model(encode_arrays(arrays(), {"dpi": dpi}))


HEADER = json.dumps({"arrays": {"faces": {"type": "uint32", "shape": [1, 3], "offset": 0}}}).encode()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"[1, 3]", b"[-1,3]"),
        (b"[1, 3]", b"[1e9]"),
        (b"[1, 3]", b'"1,3"'),
        (b"uint32", b"object"),
        (b'"offset": 0', b'"offset":-9'),
        (b'"offset": 0', b'"offset":99'),
        (b'{"arrays": {', b'{"arrays": ['),
        (b"[1, 3]", b"[999999999999999999999999]"),
    ],
)
def test_a_header_that_lies_is_refused(old, new):
    header = HEADER.replace(old, new)
    with pytest.raises(ValueError, match=r"\w"):
        decode_model(b"PLM1" + len(header).to_bytes(4, "little") + header + bytes(12))


@given(st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=8))
def test_what_is_read_of_a_damaged_model_has_indices_within_it(changes):
    data = bytearray(encode_arrays(arrays(), {"dpi": 150.0}))
    for place, byte in changes:
        data[place % len(data)] = byte
    try:
        found, _ = decode_model(bytes(data))
    except ValueError:
        return
    assert found["faces"].max() < len(found["vertices"]) == len(found["flat"]) == len(found["page_uv"])
    assert np.isfinite(found["page_uv"]).all()
