"""The command `planish batch`."""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import (
    MAX_S,
    Debug,
    FileReading,
    Json,
    Kinds,
    Out,
    Restoration,
    grouped,
    reading_options,
    run_options,
)
from station.commands.terminal import print_note, print_result, report_faults
from station.errors import SET_ASIDE, UsageError

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from station.batch.progress import Event
    from station.workers.executors import Workers

MEMORY_FRACTION = 0.9  # of the memory: the rest is the system's
MIN_MIB = 512  # in less a worker cannot even load its libraries

Sources = Annotated[
    list[Path],
    typer.Argument(
        metavar="SOURCE...",
        help="Folders of scans, searched with their sub-folders, and sessions.",
        show_default=False,
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", min=1, help="Pages to restore at a time.", show_default="one per processor"),
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Restore on a Dask cluster with this scheduler: tcp://HOST:8786.")
]
MemoryLimit = Annotated[
    int | None,
    typer.Option(
        min=0, max=2**30, metavar="MIB", help="Memory limit of each worker; 0: none.", show_default="an equal part"
    ),
]
PageTimeout = Annotated[
    float, typer.Option(min=1, max=MAX_S, metavar="S", help="Seconds after which a page is quarantined.")
]
QualityPreset = Annotated[
    str, typer.Option(metavar="PRESET", help="Preset of the quality check for folders: book, map, … or a TOML file.")
]


@grouped
def batch(
    sources: Sources,
    output: Out,
    chosen: Restoration,
    kinds: Kinds,
    reading: FileReading,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    memory_limit: MemoryLimit = None,
    page_timeout: PageTimeout = 3600.0,
    quality_preset: QualityPreset = "book",
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Restore all scans of folders and sessions in parallel.

    Started again, it continues where it was interrupted. Ends with 7 when pages were set aside: they could not be
    restored.
    """
    with report_faults(debug=debug):
        from station.batch.runner import run_batch
        from station.session.terms.presets import load_preset
        from station.workers.executors import cluster_workers, local_workers
        from station.workers.process import Limits

        if jobs is not None and scheduler is not None:
            raise UsageError("--jobs is the cluster's business", "leave --jobs out with --scheduler")
        if memory_limit is not None and 0 < memory_limit < MIN_MIB:
            raise UsageError(
                f"--memory-limit: in {memory_limit} MiB no page is restored", f"give {MIN_MIB} or more, or 0"
            )
        options = run_options("batch", kinds, chosen, **reading_options(reading))
        limits = load_preset(quality_preset).thresholds
        count = jobs or len(os.sched_getaffinity(0))
        if memory_limit is None and scheduler is None:
            memory_limit = _memory_per_process_mib(count)
        threads = 1 if scheduler is not None else max(len(os.sched_getaffinity(0)) // count, 1)
        process = Limits(memory_limit, page_timeout, threads=threads)
        places: AbstractContextManager[Workers]
        places = local_workers(count, process) if scheduler is None else cluster_workers(scheduler, process, print_note)
        counts: Counter[str] = Counter()

        def show(event: Event) -> None:
            counts[event.state] += 1
            if as_json:
                print_result(json.dumps({"state": event.state, "name": event.name, "text": event.text}))
                return
            progress = f"  [{event.done}]" if event.done else ""
            print_result(f"{event.state:<10} {event.name}: {event.text}{progress}")

        finished = run_batch(
            list(dict.fromkeys(source.resolve() for source in sources)),
            output.resolve(),
            options,
            places,
            show,
            limits=limits,
        )
        if as_json:
            aside = [{"name": page.name, "reasons": list(page.notes)} for page in finished.set_aside]
            facts = {"counts": dict(counts), "pages": len(finished.pages), "set_aside": aside}
            print_result(json.dumps({**facts, "report": str(finished.report)}))
        else:
            print_result(
                f"{counts['restored']} restored, {counts['set aside']} set aside\nreport     {finished.report}"
            )
        if finished.set_aside:
            raise typer.Exit(SET_ASIDE)


def _memory_per_process_mib(count: int) -> int:
    """Return an equal part of this computer's memory for each process, MiB.

    Not less than each needs.
    """
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return max(int(pages * MEMORY_FRACTION / count) // 2**20, MIN_MIB)
