"""What a glTF file refers to comes into one binary chunk, wherever it was."""

from __future__ import annotations

import base64
import json

import pytest

from restore.errors import BadInput
from restore.formats.gltf.gltf_buffers import gathered

DATA = bytes(range(12))


def header(uri=None):
    buffer = {"byteLength": len(DATA)} | ({} if uri is None else {"uri": uri})
    return json.dumps({"buffers": [buffer], "bufferViews": [{"buffer": 0, "byteLength": len(DATA)}]}).encode()


@pytest.mark.parametrize("place", ["chunk", "uri", "file"])
def test_a_buffer_is_found_in_the_chunk_in_the_header_and_in_a_file(tmp_path, place):
    (tmp_path / "a.bin").write_bytes(DATA)
    uris = {"chunk": None, "uri": "data:;base64," + base64.b64encode(DATA).decode(), "file": "a.bin"}
    changed, binary = gathered(tmp_path / "a.gltf", header(uris[place]), DATA if place == "chunk" else None)
    view = json.loads(changed)["bufferViews"][0]
    assert binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] == DATA


@pytest.mark.parametrize("content", [header("gone.bin"), b"{", b"[]", b'{"buffers": 3}'])
def test_a_header_that_leads_nowhere_is_refused(tmp_path, content):
    with pytest.raises(BadInput, match=r"a\.gltf"):
        gathered(tmp_path / "a.gltf", content, None)
