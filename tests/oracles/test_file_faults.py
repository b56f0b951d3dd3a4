"""Faults of files are what they say, and are taken back."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.file_faults import KINDS, file_fault


def listing(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_changes_one_file_and_is_taken_back(tmp_path, kind):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "one").write_bytes(b"0123456789")
    (tmp_path / "two").write_bytes(b"9876543210")
    before, random = listing(tmp_path), np.random.default_rng(1)
    for _ in range(20):
        with file_fault(tmp_path, kind, random) as fault:
            now = listing(tmp_path)
            assert now != before
            untouched = {name: data for name, data in before.items() if name != fault.path}
            assert now.items() >= untouched.items()
        assert listing(tmp_path) == before
