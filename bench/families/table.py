"""One line for every family and sampler, and what it comes to: position errors and times beside libigl's."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from bench.families.samplers import MAX_FOLDED, Sample, random_sample
from oracles.markers import rigid_residual
from restore import RestoreError, flatten
from restore.mesh.measures import signed_areas, straight_lengths
from restore.mesh.topology import Topology
from restore.scan import Floats, SurfaceMesh

OURS, EXACT, CHORDS, ARAP, SLIM = "isometric", "exact lengths", "own chords", "ARAP", "SLIM"
APPLICABLE = "applicable"
COLUMNS = (OURS, EXACT, CHORDS, APPLICABLE, ARAP, SLIM)
PEERS = (ARAP, SLIM)
SAME, SAME_MM = 1.05, 0.003  # a page of 280 mm is worse than another by more than 5 % + 3 µm
PAGE_MM = 280.0
CONVERGED = 1e-5  # of the page, that exact lengths may leave
SLOW = {ARAP: (8.0, 3.0), SLIM: (15.0, 5.0)}  # median and least time of a peer over ours that is asked for
ROUNDS = 2  # of all methods in turn; the least time counts
ROW = "{:<12}{:<15}{:<20}{:>6}{:>7} " + "{:>14}" * 6 + "{:>9}" * 3

Method = Callable[[SurfaceMesh], Floats]


@dataclass(frozen=True)
class Row:
    """A mesh: rms mm on a page of 280 mm, by method; least seconds of processor time by method.

    lengths_kept  whether the page by exact lengths has them: off the truth, it is another page with the same lengths.
    """

    seed: int
    sample: Sample
    rms_mm: dict[str, float]
    seconds: dict[str, float]
    lengths_kept: bool

    @property
    def best_peer_mm(self) -> float:
        """rms mm of the better of ARAP and SLIM."""
        return min(self.rms_mm[peer] for peer in PEERS if peer in self.rms_mm)

    @property
    def torn_up(self) -> bool:
        """Whether more than MAX_FOLDED of the faces, or of the page's area, is folded over."""
        areas = signed_areas(self.sample.flat, self.sample.mesh.faces)
        folded = areas * areas.sum() < 0.0
        return bool(folded.mean() > MAX_FOLDED or np.abs(areas[folded]).sum() > MAX_FOLDED * abs(areas.sum()))


def run(points: int, count: int, seed: int, without: tuple[str, ...] = ()) -> list[Row]:
    """Print a line for each of `count` meshes of about `points` vertices, of seeds from `seed` on, and the verdicts.

    Interrupted, it gives the verdicts on the meshes until then.
    """
    print(f"\n{count} random meshes of about {points} vertices, seeds from {seed}; rms mm scaled to a page of 280 mm")
    print(
        ROW.format(
            *("seed", "family", "sampler", "count", "noise", *COLUMNS),
            *("ours ms", "×A", "×S"),
        )
    )
    rows = list[Row]()
    with suppress(KeyboardInterrupt):
        for k in range(seed, seed + count):
            rows.append(measured(k, points, without))
            print(_line(rows[-1]), flush=True)
    verdicts(rows)
    return rows


