"""Every single fault of an export is found, and the page that it hurts is named."""

from __future__ import annotations

import random
import shutil

import pytest

from restore import BadInput
from station.archive.check import check_export, is_export, page_of
from station.archive.deliver import deliver
from station.archive.formats import Format
from tests.station.archive.conftest import NOW
from tests.station.archive.test_deliver import names, source_of

FLIPS = 8  # in each manifest


@pytest.fixture(scope="module", params=["bagit", "mets", "tiff"])
def export(request, volume, tmp_path_factory):
    out = tmp_path_factory.mktemp("exports") / request.param
    deliver(volume, Format(request.param), out, address="https://example.org", now=NOW, source=source_of)
    return out


@pytest.fixture
def copy(export, tmp_path):
    shutil.copytree(export, tmp_path / "copy")
    return tmp_path / "copy"


def flip(path, at: int) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= 1
    path.write_bytes(data)


def test_an_export_as_it_was_written_has_no_problem(export) -> None:
    assert check_export(export) == []


def test_every_single_fault_of_every_file_is_found(export, tmp_path) -> None:
    rng = random.Random(1)
    for number, name in enumerate(sorted(names(export))):
        for fault in ("flip", "cut", "delete", "rename", "add"):
            copy = tmp_path / f"{number}-{fault}"
            shutil.copytree(export, copy)
            path = copy / name
            if fault == "flip":
                flip(path, rng.randrange(path.stat().st_size))
            elif fault == "cut":
                path.write_bytes(path.read_bytes()[:-1])
            elif fault == "delete":
                path.unlink()
            elif fault == "rename":
                path.rename(path.with_name(f"x{path.name}"))
            else:
                path.with_name(f"{path.name}.more").write_text("more")
            try:
                problems = check_export(copy)
            except BadInput:
                problems = [] if is_export(copy) else [None]
            assert problems, (name, fault)
            if page_of(name) and fault in ("flip", "cut", "delete"):
                (problem,) = problems
                assert (problem.page, problem.path) == (page_of(name), name)
            shutil.rmtree(copy)


def test_every_byte_of_a_manifest_counts(copy) -> None:
    rng = random.Random(2)
    for name in ("manifest-sha512.txt", "tagmanifest-sha512.txt"):
        if not (copy / name).exists():
            continue
        for _ in range(FLIPS):
            at = rng.randrange((copy / name).stat().st_size)
            flip(copy / name, at)
            assert check_export(copy), (name, at)
            flip(copy / name, at)
    assert check_export(copy) == []


def test_a_renamed_file_is_distinguished_from_a_lost_one(copy) -> None:
    name = next(name for name in sorted(names(copy)) if page_of(name))
    (copy / name).rename(copy / "elsewhere.bin")
    (problem,) = check_export(copy)
    assert (problem.kind, problem.moved_to) == ("renamed", "elsewhere.bin")
    assert f"page {page_of(name)}: {name} is renamed to elsewhere.bin" in problem.text


def test_a_folder_that_is_not_an_export_is_refused(tmp_path) -> None:
    with pytest.raises(BadInput, match="not an export"):
        check_export(tmp_path)


@pytest.mark.parametrize(
    ("name", "page"),
    [
        ("data/pages/0012/original/scan/points.npz", 12),
        ("pages/0001/restore/page.png", 1),
        ("images/0003/full/max/0/default.jpg", 3),
        ("0042.tif", 42),
        ("mets.xml", 0),
        ("pages/12/x", 0),
    ],
)
def test_a_path_names_its_page(name, page) -> None:
    assert page_of(name) == page
