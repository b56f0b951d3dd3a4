"""The command `planish session about`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from station.commands.corrections import Assignments, DryRun
from station.commands.options import Debug, Json
from station.commands.sessions import Index, Named, find_session, writing
from station.commands.terminal import print_result, report_faults


def about(
    session: Named,
    assignments: Assignments = None,
    imported: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="Take the fields of a MODS, Dublin Core or TOML file.")
    ] = None,
    clear: Annotated[bool, typer.Option("--clear", help="Take all fields away.")] = False,
    dry_run: DryRun = False,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Show or set the description of a volume.

    Fields: title, creators, date, place, publisher, language, direction, shelfmark,
    identifiers, rights, owner, extent, binding. Exports use them; direction=rtl
    puts the right leaf first.
    """
    with report_faults(debug=debug):
        import json

        from station.errors import UsageError
        from station.session import read_session
        from station.session.log.current import about_of
        from station.session.operations.description import describe
        from station.session.operations.tags import description_tag
        from station.session.terms.about import About, changed_about
        from station.session.terms.about_files import read_about

        if clear and (assignments or imported is not None):
            raise UsageError("--clear excludes --set and --from", "give one of them")
        stored = read_session(find_session(index, session))
        now = about_of(stored.history)
        wanted = About() if clear else now
        if imported is not None:
            wanted = wanted.model_copy(update=dict(read_about(imported)))
        wanted = changed_about(wanted, assignments or [])
        if wanted != now and not dry_run:
            with writing(index, session) as writer:
                describe(writer, wanted, expected=description_tag(stored))
        fields = wanted.given()
        if as_json:
            print_result(json.dumps(fields, indent=2, ensure_ascii=False))
            return
        print_result("\n".join(f"{name:<12} {_shown(value)}" for name, value in fields.items()) or "no description")


def _shown(value: object) -> str:
    """Return a field as `--set` reads it."""
    if isinstance(value, list):
        return "; ".join(one if isinstance(one, str) else ":".join(one.values()) for one in value)
    return str(value)
