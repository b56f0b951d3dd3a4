"""The command `planish batch`."""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import MOST_S, Debug, Json, Kinds, Out, Restoration, Unit, grouped, run_options
from station.commands.terminal import print_note, print_result, report_faults
from station.errors import SET_ASIDE, UsageError

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from station.batch.progress import Event
    from station.workers.executors import Workers

SHARE = 0.9  # of the memory: the rest is the system's
LEAST_MIB = 512  # in less a worker cannot even load its libraries

Sources = Annotated[
    list[Path],
    typer.Argument(
        metavar="SOURCE...",
        help="Folders of scans, sub-folders included, but no sessions in them; sessions.",
        show_default=False,
    ),
]
Count = Annotated[
    int | None, typer.Option("--workers", "-w", min=1, help="Pages to restore at a time (one for each processor).")
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Restore on a Dask cluster: its scheduler, tcp://HOST:8786.")
]
Memory = Annotated[
    int | None,
    typer.Option(min=0, max=2**30, metavar="MIB", help="Memory of each worker, 0 for no limit (an equal share)."),
]
PageLimit = Annotated[
    float, typer.Option(min=1, max=MOST_S, metavar="S", help="Seconds after which a page is given up.")
]
JudgeAs = Annotated[
    str, typer.Option(metavar="PRESET", help="Limits of the verdict on pages of folders: book, map, …, a TOML file.")
]


@grouped
def batch(
    sources: Sources,
    output: Out,
    chosen: Restoration,
    kinds: Kinds,
    workers: Count = None,
    scheduler: Scheduler = None,
    memory: Memory = None,
    page_limit: PageLimit = 3600.0,
    judge_as: JudgeAs = "book",
    unit: Unit = "auto",
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Restore all scans of folders and sessions with several workers; started again, it goes on where it was.

    Ends with 7 when pages were set aside: they could not be restored.
    """
    with report_faults(debug=debug):
        from station.batch.runner import run_batch
        from station.session.presets import load_preset
        from station.workers.executors import cluster_workers, local_workers
        from station.workers.process import Limits

        if workers is not None and scheduler is not None:
            raise UsageError("--workers is the cluster's business", "leave --workers out with --scheduler")
        if memory is not None and 0 < memory < LEAST_MIB:
            raise UsageError(f"--memory: in {memory} MiB no page is restored", f"give {LEAST_MIB} or more, or 0")
        options = run_options("batch", kinds, chosen, unit=unit)
        limits = load_preset(judge_as).thresholds
        count = workers or len(os.sched_getaffinity(0))
        if memory is None and scheduler is None:
            memory = _share_mib(count)
        threads = 1 if scheduler is not None else max(len(os.sched_getaffinity(0)) // count, 1)
        process = Limits(memory, page_limit, threads=threads)
        places: AbstractContextManager[Workers]
        places = local_workers(count, process) if scheduler is None else cluster_workers(scheduler, process, print_note)
        counts: Counter[str] = Counter()

        def show(event: Event) -> None:
            counts[event.state] += 1
            progress = f"  [{event.done}]" if event.done else ""
            if not as_json:
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
            facts = {"restored": counts["restored"], "pages": len(finished.pages), "set_aside": aside}
            print_result(json.dumps({**facts, "report": str(finished.report)}, indent=2))
        else:
            print_result(
                f"{counts['restored']} restored, {counts['set aside']} set aside\nreport     {finished.report}"
            )
        if finished.set_aside:
            raise typer.Exit(SET_ASIDE)


def _share_mib(count: int) -> int:
    """An equal share of this computer's memory for each of so many processes, MiB; not less than each needs."""
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return max(int(pages * SHARE / count) // 2**20, LEAST_MIB)
