"""`python -m bench.edits`: random corrections of a session, and how long they take to record.

Corrections, rules, undo, redo and new captures in random order, each followed by a batch; every restoration is then
derived again and compared to the byte. A rule over 300 pages, its undo and redo are timed.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

from bench.scratch import scratch_folder
from drivers.simulated import Facing, Opening, shoot
from oracles.tiny_scan import tiny_scan
from restore import PageEdits, RangeScan
from station.session import Volume, Writer, add_rule, add_scan, correct, create_session, open_session, redo, undo
from station.session.derivation.parameters import inputs_of, outdated_pages, parameters_of
from station.session.derivation.reproduce import reproduce
from station.session.derivation.service import Derivation, restore_job
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE, VERDICT
from station.session.terms.presets import load_preset
from station.session.terms.rules import Scope, edits_of

PAGES = 300
LEFT, RIGHT = "left", "right"


def opening(seed: int) -> RangeScan:
    """Return a scan of an opened book in the fast mode."""
    scan, _ = shoot(Opening(), Facing(left_mm=100.0, seed=seed), mode="fast", page_mm=(200.0, 130.0))
    return scan


def random_edits(random: Random) -> PageEdits:
    """Return corrections as an operator could make them."""
    parts = {side: {"turn": random.randrange(4), "rotate_deg": random.uniform(-5, 5)} for side in (LEFT, RIGHT)}
    choices: list[dict[str, object]] = [
        {"parts": parts},
        {"layout": random.choice(["split", "whole", LEFT, RIGHT])},
        {"overlap_mm": round(random.uniform(0, 5), 2)},
        {"parts": {"page": {"crop": {"mode": "margin", "margin_mm": random.uniform(0, 5)}}}},
        {"kind": random.choice(["plate", "spread", "cover"]), "note": "torn"},
    ]
    return edits_of(random.choice(choices))


def step(writer: Writer, random: Random, seed: int) -> str:
    """Do one random step, and return its name."""
    page = random.choice([1, 2])

    def again() -> None:
        add_scan(writer, opening(seed), page=page, facts={})

    steps: dict[str, Callable[[], object]] = {
        "correct": lambda: correct(writer, page, random_edits(random)),
        "rule": lambda: add_rule(writer, Scope(side="any", future=random.random() < 0.5), random_edits(random)),
        "undo": lambda: undo(writer) if len(writer.history.done) > 2 else None,
        "redo": lambda: redo(writer),
        "clear": lambda: correct(writer, page, None),
        "again": again,
    }
    name = random.choices([*steps], weights=[6, 3, 5, 3, 1, 1])[0]
    steps[name]()
    return name


def restore_all(writer: Writer) -> int:
    """Restore what is outdated, and return how many pages that were."""
    derivation = Derivation(writer)
    jobs = [derivation.job(capture) for capture in derivation.due()]
    for job in jobs:
        derivation.settle(job, restore_job(job).result)
    return len(jobs)


def replay(folder: Path, count: int, seed: int) -> bool:
    """Do random steps, derive all restorations again, and return whether they are equal to the byte."""
    values = load_preset("book").model_dump(mode="json", exclude_none=True)
    values["settings"] = {"points": 300, "dpi": 40}
    create_session(folder / "book", Volume(title="Edited", preset_values=values))
    random, names, restored = Random(seed), list[str](), 0
    with open_session(folder / "book") as writer:
        for page in (1, 2):
            add_scan(writer, opening(page), facts={})
        for number in range(count):
            restored += restore_all(writer)
            names.append(step(writer, random, number))
        restored += restore_all(writer)
        left = outdated_pages(writer.session)
        runs = list(reproduce(writer.session, folder / "again"))
    differing = [one for one in runs if one.differing]
    done = ", ".join(f"{names.count(name)} {name}" for name in dict.fromkeys(names))
    print(f"seed {seed}: {done}; {restored} restorations, {len(runs)} derived again, {len(differing)} differ")
    checks = sum(one.event.name == VERDICT for one in runs)
    return not differing and not left and len(runs) - checks == restored


def time_rule(folder: Path) -> None:
    """Print how long a rule over PAGES restored pages takes, and its undo and redo."""
    create_session(folder / "rules", Volume(title="Rules"))
    with open_session(folder / "rules") as writer:
        for _ in range(PAGES):
            add_scan(writer, tiny_scan(1), facts={})
        for page in list(writer.history.pages()):
            _record(writer, page.number)
        edits = edits_of({"parts": {"page": {"turn": 1}}})
        for name, work in (
            ("correction recorded", lambda: correct(writer, 7, edits)),
            ("its undo", lambda: undo(writer)),
            (f"rule over {PAGES} pages recorded", lambda: add_rule(writer, Scope(), edits)),
            ("its undo", lambda: undo(writer)),
        ):
            start = time.perf_counter()
            work()
            print(f"{name:<34} {time.perf_counter() - start:.3f} s")


def _record(writer: Writer, number: int) -> None:
    page = writer.history.page(number)
    assert page.capture is not None
    parameters, others = parameters_of(writer.session, page), inputs_of(writer.session, page)
    record_run(writer, RESTORE, page.capture, parameters=parameters, result={}, others=others)


def main() -> int:
    """Print the figures. Returns 1 when a restoration is not derived equal to the byte."""
    parser = argparse.ArgumentParser(prog="python -m bench.edits", description=__doc__)
    parser.add_argument("--count", type=int, default=50, help="random steps")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with scratch_folder() as folder:
        time_rule(folder)
        return 0 if replay(folder, given.count, given.seed) else 1


if __name__ == "__main__":
    sys.exit(main())
