"""The command `planish colour`: from a chart to a profile.

The chart is captured; the profile comes with its figures.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from restore import BadInput, Finding, Settings, load_scan, restore
from restore.files import read_regular
from restore.formats import IMAGE_SUFFIXES, read_image
from restore.scan import Bytes
from station.colour.chart import find_chart
from station.colour.figures import UNMEASURED, mean_differences, quality_figures
from station.colour.fit import ColourFit, fit_colours
from station.images.icc import encode_profile
from station.page_files.report import encode_report
from station.run.overwrite_check import MAX_REPORT_BYTES
from station.storage.atomic import lock_output_folder, refuse_existing, write_all

SUFFIX = ".icc"


@dataclass(frozen=True)
class ColourRun:
    """The figures and the files that were written."""

    report: Mapping[str, Any]
    files: tuple[Path, ...]


def profile_colours(target: Path, output: Path, *, force: bool = False) -> ColourRun:
    """Measure a chart; write the profile and, next to it, the figures.

    The chart is in a picture, a restored page or a scan. Raises OverwriteError, BadInput, NotEnoughSurface, OSError
    when the disk refuses.
    """
    profile = output if output.suffix.lower() == SUFFIX else output.with_name(output.name + SUFFIX)
    files = [profile, profile.with_suffix(".json")]
    refuse_existing(files, force=force)
    image, ppi = _read_target(target)
    fit = fit_colours(find_chart(image))
    report = {
        "target": str(target),
        "exponent": round(fit.exponent, 4),
        "matrix": fit.matrix.round(6).tolist(),
        "mean_difference": mean_differences(fit),
        "light_fall_off": round(fit.fall_off, 3),
        "figures": quality_figures(fit, ppi=ppi),
        "findings": [one.as_json() for one in _findings(fit)],
        "not_measured": [*UNMEASURED, *([] if ppi else ["sampling"])],
    }
    contents = (encode_profile(fit.profile(profile.stem)), encode_report(report).encode())
    with lock_output_folder(profile.parent) as lock:
        return ColourRun(report, tuple(write_all(zip(files, contents, strict=True), force=force, lock=lock)))


def summary_line(run: ColourRun) -> str:
    """A summary of the figures, one line each."""
    change = ", ".join(f"{value:.2f} {how}" for how, value in run.report["mean_difference"].items())
    lines = [f"{'chart':<28} mean ΔE2000 {change}"]
    for figure in run.report["figures"]:
        levels = [f"{name}: {figure[name] or 'none'}" for name in ("FADGI", "ISO 19264-1") if name in figure]
        lines.append(f"{figure['figure']:<28} {figure['value']:>7.2f} {figure['unit']:<9} {', '.join(levels)}")
    lines += [f"{one['severity']:<28} {one['text']}" for one in run.report["findings"]]
    lines.append(f"{'not measured':<28} {', '.join(run.report['not_measured'])}: no level as a whole is claimed")
    return "\n".join([*lines, *(f"{'file':<28} {path}" for path in run.files)])


def _findings(fit: ColourFit) -> list[Finding]:
    return [Finding.of("uneven_light", fit.fall_off)] if fit.fall_off else []


def _read_target(target: Path) -> tuple[Bytes, float | None]:
    """The picture (h, w, 3) of the target, and its pixels per inch where known."""
    if target.suffix.lower() in IMAGE_SUFFIXES:
        return read_image(target), _resolution(target.with_suffix(".json"))
    page = restore(load_scan(target), Settings())
    if page.flat.texture is None:
        raise BadInput(f"{target} has no colour image", "capture the chart with the scanner's colour exposure")
    return page.image, page.report["sampling_ppi"]


def _resolution(report: Path) -> float | None:
    """Pixels per inch of a page's source, from its report; None without one."""
    try:
        return float(json.loads(read_regular(report, MAX_REPORT_BYTES))["sampling_ppi"]) or None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
