"""The commands that keep sessions: verify, repair, reproduce, reindex."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from station.commands.options import Debug, Json
from station.commands.sessions import Index, Named, find_session, index_path
from station.commands.terminal import print_note, print_result, report_faults
from station.progress import progress_on

if TYPE_CHECKING:
    from station.archive.check import ExportProblem
    from station.session.derivation.reproduce import Reproduced
    from station.session.fixity.verify import Problem

Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", min=1, help="Threads.", show_default="one per processor"),
]


def verify(session: Named, jobs: Jobs = None, index: Index = None, as_json: Json = False, debug: Debug = False) -> None:
    """Check the fixity of every file of a session or export.

    Damaged, missing, extra and renamed files are listed with their pages.
    """
    with report_faults(debug=debug):
        from station.archive.check import AGAIN, check_export, is_export
        from station.session.fixity.verify import NotSound
        from station.session.fixity.verify import verify as inspect

        problems: Sequence[Problem | ExportProblem]
        if is_export(Path(session)):
            folder, problems, hint = Path(session), check_export(Path(session), workers=jobs), AGAIN
        else:
            folder = find_session(index, session)
            problems, hint = inspect(folder, workers=jobs).problems, "run planish repair"
        if as_json:
            _print_json({"folder": str(folder), "problems": [_problem(one) for one in problems]})
        else:
            for problem in problems:
                print_result(problem.text)
        if problems:
            pages = sorted({problem.page for problem in problems if problem.page})
            where = f", on pages {', '.join(map(str, pages))}" if pages else ""
            raise NotSound(f"{folder} has damaged, missing or extra files{where}", hint)
        if not as_json:
            print_result(f"{folder}: all files are as they were written")


def _problem(problem: Problem | ExportProblem) -> dict[str, Any]:
    return {"page": problem.page or None, "path": str(problem.path), "text": problem.text}


def repair(
    session: Named,
    copy: Annotated[Path | None, typer.Option("--from", metavar="COPY", help="Another copy of the session.")] = None,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Repair damaged or missing files of a session.

    A file that is replaced is kept next to the session.
    """
    with report_faults(debug=debug):
        from station.session.fixity.repair import repair as repair_session
        from station.session.fixity.verify import NotSound

        folder = find_session(index, session)
        done = repair_session(folder, copy=copy)
        left = [one for one in done if not one.how]
        if as_json:
            files = [{"path": str(one.problem.path), "repaired": one.how, "reason": one.why_not} for one in done]
            _print_json({"folder": str(folder), "files": files})
        else:
            for one in done:
                print_result(f"{one.problem.path}: {one.how or f'not repaired: {one.why_not}'}")
        if left:
            raise NotSound(f"{folder}: {len(left)} of {len(done)} problems remain", "give a copy with --from")
        if not as_json:
            print_result(f"{folder}: {len(done)} problems repaired" if done else f"{folder}: nothing to repair")


def reproduce(session: Named, index: Index = None, as_json: Json = False, debug: Debug = False) -> None:
    """Regenerate all derivatives and compare checksums.

    Nothing is written to the session.
    """
    with report_faults(debug=debug), progress_on(sys.stderr):
        import tempfile

        from station.session import read_session
        from station.session.derivation.reproduce import reproduce as derive_again
        from station.session.fixity.verify import NotSound

        stored = read_session(find_session(index, session))
        runs: list[Reproduced] = []
        with tempfile.TemporaryDirectory() as scratch:
            for run in derive_again(stored, Path(scratch)):
                runs.append(run)
                if not as_json:
                    outcome = f"differs: {', '.join(run.differing)}" if run.differing else "equal"
                    print_result(f"page {run.event.page}, {run.event.name} of event {run.event.number}: {outcome}")
        if as_json:
            _print_json({"runs": [_run(run) for run in runs]})
        if differing := [run for run in runs if run.differing]:
            why = "; ".join(sorted({run.reason for run in differing} - {""})) or "this version wrote the records itself"
            raise NotSound(
                f"{len(differing)} of {len(runs)} runs differ from their records: {why}",
                "run planish verify; if it finds nothing, reproduce with the program that wrote the records",
            )
        if not as_json:
            print_result(f"{len(runs)} runs, all equal")


def _run(run: Reproduced) -> dict[str, Any]:
    event = run.event
    return {
        "page": event.page,
        "stage": event.name,
        "event": event.number,
        "differing": list(run.differing),
        "reason": run.reason,
    }


def reindex(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FOLDER...", help="Folders with sessions (those that the index knows).", show_default=False
        ),
    ] = None,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Rebuild the index of sessions from their folders."""
    with report_faults(debug=debug):
        from station.session.leaves.index import reindex as rebuild
        from station.session.leaves.index import sessions

        skipped = [str(problem) for problem in rebuild(index_path(index), folders or [])]
        for problem in skipped:
            print_note(f"skipped: {problem}")
        count = len(sessions(index_path(index)))
        if as_json:
            _print_json({"sessions": count, "skipped": skipped})
        else:
            print_result(f"{count} sessions")


def _print_json(value: dict[str, Any]) -> None:
    print_result(json.dumps(value, indent=2, ensure_ascii=False))
