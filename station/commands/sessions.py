"""The commands `planish session …`: new, list, show, recover, add, set, undo, redo."""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.groups import CommandGroups, with_verbosity
from station.commands.options import Debug, FileReading, Json, grouped, new_folder_path, output_path, reading_options
from station.commands.terminal import print_note, print_result, report_faults

if TYPE_CHECKING:
    from station.session import Event, Session, Writer

app = typer.Typer(cls=CommandGroups, help="Create and edit sessions: one volume in one folder.", rich_markup_mode=None)

Named = Annotated[
    str, typer.Argument(metavar="SESSION", help="The session's folder, or its title.", show_default=False)
]
Index = Annotated[
    Path | None,
    typer.Option(help="Index of all sessions.", parser=output_path, envvar="PLANISH_INDEX", hidden=True),
]
PageNumber = Annotated[int | None, typer.Option("--page", min=1, max=9999, help="Number of the page.")]
Stage = Annotated[str | None, typer.Option(help="A stage, with --page: restore or verdict.")]


@app.command("new")
@with_verbosity
def new(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder to create.", parser=new_folder_path)],
    title: Annotated[str, typer.Option(help="Title of the volume.", show_default="the folder's name")] = "",
    project: Annotated[str, typer.Option(help="Project or collection of the volume.")] = "",
    organisation: Annotated[str, typer.Option(help="Institution that holds the volume.")] = "",
    preset: Annotated[str, typer.Option(help="Preset: book, map, leaflet, crumpled, or a TOML file.")] = "book",
    config: Annotated[str, typer.Option(help="Configuration of the station for `planish capture`.")] = "",
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Create a session for a volume."""
    with report_faults(debug=debug):
        from station.config import build_model, load_config
        from station.errors import UsageError
        from station.session import Volume, create_session, read_session
        from station.session.terms.presets import load_preset

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
            {**about, "preset": Path(preset).stem, "preset_values": settings},
            name=lambda key: "--config" if key == "station" else f"--{key}",
            hint="see planish session new --help",
        )
        create_session(folder, volume)
        enter(index, read_session(folder))
        print_result(f"{folder}\ncapture its pages with: {shlex.join(['planish', 'capture', str(folder)])}")


@app.command("list")
@with_verbosity
def list_sessions(index: Index = None, as_json: Json = False, debug: Debug = False) -> None:
    """List all sessions, most recently changed first."""
    with report_faults(debug=debug):
        import json
        from dataclasses import asdict

        from station.session.leaves.index import sessions

        entries = sessions(index_path(index))
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
@with_verbosity
def show(session: Named, index: Index = None, as_json: Json = False, debug: Debug = False) -> None:
    """Show the pages of a session: label, state, check, note."""
    with report_faults(debug=debug):
        import json

        from station.session import read_session
        from station.session.leaves.overview import overview, overview_lines

        stored = read_session(find_session(index, session))
        print_result(
            json.dumps(overview(stored), indent=2, ensure_ascii=False) if as_json else "\n".join(overview_lines(stored))
        )


@app.command("recover")
@with_verbosity
def recover(session: Named, index: Index = None, debug: Debug = False) -> None:
    """Recover a session after an interrupted run."""
    with report_faults(debug=debug), writing(index, session) as writer:
        from station.session.leaves.overview import overview_lines

        print_result("\n".join(overview_lines(writer.session)))


@app.command("add")
@with_verbosity
@grouped
def add(
    session: Named,
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Scan files or scan folders; with --photos photographs.")
    ],
    reading: FileReading,
    page: PageNumber = None,
    photos: Annotated[bool, typer.Option("--photos", help="The files or folder are photographs of one page.")] = False,
    scale: Annotated[str, typer.Option(help="Scale of photographs, as of `planish photos`.")] = "card",
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Add scans or photographs to a session as pages.

    The files are copied unchanged.
    """
    with report_faults(debug=debug), writing(index, session) as writer:
        from station.errors import UsageError
        from station.session.captures.originals import add_original, add_originals
        from station.session.captures.photographs import add_photographs

        if photos:
            event = add_photographs(writer, files, page=page, scale=scale)
            print_result(f"page {event.page}: {len(event.files)} photographs")
            return
        if page is not None and len(files) > 1:
            raise UsageError("several files cannot be one page", "give one file with --page")
        if page is not None:
            events = [add_original(writer, files[0], page=page, **reading_options(reading))]
        else:
            events = add_originals(writer, files, **reading_options(reading))
        for event, path in zip(events, files, strict=True):
            print_result(f"page {event.page}: {path}")


@app.command("set")
@with_verbosity
def set_(
    session: Named,
    page: Annotated[int, typer.Argument(metavar="PAGE", min=0, max=9999, help="Number of the page; 0: the volume.")],
    label: Annotated[str | None, typer.Option(help="Label printed on the page.")] = None,
    side: Annotated[str | None, typer.Option(help="Side: left, right, recto, verso, …")] = None,
    note: Annotated[str | None, typer.Option(help="Note on the page.")] = None,
    position: Annotated[float | None, typer.Option(help="Position in the volume: 3.5 is between 3 and 4.")] = None,
    mark: Annotated[bool | None, typer.Option("--mark/--no-mark", help="Mark the page for later.")] = None,
    accept: Annotated[
        bool | None, typer.Option("--accept/--reject", help="Accept the scan, or reject it to capture again.")
    ] = None,
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Set label, side, note, position or acceptance of a page.

    Every decision can be undone.
    """
    with report_faults(debug=debug), writing(index, session) as writer:
        from station.errors import UsageError
        from station.session.operations.description import describe_page

        if position is not None and not math.isfinite(position):
            raise UsageError(f"--position: {position} is not a place", "give a number: 3.5 is between 3 and 4")
        capture = writer.history.page(page).capture
        if page and capture is None:
            raise no_page(session, page)
        values = {"label": label, "side": side, "note": note, "position": position, "mark": mark}
        if accept is None and set(values.values()) == {None}:
            raise UsageError("there is nothing to set", "see planish session set --help")
        if accept is not None and not page:
            raise UsageError("the volume itself is not accepted", "give the number of a page with --accept or --reject")
        wanted = {**values, "accept": accept}
        describe_page(writer, page, {name: value for name, value in wanted.items() if value is not None})


@app.command("undo")
@with_verbosity
def undo_(
    session: Named, page: PageNumber = None, stage: Stage = None, index: Index = None, debug: Debug = False
) -> None:
    """Undo the last step, or the last run of one stage.

    Nothing is deleted.
    """
    with report_faults(debug=debug):
        from station.session import undo, undo_run

        _step(index, session, page, stage, undo, undo_run, ("undo", "undone"))


@app.command("redo")
@with_verbosity
def redo_(
    session: Named, page: PageNumber = None, stage: Stage = None, index: Index = None, debug: Debug = False
) -> None:
    """Redo the step undone last, or the next run of a stage."""
    with report_faults(debug=debug):
        from station.session import redo, redo_run

        _step(index, session, page, stage, redo, redo_run, ("redo", "brought back"))


def _step(
    index: Path | None,
    session: str,
    page: int | None,
    stage: str | None,
    move: Callable[[Writer], Event | None],
    move_run: Callable[[Writer, int, str], Event | None],
    words: tuple[str, str],
) -> None:
    """Undo or redo the operator's step, or a stage's run on a page.

    words: what it is called, and called when done.
    """
    from station.errors import UsageError
    from station.session.terms.parts import STAGES

    with writing(index, session) as writer:
        if (page is None) != (stage is None):
            raise UsageError("--page and --stage go together", "name both, or none for the last step of the operator")
        if stage is not None and stage not in STAGES:
            raise UsageError(f"--stage: the stage {stage!r} does not exist", f"the stages are {', '.join(STAGES)}")
        if page is not None and writer.history.page(page).capture is None:
            raise no_page(session, page)
        step = move_run(writer, page, stage) if page and stage else move(writer)
    if step is None:
        print_result(f"nothing to {words[0]}")
    else:
        print_result(f"{words[1]}: {step.name} of page {step.page}, event {step.number}")


def no_page(session: str, page: int) -> Exception:
    from station.errors import UsageError

    show = shlex.join(["planish", "session", "show", session])
    return UsageError(f"the session has no page {page}", f"{show} lists its pages")


def index_path(given: Path | None) -> Path:
    from station.session.leaves.index import default_index

    return given or default_index(os.environ)


def find_session(index: Path | None, name: str) -> Path:
    from station.session.leaves.index import find

    return find(index_path(index), name)


def enter(index: Path | None, session: Session) -> None:
    """Enter a session in the index; a fault of the index is a note, no more."""
    from restore import BadInput
    from station.session.leaves.index import IndexUnusable, update

    try:
        update(index_path(index), session)
    except BadInput as error:
        print_note(f"the index was not updated: {error}; {error.hint}, then planish reindex enters it")
    except (IndexUnusable, OSError) as error:
        print_note(f"the index was not updated: {error}; planish reindex rebuilds it")


@contextmanager
def writing(index: Path | None, name: str) -> Iterator[Writer]:
    """Yield the session, opened for writing.

    Its entry in the index follows when the block ends.
    """
    from station.session import open_session

    with open_session(find_session(index, name)) as writer:
        try:
            yield writer
        finally:
            enter(index, writer.session)
