"""Calibration files: the names that calibration programs use, and every fault told."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.structured_light import encode_calibration, fields_of
from restore.errors import BadInput
from restore.formats.calibration import read_rig
from restore.structured_light import Lens, Projector, Rig

PROJECTOR = Projector(1280, 800)
MUTANTS = 300
EXACT = 1e-12


def rig():
    cosine, sine = np.cos(0.3), np.sin(0.3)
    rotation = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    lens = Lens(np.array([[900.0, 0, 405], [0, 890.0, 296], [0, 0, 1]]), np.array([0.06, -0.11, 4e-4, -3e-4, 0.05]))
    lamp = Lens(np.array([[1500.0, 0, 640], [0, 1500.0, 760], [0, 0, 1]]), np.zeros(5))
    return Rig(lens, lamp, PROJECTOR, rotation, np.array([-250.0, 3.0, 12.0]))


def written(tmp_path, **changes):
    """A calibration file; changes: fields that are other, or None for none."""
    fields = {**fields_of(rig()), **changes}
    path = tmp_path / "calibration.yml"
    path.write_text(encode_calibration({name: value for name, value in fields.items() if value is not None}))
    return path


def test_what_was_written_is_read(tmp_path):
    found = read_rig(written(tmp_path), PROJECTOR)
    for name, value in fields_of(rig()).items():
        np.testing.assert_allclose(fields_of(found)[name], value, atol=EXACT)
    assert found.size is None


def test_the_names_of_procam_calibration_are_known(tmp_path):
    theirs = ("cam_int", "cam_dist", "proj_int", "proj_dist", "rotation", "translation")
    fields = dict(zip(theirs, fields_of(rig()).values(), strict=True))
    path = tmp_path / "calibration.xml"
    path.write_text(encode_calibration(fields, ".xml"))
    np.testing.assert_allclose(read_rig(path, PROJECTOR).shift, rig().shift, atol=EXACT)


def test_sizes_are_read(tmp_path):
    found = read_rig(written(tmp_path, cam_size=np.array([4000, 3000]), proj_size=np.array([1280, 800])))
    assert found.size == (4000, 3000)
    assert found.projector == PROJECTOR


def test_plain_lists_of_json_are_read(tmp_path):
    path = tmp_path / "calibration.json"
    lists = ",\n".join(f'"{name}": {value.tolist()}' for name, value in fields_of(rig()).items())
    path.write_text("{" + lists + "}")
    np.testing.assert_allclose(read_rig(path, PROJECTOR).rotation, rig().rotation, atol=EXACT)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"T": None}, "has no T"),
        ({"R": np.eye(3) * 2}, "not a rotation"),
        ({"R": np.eye(2)}, "not a rotation"),
        ({"T": np.zeros(3)}, "not a translation"),
        ({"cam_K": np.zeros((3, 3))}, "cam_K is not a camera matrix"),
        ({"proj_K": np.eye(2)}, "proj_K is not a camera matrix"),
        ({"proj_kc": np.zeros(7)}, "7 coefficients"),
        ({"cam_size": np.array([0, 2])}, "cam_size"),
        ({"cam_kc": np.array([np.nan] * 5)}, "cam_kc holds a number"),
    ],
)
def test_fields_that_cannot_be_are_named(tmp_path, changes, message):
    with pytest.raises(BadInput, match=message) as fault:
        read_rig(written(tmp_path, **changes), PROJECTOR)
    assert "calibration.yml" in str(fault.value)
    assert fault.value.hint


@pytest.mark.parametrize("suffix", [".yml", ".xml", ".json"])
def test_damaged_files_give_a_rig_or_a_bad_input(tmp_path, suffix):
    text = encode_calibration(fields_of(rig()), suffix).encode()
    rng = np.random.default_rng(7)
    path = tmp_path / f"calibration{suffix}"
    refused = 0
    for _ in range(MUTANTS):
        damaged = bytearray(text)
        for at in rng.integers(0, len(text), rng.integers(1, 6)):
            damaged[at] = rng.integers(0, 256)
        path.write_bytes(bytes(damaged[: rng.integers(1, len(text) + 1)] if rng.random() < 0.3 else damaged))
        try:
            read_rig(path, PROJECTOR)
        except BadInput as fault:
            refused += 1
            assert str(path) in str(fault)
    assert refused > MUTANTS // 10
