"""The commands `planish session edits | apply | order | labels`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from station.commands.options import Debug, Json, Language
from station.commands.sessions import Index, Named, find_session, no_page, writing
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from restore import PageEdits
    from station.session import Page, Session, Writer
    from station.session.log.history import CapturedPage

Operator = Annotated[str, typer.Option(help="Name of who corrects, recorded with it.", envvar="PLANISH_OPERATOR")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show what would change; record nothing.")]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FIELD=VALUE", help="Set a field; nothing after = takes it away. Repeatable."),
]
TO = "all, left, right, following:PAGE, or pages: 3,5-8"


def edits(
    session: Named,
    page: Annotated[str, typer.Argument(metavar="PAGE[/left|/right]", help="A page, or one leaf of it.")],
    assignments: Assignments = None,
    imported: Annotated[
        Path | None, typer.Option("--import", metavar="FILE", help="Take the corrections of a file.")
    ] = None,
    exported: Annotated[
        Path | None, typer.Option("--export", metavar="FILE", help="Write the corrections for the exported scan.")
    ] = None,
    clear: Annotated[bool, typer.Option("--clear", help="Take the page's own corrections away.")] = False,
    operator: Operator = "",
    of_another: Annotated[
        bool, typer.Option("--edits-of-another", help="Import corrections of another scan, too.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the exported file.")] = False,
    dry_run: DryRun = False,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Show or set the corrections of a page.

    `planish batch` restores the page with them.
    """
    with report_faults(debug=debug):
        from station.errors import UsageError
        from station.session import read_session
        from station.session.corrections.files import export_edits, import_edits
        from station.session.leaves.views import corrections_view
        from station.session.operations.corrections import correct
        from station.session.operations.tags import corrections_tag
        from station.session.terms.parts import parse_leaf
        from station.session.terms.texts import check_text

        number, part = parse_leaf(page)
        check_text("operator", operator)
        wanted = [bool(assignments), imported is not None, exported is not None, clear]
        if sum(wanted) > 1:
            raise UsageError("--set, --import, --export and --clear exclude each other", "give one of them")
        folder = find_session(index, session)
        stored = read_session(folder)
        shown = _page(stored, session, number)
        if exported is not None:
            export_edits(stored, shown, exported, force=force)
        if (not any(wanted[:2]) and not clear) or exported is not None:
            print_result(_shown(stored, shown, as_json))
            return
        edits: PageEdits | None = None
        labels: dict[str, str] = {}
        if imported is not None:
            edits, labels = import_edits(stored, shown, imported, of_another=of_another)
        elif assignments:
            edits = _set(stored, shown, part, assignments)
        if edits is not None:
            edits = edits.made_by(**_by(operator, "cli", shown))
        if dry_run:
            print_result(_planned(corrections_view(stored, shown).own, edits))
            return
        with writing(index, session) as writer:
            correct(writer, number, edits, expected=corrections_tag(stored, shown))
            _label(writer, number, labels)
            print_result(_shown(writer.session, writer.history.page(number), as_json))


