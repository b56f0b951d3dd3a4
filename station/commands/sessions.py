"""The commands of sessions: new, list, show, open, add, set, undo, redo; verify, repair, replay, reindex."""

from __future__ import annotations

import math
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import Debug, Json, new_folder_path, output_path
from station.commands.terminal import print_note, print_result, report_faults
from station.progress import progress_on

if TYPE_CHECKING:
    from station.archive.check import ExportProblem
    from station.session import Event, Session, Writer
    from station.session.verify import Problem

app = typer.Typer(help="Sessions: a volume in a folder, with all its scans and everything made of them.")

Named = Annotated[
    str, typer.Argument(metavar="SESSION", help="The session's folder, or its title.", show_default=False)
]
Index = Annotated[
    Path | None,
    typer.Option(help="Index of all sessions (planish/sessions.sqlite in XDG_DATA_HOME).", parser=output_path),
]
PageNumber = Annotated[int | None, typer.Option("--page", min=1, max=9999, help="Number of the page.")]
Stage = Annotated[str | None, typer.Option(help="A stage, with --page: restore or verdict.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads; one for each processor by default.")]


@app.command("new")
def new(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder to make.", parser=new_folder_path)],
    title: Annotated[str, typer.Option(help="Title of the volume (the folder's name).")] = "",
    project: Annotated[str, typer.Option(help="What the volume belongs to.")] = "",
    organisation: Annotated[str, typer.Option(help="Who keeps it.")] = "",
    preset: Annotated[str, typer.Option(help="book, map, leaflet, crumpled, or a TOML file.")] = "book",
    config: Annotated[
        str, typer.Option(help="Configuration of the station that will shoot it, for planish shoot.")
    ] = "",
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Make a session for a volume."""
    with report_faults(debug=debug):
        from station.config import build_model, load_config
        from station.errors import UsageError
        from station.session import Volume, create_session, read_session
        from station.session.presets import load_preset

        if title and not title.strip():
            raise UsageError("--title: the title is blank", "give one, or leave it out: the folder's name is taken")
        settings = load_preset(preset).model_dump(mode="json", exclude_none=True)
        name = title or os.fsencode(folder.resolve().name).decode(errors="replace")
        if config:
            load_config(Path(config))
        station = str(Path(config).resolve()) if Path(config).is_file() else config
        about = {"title": name, "project": project, "organisation": organisation, "station": station}
        volume = build_model(
            Volume,
            {**about, "preset": Path(preset).stem, "settings": settings},
            name=lambda key: "--config" if key == "station" else f"--{key}",
            hint="see planish session new --help",
        )
        create_session(folder, volume)
        enter(index, read_session(folder))
        print_result(f"{folder}\nshoot its pages with: {shlex.join(['planish', 'shoot', str(folder)])}")


@app.command("list")
def list_sessions(index: Index = None, as_json: Json = False, debug: Debug = False) -> None:
    """List all sessions, the one that was changed last first."""
    with report_faults(debug=debug):
        import json
        from dataclasses import asdict

        from station.session.index import sessions

        entries = sessions(_index(index))
        if as_json:
            print_result(json.dumps([asdict(entry) for entry in entries], indent=2))
            return
        rows = [
            f"{one.changed[:16]}  {one.pages:>5} pages  {one.title}  {one.folder}"
            f"{'' if Path(one.folder).is_dir() else '  (gone)'}"
            for one in entries
        ]
        print_result("\n".join(rows) or "no sessions: make one with planish session new FOLDER")


@app.command("show")
def show(session: Named, index: Index = None, as_json: Json = False, debug: Debug = False) -> None:
    """Show the pages of a session: label, state, verdict, note."""
    with report_faults(debug=debug):
        import json

        from station.session import read_session
        from station.session.overview import overview, overview_lines

        stored = read_session(find_session(index, session))
        print_result(
            json.dumps(overview(stored), indent=2, ensure_ascii=False) if as_json else "\n".join(overview_lines(stored))
        )


@app.command("open")
def open_(session: Named, index: Index = None, debug: Debug = False) -> None:
    """Complete what an interrupted run left, enter the session in the index, show where it stands."""
    with report_faults(debug=debug), _writing(index, session) as writer:
        from station.session.overview import overview_lines

        print_result("\n".join(overview_lines(writer.session)))


@app.command("add")
def add(
    session: Named,
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Scan files or scan folders; with --photos photographs.")
    ],
    page: PageNumber = None,
    unit: Annotated[str, typer.Option(help="Unit of a mesh's coordinates, as for planish restore.")] = "auto",
    photos: Annotated[
        bool, typer.Option("--photos", help="The files, or a folder of them, are photographs of one page: one capture.")
    ] = False,
    scale: Annotated[str, typer.Option(help="Scale of photographs, as for planish photos.")] = "card",
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Take scans of any supported format into a session as pages, unchanged."""
    with report_faults(debug=debug), _writing(index, session) as writer:
        from station.errors import UsageError
        from station.session.adding import add_original, gather
        from station.session.photographs import add_photographs

        if photos:
            event = add_photographs(writer, files, page=page, scale=scale)
            print_result(f"page {event.page}: {len(event.files)} photographs")
            return
        if page is not None and len(files) > 1:
            raise UsageError("several files cannot be one page", "give one file with --page")
        for path in files:  # all are added, or none
            gather(path)
        for path in files:
            event = add_original(writer, path, page=page, unit=unit)
            print_result(f"page {event.page}: {path}")


@app.command("set")
def set_(
    session: Named,
    page: Annotated[int, typer.Argument(metavar="PAGE", min=0, max=9999, help="Number of the page, 0: the volume.")],
    label: Annotated[str | None, typer.Option(help="Label, as it is printed on the page.")] = None,
    side: Annotated[str | None, typer.Option(help="left, right, recto, verso, …")] = None,
    note: Annotated[str | None, typer.Option(help="A note.")] = None,
    position: Annotated[float | None, typer.Option(help="Place in the volume: 3.5 is between 3 and 4.")] = None,
    mark: Annotated[bool | None, typer.Option("--mark/--no-mark", help="Mark the page to come back to.")] = None,
    accept: Annotated[bool | None, typer.Option("--accept/--again", help="Accept its scan, or want another.")] = None,
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Decide on a page; every decision can be undone."""
    with report_faults(debug=debug), _writing(index, session) as writer:
        from station.errors import UsageError
        from station.session import decide
        from station.session.texts import check_text

        if position is not None and not math.isfinite(position):
            raise UsageError(f"--position: {position} is no place", "give a number: 3.5 is between 3 and 4")
        capture = writer.history.page(page).capture
        if page and capture is None:
            raise _no_page(session, page)
        values = {"label": label, "side": side, "note": note, "position": position, "mark": mark}
        if accept is None and set(values.values()) == {None}:
            raise UsageError("there is nothing to set", "see planish session set --help")
        if accept is not None and not page:
            raise UsageError("the volume itself is not accepted", "give the number of a page with --accept or --again")
        for name, value in values.items():
            if value is not None:
                decide(writer, name, check_text(name, value) if isinstance(value, str) else value, page=page)
        if accept is not None:
            decide(writer, "accept", accept, page=page, on=capture)


@app.command("undo")
def undo_(
    session: Named, page: PageNumber = None, stage: Stage = None, index: Index = None, debug: Debug = False
) -> None:
    """Take back the last step of the operator, or the last run of a stage on a page; nothing is deleted."""
    with report_faults(debug=debug):
        from station.session import undo, undo_run

        _step(index, session, page, stage, undo, undo_run, ("undo", "undone"))


@app.command("redo")
def redo_(
    session: Named, page: PageNumber = None, stage: Stage = None, index: Index = None, debug: Debug = False
) -> None:
    """Bring back the step that was taken back last, or the next run of a stage on a page."""
    with report_faults(debug=debug):
        from station.session import redo, redo_run

        _step(index, session, page, stage, redo, redo_run, ("redo", "brought back"))


def verify(session: Named, workers: Workers = None, index: Index = None, debug: Debug = False) -> None:
    """Check every file of a session or an export: damaged, missing, extra, renamed, at odds. Names the pages."""
    with report_faults(debug=debug):
        from station.archive.check import AGAIN, check_export, is_export
        from station.session.verify import verify as inspect

        if is_export(Path(session)):
            _print_problems(Path(session), check_export(Path(session), workers=workers), AGAIN)
        else:
            folder = find_session(index, session)
            problems = inspect(folder, workers=workers).problems
            _print_problems(folder, problems, "planish repair mends what can be mended")


def _print_problems(folder: Path, problems: Sequence[Problem | ExportProblem], remedy: str) -> None:
    """Print each problem; raises NotSound when there is one."""
    from station.session.verify import NotSound

    for problem in problems:
        print_result(problem.text)
    if problems:
        pages = sorted({problem.page for problem in problems if problem.page})
        where = f", on pages {', '.join(map(str, pages))}" if pages else ""
        raise NotSound(f"{folder} is not sound{where}", remedy)
    print_result(f"{folder}: all files are as they were written")


def repair(
    session: Named,
    copy: Annotated[Path | None, typer.Option("--from", metavar="COPY", help="Another copy of the session.")] = None,
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Mend what `planish verify` finds; what is replaced is kept beside the session."""
    with report_faults(debug=debug):
        from station.session.repair import repair as mend
        from station.session.verify import NotSound

        folder = find_session(index, session)
        done = mend(folder, copy=copy)
        for one in done:
            print_result(f"{one.problem.path}: {one.how or f'not mended: {one.why_not}'}")
        left = [one for one in done if not one.how]
        if left:
            raise NotSound(f"{folder}: {len(left)} of {len(done)} problems are left", "give a copy with --from")
        print_result(f"{folder}: {len(done)} problems mended" if done else f"{folder}: nothing to mend")


def replay(session: Named, index: Index = None, debug: Debug = False) -> None:
    """Derive everything again from the originals and compare digests; nothing is written to the session."""
    with report_faults(debug=debug), progress_on(sys.stderr):
        import tempfile

        from station.session import read_session
        from station.session.replay import replay as derive_again
        from station.session.verify import NotSound

        stored = read_session(find_session(index, session))
        count, differing = 0, 0
        with tempfile.TemporaryDirectory() as scratch:
            for one in derive_again(stored, Path(scratch)):
                count += 1
                differing += bool(one.differing)
                verdict = f"differs: {', '.join(one.differing)}" if one.differing else "equal"
                print_result(f"page {one.event.page}, {one.event.name} of event {one.event.number}: {verdict}")
        if differing:
            raise NotSound(f"{differing} of {count} runs came out otherwise", "was it made by another version?")
        print_result(f"{count} runs, all equal")


def reindex(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FOLDER...", help="Folders with sessions (those that the index knows).", show_default=False
        ),
    ] = None,
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Build the index of all sessions anew from their folders."""
    with report_faults(debug=debug):
        from station.session.index import reindex as rebuild
        from station.session.index import sessions

        for problem in rebuild(_index(index), folders or []):
            print_note(f"left out: {problem}")
        print_result(f"{len(sessions(_index(index)))} sessions")


def _step(
    index: Path | None,
    session: str,
    page: int | None,
    stage: str | None,
    move: Callable[[Writer], Event | None],
    move_run: Callable[[Writer, int, str], Event | None],
    words: tuple[str, str],
) -> None:
    """Undo or redo the operator's step, or a stage's run on a page. words: what it is called, and called when done."""
    from station.errors import UsageError
    from station.session.stages import STAGES

    with _writing(index, session) as writer:
        if (page is None) != (stage is None):
            raise UsageError("--page and --stage go together", "name both, or none for the last step of the operator")
        if stage is not None and stage not in STAGES:
            raise UsageError(f"--stage: there is no stage {stage!r}", f"the stages are {', '.join(STAGES)}")
        if page is not None and writer.history.page(page).capture is None:
            raise _no_page(session, page)
        step = move_run(writer, page, stage) if page and stage else move(writer)
    if step is None:
        print_result(f"nothing to {words[0]}")
    else:
        print_result(f"{words[1]}: {step.name} of page {step.page}, event {step.number}")


def _no_page(session: str, page: int) -> Exception:
    from station.errors import UsageError

    show = shlex.join(["planish", "session", "show", session])
    return UsageError(f"the session has no page {page}", f"{show} lists its pages")


def _index(given: Path | None) -> Path:
    from station.session.index import default_index

    return given or default_index(os.environ)


def find_session(index: Path | None, name: str) -> Path:
    from station.session.index import find

    return find(_index(index), name)


def enter(index: Path | None, session: Session) -> None:
    """Enter a session in the index; a fault of the index is a note, no more."""
    from restore import BadInput
    from station.session.index import IndexUnusable, update

    try:
        update(_index(index), session)
    except BadInput as error:
        print_note(f"the index was not updated: {error}; {error.hint}, then planish reindex enters it")
    except (IndexUnusable, OSError) as error:
        print_note(f"the index was not updated: {error}; planish reindex rebuilds it")


@contextmanager
def _writing(index: Path | None, name: str) -> Iterator[Writer]:
    """The session, opened for writing; its entry in the index follows when the block ends."""
    from station.session import open_session

    with open_session(find_session(index, name)) as writer:
        try:
            yield writer
        finally:
            enter(index, writer.session)
