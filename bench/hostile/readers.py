"""Everything that Planish reads, and the commands that read it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random

from bench.hostile import samples
from bench.hostile.mutations import mutate
from restore import load_scan
from restore.formats import read_image
from restore.formats.folder import INDEX, POINTS, _sha256
from restore.photo import read_photograph
from station.images.icc import read_profile, srgb_profile
from station.images.pages import read_page
from station.run.overwrite_check import superseded
from station.storage.folder_lock import WORK, recover
from station.storage.journal import JOURNAL

OUT = "out"  # folder of the results of a command
CONFIGS = Path(__file__).parents[2] / "configs"


@dataclass(frozen=True)
class Reader:
    """A reader: the file that is mutated, by which mutations, what writes it with all that belongs to it, and reads it.

    read    gets the path of the file; returns an exit code where it is a command.
    weight  share of the files, relative to the others.
    """

    name: str
    file: str
    kind: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    weight: float = 1.0

    def sound(self, folder: Path) -> dict[str, bytes]:
        """The files of a sound example, by their paths in the folder, which is empty."""
        path = folder / self.file
        path.parent.mkdir(parents=True, exist_ok=True)
        self.write(path)
        return {str(found.relative_to(folder)): found.read_bytes() for found in folder.rglob("*") if found.is_file()}

    def damaged(self, files: dict[str, bytes], rng: Random) -> dict[str, bytes]:
        """The files of an example with one of them mutated."""
        files = {**files, self.file: mutate(files[self.file], self.kind, rng)}
        if self.file == POINTS:  # the checksum agrees, so that the damage reaches the parser
            index = json.loads(files[INDEX])
            index["files"][POINTS] = _sha256(files[POINTS])
            files[INDEX] = json.dumps(index).encode()
        return files


def readers() -> list[Reader]:
    """All readers: scans, what belongs to them, pictures, and the files of the station and of the scanner."""
    scan, folder = samples.write_scan, samples.write_folder
    config = partial(_copy, CONFIGS / "simulated.toml")
    profile = partial(_copy, CONFIGS / "profiles" / "planish-simulated-0.toml")
    photo = partial(samples.write_picture, enlarged=8, exif=_exif())
    return [
        *(Reader(name, f"a.{name}", kind, scan, load_scan, 2) for name, kind in _SCANS.items()),
        Reader("ply, text", "a.ply", "text", partial(samples.write_with_trimesh, encoding="ascii"), load_scan, 2),
        Reader("ply, grid", "a.ply", "text", samples.write_range_grid, load_scan),
        Reader("stl, text", "a.stl", "text", partial(samples.write_with_trimesh, file_type="stl_ascii"), load_scan, 2),
        Reader("vcps", "a.vcps", "mixed", samples.write_point_set, load_scan, 2),
        *(Reader("tifxyz", name, kind, samples.write_tifxyz, _load_folder) for name, kind in _SEGMENT.items()),
        Reader("mtl", "a.mtl", "text", _write_material, lambda path: load_scan(path.with_suffix(".obj"))),
        Reader("folder, index", INDEX, "json", folder, _load_folder),
        Reader("folder, points", POINTS, "zip", folder, _load_folder),
        *(Reader(name, f"a.{name}", kind, samples.write_picture, read_image) for name, kind in _PICTURES.items()),
        Reader("photograph", "a.jpg", "binary", photo, read_photograph),
        Reader("page", "a.png", "png", partial(samples.write_picture, dpi=(150, 150)), read_page),
        Reader("ICC profile", "a.icc", "binary", lambda path: path.write_bytes(srgb_profile()), read_profile, 0.3),
        Reader("configuration", "a.toml", "text", config, _read_station, 2),
        Reader("command profile", "a.toml", "text", profile, _load_profile),
        Reader("calibration", "a.toml", "text", samples.write_calibration, _read_calibration),
        Reader("recording", "a.jsonl", "text", samples.write_recording, _load_replay),
        Reader("bus capture", "a.pcapng", "binary", samples.write_capture, _list_capture),
        Reader("earlier report", "page.json", "json", samples.write_report, _find_superseded, 0.5),
        Reader("journal", f"{OUT}/{WORK}/{JOURNAL}", "json", samples.write_journal, _recover, 0.5),
        Reader("planish restore", "a.ply", "mixed", samples.write_coarse, _restore, 0.25),
        Reader("planish restore", "a.obj", "text", samples.write_coarse, _restore, 0.25),
        Reader("planish colour", "a.png", "png", samples.write_picture, _colour, 0.5),
        Reader("planish trace", "a.pcapng", "binary", samples.write_capture, _trace, 0.5),
    ]


_SCANS = {
    "abs": "text", "abs.gz": "gzip", "wrl": "text", "vvd": "binary", "obj": "text", "ply": "mixed", "stl": "binary",
    "glb": "glb",
}  # fmt: skip
_SEGMENT = {"x.tif": "binary", "z.tif": "binary", "mask.tif": "binary", "meta.json": "json"}
_PICTURES = {"png": "png", "ppm": "mixed", "jpg": "binary", "tif": "binary", "bmp": "binary"}


def command(*words: str | Path) -> int:
    """The exit code of a command of Planish."""
    from station.cli import main

    return main([str(word) for word in words])


def _load_folder(path: Path) -> object:
    """The scan in the folder of a file."""
    return load_scan(path.parent)


def _copy(source: Path, path: Path) -> None:
    shutil.copyfile(source, path)


def _exif() -> bytes:
    from PIL import Image

    exif = Image.Exif()
    exif[0x0112] = 1  # the orientation
    exif.get_ifd(0x8769)[0x920A] = 35.0  # the focal length
    return exif.tobytes()


def _write_material(path: Path) -> None:
    samples.write_scan(path.with_suffix(".obj"))


def _read_station(path: Path) -> None:
    """Read a configuration, and the table of the simulated scanner; its scene is not rendered."""
    from drivers.simulated import config as simulated
    from station.config import load_config

    simulated.read(load_config(path).scanner).scene.build()


def _load_profile(path: Path) -> None:
    from drivers.vivid900.profile.profile import load_profile

    load_profile(path)


def _read_calibration(path: Path) -> None:
    from drivers.vivid900.geometry.calibration import read_calibration

    read_calibration(path)


def _load_replay(path: Path) -> None:
    from drivers.scsi.replay import load_replay

    load_replay(path)


def _list_capture(path: Path) -> None:
    from drivers.trace.capture import read_transfers
    from drivers.trace.exchanges import read_exchanges
    from drivers.trace.listing import list_exchanges

    list(list_exchanges(read_exchanges(read_transfers(path))))


def _find_superseded(path: Path) -> None:
    superseded(path, [path.with_suffix(suffix) for suffix in (".png", ".tif")], [])


def _recover(path: Path) -> None:
    recover(path.parents[1])


def _restore(path: Path) -> int:
    # At few dots to the inch: a damaged coordinate makes a page of metres, whose picture is far larger than the file.
    return command("restore", path, "-o", path.parent / OUT, "--points", "300", "--dpi", "30", "--json")


def _colour(path: Path) -> int:
    return command("colour", path, "-o", path.parent / OUT / "a.icc")


def _trace(path: Path) -> int:
    return command("trace", path, "--json")