def measured(seed: int, points: int, without: tuple[str, ...] = ()) -> Row:
    """What every method makes of the mesh of a seed; one that fails is off by infinity."""
    from bench import libigl

    sample = random_sample(seed, points)
    edges = Topology(sample.mesh.faces).edges
    truth, chords = straight_lengths(sample.flat, edges), straight_lengths(sample.mesh.vertices, edges)
    methods: dict[str, Method] = {
        OURS: lambda mesh: flatten(mesh).flat,
        EXACT: lambda mesh: flatten(mesh, lengths=truth).flat,
        CHORDS: lambda mesh: flatten(mesh, lengths=chords).flat,
        APPLICABLE: lambda mesh: flatten(mesh, APPLICABLE).flat,
        ARAP: libigl.arap,
        SLIM: libigl.slim,
    }
    for name in without:
        del methods[name]
    seconds, error = dict.fromkeys(methods, np.inf), dict.fromkeys(methods, np.inf)
    to_page, lengths_kept = PAGE_MM / float(np.ptp(sample.flat, axis=0).max()), False
    for _ in range(ROUNDS):
        for name, method in methods.items():
            start = time.process_time()
            try:
                flat = method(sample.mesh)
            except (RestoreError, RuntimeError):
                continue
            seconds[name] = min(seconds[name], time.process_time() - start)
            rest, _ = rigid_residual(flat, sample.flat) if np.isfinite(flat).all() else (np.full((1, 2), np.inf), 0)
            error[name] = to_page * float(np.sqrt((rest**2).sum(axis=1).mean()))
            if name == EXACT:
                missed = to_page * np.abs(straight_lengths(flat, edges) - truth).max()
                lengths_kept = bool(missed < CONVERGED * PAGE_MM)
    return Row(seed, sample, error, seconds, lengths_kept)


def _line(row: Row) -> str:
    errors = (f"{row.rms_mm[name]:.4f}" if name in row.rms_mm else "" for name in COLUMNS)
    ours = row.seconds[OURS]
    ratios = (f"{row.seconds[name] / ours:.1f}" if name in row.seconds else "" for name in PEERS)
    sample = row.sample
    head = row.seed, sample.family, sample.sampler, len(sample.flat), f"{sample.noise_mm:.2f}"
    return ROW.format(*head, *errors, f"{1e3 * ours:.1f}", *ratios)


def verdicts(rows: list[Row]) -> None:
    """Print how many meshes are worse than the best peer and than chords, and the ratios of the times."""
    ours = np.array([row.rms_mm[OURS] for row in rows])
    whole = np.array([not row.torn_up for row in rows])
    print(f"more than {MAX_FOLDED:.0%} of faces or area folded over: {(~whole).sum()} of {len(rows)} meshes")
    for name, bound in (
        ("the best of ARAP and SLIM", np.array([row.best_peer_mm for row in rows])),
        ("its own chords", np.array([row.rms_mm[CHORDS] for row in rows])),
    ):
        worse = ours > SAME * bound + SAME_MM
        print(f"worse than {name} by more than 5 % + 3 µm: {_counted(worse, whole)}")
    names = [name for name in (OURS, CHORDS, APPLICABLE, *PEERS) if name in rows[0].rms_mm]
    print("median / worst rms mm: " + ", ".join(f"{n} {_median_worst([r.rms_mm[n] for r in rows])}" for n in names))
    off = np.array([row.rms_mm[EXACT] for row in rows]) / PAGE_MM > CONVERGED
    kept = np.array([row.lengths_kept for row in rows])
    print(f"exact lengths leave more than {CONVERGED:.0e} of the page on {_counted(off, whole)}")
    print(f"of these other pages with the same lengths: {_counted(off & kept, whole)}")
    for peer, (median, least) in SLOW.items():
        if peer in rows[0].seconds:
            ratios = [row.seconds[peer] / row.seconds[OURS] for row in rows]
            print(
                f"time of {peer} over ours: median {statistics.median(ratios):.1f} (asked {median:.0f}), "
                f"least {min(ratios):.1f} (asked {least:.0f})"
            )
    taken = [row.seconds[OURS] for row in rows]
    each = [row.seconds[OURS] / len(row.sample.flat) for row in rows]  # a decimator may leave eight times what is asked
    by_mesh, by_vertex = (max(times) / statistics.median(times) for times in (taken, each))
    print(f"slowest over median: {by_mesh:.1f} by mesh, {by_vertex:.1f} by vertex (asked 3)")


def _counted(found: np.ndarray, whole: np.ndarray) -> str:
    shares = (f"{among.sum()} of {len(among)} ({among.mean():.1%})" for among in (found, found[whole]))
    return ", without those ".join(shares)


def _median_worst(errors: list[float]) -> str:
    return f"{statistics.median(errors):.3f} / {max(errors):.2f}"