def apply(
    session: Named,
    assignments: Annotated[list[str], typer.Argument(metavar="FIELD=VALUE...", help="Fields of the corrections.")],
    to: Annotated[str, typer.Option("--to", metavar="PAGES", help=f"Where: {TO}.")],
    future: Annotated[bool, typer.Option("--future", help="Also on pages that are captured later.")] = False,
    operator: Operator = "",
    dry_run: DryRun = False,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Correct many pages by one rule; one undo takes it back.

    A page's own corrections win over rules, later rules over earlier ones.
    """
    with report_faults(debug=debug):
        import json
        from dataclasses import replace

        from station.session import read_session
        from station.session.corrections.scope import parse_rule
        from station.session.operations.corrections import apply_rule, plan_rule
        from station.session.terms.texts import check_text

        check_text("operator", operator)
        stored = read_session(find_session(index, session))
        planned = plan_rule(stored, *parse_rule(stored, assignments, to, future=future))
        if not dry_run:
            with writing(index, session) as writer:
                apply_rule(writer, replace(planned, edits=planned.edits.made_by(**_by(operator, "rule"))))
        if as_json:
            print_result(json.dumps({**planned.as_json(), "recorded": not dry_run}, indent=2, ensure_ascii=False))
            return
        print_result("\n".join(planned.lines()))


def order(
    session: Named,
    move: Annotated[str | None, typer.Option(metavar="PAGE", help="Move a page or leaf, with --before.")] = None,
    before: Annotated[str | None, typer.Option(metavar="PAGE", help="The page or leaf that comes after it.")] = None,
    leave_out: Annotated[str | None, typer.Option(metavar="PAGE", help="Keep it, and leave it out of exports.")] = None,
    put_back: Annotated[str | None, typer.Option(metavar="PAGE", help="Deliver it again.")] = None,
    missing_before: Annotated[
        str | None, typer.Option(metavar="PAGE", help="A leaf is missing before it, with --label.")
    ] = None,
    label: Annotated[str, typer.Option(help="Label of the missing leaf.")] = "",
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Show or change the order of the leaves of a volume."""
    with report_faults(debug=debug):
        from station.errors import UsageError
        from station.session import read_session
        from station.session.operations.arrangement import change_leaf, leaves_named, mark_missing, move_leaves
        from station.session.operations.tags import arrangement_tag

        steps = [step for step in (move, leave_out, put_back, missing_before) if step is not None]
        if len(steps) > 1:
            raise UsageError("these steps exclude each other", "give one of them, and the next one after it")
        if (move is None) != (before is None):
            raise UsageError("--move and --before go together", "name both: --move 7 --before 5")
        stored = read_session(find_session(index, session))
        if steps:
            named, tag = leaves_named(stored, steps[0]), arrangement_tag(stored)
            target = None if before is None else leaves_named(stored, before)[0].name
            with writing(index, session) as writer:
                if move is not None:
                    move_leaves(writer, [leaf.name for leaf in named], target, expected=tag)
                elif missing_before is not None:
                    mark_missing(writer, named[0].name, [*named[0].missing, label], expected=tag)
                else:
                    for leaf in named:
                        change_leaf(writer, leaf.name, left_out=leave_out is not None, expected=leaf.tag)
                stored = writer.session
        print_result(_leaves(stored, as_json))


def labels(
    session: Named,
    runs: Annotated[
        list[str] | None,
        typer.Option(
            "--run", metavar="RUN", help='As "from=3/right style=folio first=1". Repeatable; all in one call.'
        ),
    ] = None,
    listed: Annotated[bool, typer.Option("--list", help="List the runs, then the leaves with their labels.")] = False,
    clear: Annotated[bool, typer.Option("--clear", help="Number the volume by its preset again.")] = False,
    check_print: Annotated[
        bool, typer.Option("--check-print", help="Compare with printed numbers by OCR; sets nothing.")
    ] = False,
    language: Language = "eng",
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Show or set how the leaves of a volume are numbered.

    Styles: arabic, roman, ROMAN, letters, LETTERS, folio, folio-ab, leaf, column,
    none. Keys: from, style, first, side, prefix, suffix, bracket, counted.
    """
    with report_faults(debug=debug):
        from station.errors import UsageError
        from station.session import read_session
        from station.session.operations.arrangement import leaves_named, set_runs
        from station.session.operations.tags import arrangement_tag
        from station.session.terms.labels import parse_run

        if sum([bool(runs), clear, check_print]) > 1:
            raise UsageError("--run, --clear and --check-print exclude each other", "give one of them")
        if check_print:
            print_result(_printed(read_session(find_session(index, session)), language, as_json))
            return
        stored = read_session(find_session(index, session))
        parsed = [parse_run(text) for text in runs or []]
        for run in parsed:
            leaves_named(stored, run.start)
        if parsed or clear:
            with writing(index, session) as writer:
                set_runs(writer, parsed, expected=arrangement_tag(stored))
                stored = writer.session
        if listed and not as_json:
            decided = stored.history.volume.decided.labels
            print_result("\n".join(f"run        {run.as_text()}" for run in decided) or "run        preset")
        print_result(_leaves(stored, as_json))


def _printed(session: Session, language: str, as_json: bool) -> str:
    """Return the labels of a volume next to the numbers that are printed on its pages."""
    import json
    import sys

    from station.progress import progress_on
    from station.session.leaves.printed import printed_numbers
    from station.words.words import check_language, find_tesseract, recognise

    check_language(find_tesseract(), language)
    with progress_on(sys.stderr) as progress:
        pages = list(
            printed_numbers(
                session, lambda image, dpi: recognise(image, dpi, name="page.png", language=language).text, progress
            )
        )
    if as_json:
        table = [
            {"name": one.name, "label": one.label, "printed": one.printed, "differs": one.differs} for one in pages
        ]
        return json.dumps(table, indent=2, ensure_ascii=False)
    differing = [f"{one.name:<9} {one.label:<10} printed {one.printed}" for one in pages if one.differs]
    read = sum(bool(one.printed) for one in pages)
    return "\n".join([*differing, f"{len(differing)} of {read} printed numbers differ, {len(pages)} leaves"])


def _page(session: Session, name: str, number: int) -> CapturedPage:
    page = session.history.captured(number)
    if page is None:
        raise no_page(name, number)
    return page


def _by(operator: str, tool: str, page: Page | None = None) -> dict[str, Any]:
    run = None if page is None else page.restoration
    fields = {"operator": operator, "tool": tool, "saw": None if run is None else run.event.number}
    return {name: value for name, value in fields.items() if value}


def _set(session: Session, page: Page, part: str | None, assignments: list[str]) -> PageEdits:
    from station.session.corrections.fields import changed
    from station.session.leaves.views import corrections_view
    from station.session.terms.parts import PAGE, parts_to_correct

    found = [PAGE] if page.restored is None else list(page.restored.leaves)
    return changed(corrections_view(session, page).own, assignments, parts_to_correct(found, part))


def _label(writer: Writer, page: int, labels: dict[str, str]) -> None:
    from station.session.operations.arrangement import set_label

    for part, label in labels.items():
        set_label(writer, page, part, label)


def _planned(own: PageEdits, edits: PageEdits | None) -> str:
    import json

    to = None if edits is None else edits.given()
    return f"from  {json.dumps(own.given(), sort_keys=True)}\nto    {json.dumps(to, sort_keys=True)}"


def _shown(session: Session, page: Page, as_json: bool) -> str:
    """The corrections of a page, each with where it comes from."""
    import json

    from station.session.derivation.parameters import needs_restoration
    from station.session.leaves.views import corrections_view

    found = corrections_view(session, page)
    layers, effective = found.layers, found.effective
    outdated = needs_restoration(session, page)
    if as_json:
        table = {"page": page.number, "edits": effective, "outdated": outdated}
        given = [{"from": name, "edits": layer.given()} for name, layer in layers]
        return json.dumps({**table, "layers": given}, indent=2)
    lines = [f"{name:<10} {', '.join(layer.names)}" for name, layer in layers]
    lines.append(f"{'applied':<10} {json.dumps(effective, sort_keys=True)}")
    return "\n".join([*lines, *(["outdated   restore it with planish batch"] if outdated else [])])


def _leaves(session: Session, as_json: bool) -> str:
    """The leaf sides of a volume, one in each line."""
    import json

    from station.session.leaves.leaf import leaves_of

    leaves = leaves_of(session)
    if as_json:
        keys = ("name", "position", "label", "side", "kind")
        rows = [
            {**{key: getattr(leaf, key) for key in keys}, "left_out": leaf.is_left_out, "missing": list(leaf.missing)}
            for leaf in leaves
        ]
        return json.dumps(rows, indent=2, ensure_ascii=False)
    lines = []
    for leaf in leaves:
        lines += [f"{'':>5}  {'missing':<9} {label}" for label in leaf.missing]
        place = "out" if leaf.is_left_out else str(leaf.position)
        lines.append(f"{place:>5}  {leaf.name:<9} {leaf.label:<10} {leaf.side:<6} {leaf.kind}".rstrip())
    return "\n".join(lines) or "no pages"
