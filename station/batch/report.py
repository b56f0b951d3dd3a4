"""The morning report: one HTML file with pictures and figures.

It shows all pages, the worst first, opens offline, and prints. Style sheets sort and filter: nothing in it runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from html import escape

from restore import BadInput
from restore.formats import read_image
from station.batch.outcomes import FIGURES, PageOutcome, Ranked, worst_first
from station.batch.preview import preview
from station.verdict.checks import LEVELS

MAX_PICTURES = 500  # 8 MB: opens from a network share at once; those that need a look come first
MAX_ROWS = 5000  # as many as a browser shows within a second
WORST = " class='worst'"
SHOWN = [figure for figure in FIGURES if figure.text != "{:.0f}" or figure.less_is_worse]  # counts are in the notes
LAST = float("inf")  # where a page without a figure is sorted
ORDERS: dict[str, Callable[[PageOutcome], float | str]] = {
    "scan": lambda page: page.name,
    "width": lambda page: LAST if page.size_mm is None else page.size_mm[0],
    "height": lambda page: LAST if page.size_mm is None else page.size_mm[1],
    **{figure.name: lambda page, name=figure.name: page.figures.get(name, LAST) for figure in SHOWN},  # type: ignore[misc]
}
STYLE = """
:root { color-scheme: dark light; --ground: #121211; --raised: #1c1b1a; --line: #383633; --ink: #efebe3;
  --soft: #b8b2a8; --accent: #efe7d6; --on-accent: #1b1916; --green: #72cb97; --amber: #ebb756; --red: #ff9384; }
@media (prefers-color-scheme: light) { :root { --ground: #e8e6e2; --raised: #f7f6f3; --line: #d3cfc8; --ink: #1d1b18;
  --soft: #575249; --accent: #2a2721; --on-accent: #fbf8f2; --green: #19693f; --amber: #7d5200; --red: #ac211a; } }
* { box-sizing: border-box; }
body { font: 15px/1.4 "Source Sans 3", system-ui, sans-serif; margin: 0 auto; max-width: 80rem; padding: 1.5rem;
  background: var(--ground); color: var(--ink); }
h1 { font: 600 1.5rem/1.2 "Source Serif 4", Georgia, serif; margin: 0; overflow-wrap: anywhere; }
p, .soft { color: var(--soft); margin: .25rem 0; }
fieldset { display: inline-flex; flex-wrap: wrap; gap: .25rem; margin: .5rem 1rem .5rem 0; padding: 2px;
  border: 1px solid var(--line); border-radius: 10px; }
legend { float: left; padding: .35rem .6rem; color: var(--soft); }
label { padding: .35rem .7rem; border-radius: 8px; cursor: pointer; }
label:has(:checked) { background: var(--accent); color: var(--on-accent); font-weight: 600; }
label:has(:focus-visible) { outline: 2px solid var(--ink); outline-offset: 2px; }
input { position: absolute; opacity: 0; }
table, thead, td, th { display: block; }
tbody { display: flex; flex-direction: column; gap: .5rem; }
tr { display: grid; grid-template-columns: 12rem minmax(12rem, 1fr) repeat(COLUMNS, 5.5rem) 8rem; gap: .25rem .75rem;
  padding: .75rem; }
tbody tr { background: var(--raised); border: 1px solid var(--line); border-left-width: 4px; border-radius: 14px;
  break-inside: avoid; }
thead tr { padding-block: .25rem; border-left: 4px solid transparent; color: var(--soft); }
thead { position: sticky; top: 0; background: var(--ground); }
th { font-weight: 600; text-align: right; }
th:nth-child(-n + 2) { text-align: left; }
td { text-align: right; font-variant-numeric: tabular-nums; }
td:nth-child(-n + 2) { text-align: left; overflow-wrap: anywhere; }
td.worst { font-weight: 700; }
td:first-child { display: flex; gap: .25rem; }
img { display: block; max-width: 100%; max-height: 10rem; width: auto; height: auto; }
img:not(:only-child) { max-width: calc(50% - .125rem); }
ul { margin: .25rem 0 0; padding-left: 1.1rem; color: var(--soft); }
tr:has(b.red), tr.aside { border-left-color: var(--red); } tr:has(b.amber) { border-left-color: var(--amber); }
tr:has(b.green) { border-left-color: var(--green); }
tr.aside b, b.red { color: var(--red); } b.amber { color: var(--amber); } b.green { color: var(--green); }
@media screen and (width < 900px) {
  body { padding: .75rem; } thead { display: none; }
  tr { grid-template-columns: 1fr 1fr; } td:nth-child(-n + 2) { grid-column: 1 / -1; }
  td[data-name] { text-align: left; } td[data-name]::before { content: attr(data-name) " "; color: var(--soft); }
  td[data-name]:empty { display: none; }
}
@page { size: A4; margin: 12mm; }
@media print {
  :root { color-scheme: light; --ground: #fff; --raised: #fff; --line: #bbb; --ink: #000; --soft: #444;
    --green: #19693f; --amber: #7d5200; --red: #ac211a; }
  body { font-size: 9pt; padding: 0; } fieldset { display: none; } thead { position: static; }
  tr { grid-template-columns: 32mm minmax(0, 1fr) repeat(COLUMNS, 17mm) 25mm; gap: 1mm 2mm; padding: 2mm; }
  img { max-height: 35mm; }
}
""".replace("COLUMNS", str(len(SHOWN)))


def encode_report(pages: Sequence[PageOutcome], *, title: str, now: datetime) -> bytes:
    """The report of a batch's pages as HTML."""
    ranked, counts = worst_first(pages), Counter(page.state for page in pages)
    heads = "".join(f"<th scope='col'>{escape(figure.name)}</th>" for figure in SHOWN)
    rows = "\n".join(_rows(ranked[:MAX_ROWS]))
    verdicts = Counter(page.level for page in pages)
    levels = "".join(f", {verdicts[level]} {level}" for level in reversed(LEVELS) if verdicts[level])
    left_out = f"<p>{len(ranked) - MAX_ROWS} better pages are not listed.</p>" if len(ranked) > MAX_ROWS else ""
    kinds = [("aside", "not restored"), *((level, level) for level in reversed(LEVELS))]
    rules = [f"body:has(#show-{kind}:checked) tbody tr:not(.{kind}) {{ display: none; }}" for kind, _ in kinds]
    rules += [f"body:has(#by-{at}:checked) tbody tr {{ order: var(--by-{at}); }}" for at in range(len(ORDERS))]
    show = _choice("show", "Show", [("all", f"all {len(pages)}"), *kinds])
    sort = _choice("by", "Sort by", [("worst", "worst first"), *((str(at), name) for at, name in enumerate(ORDERS))])
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title><style>{STYLE}{" ".join(rules)}</style></head><body>
<h1>{escape(title)}</h1>
<p>{escape(now.isoformat(" ", "minutes"))} · {counts["restored"]} restored, {counts["set aside"]} set aside,
{counts["missing"]} not done{levels}. The worst pages come first: by their verdict, then by the figure that is bold.
±: half of the 95 % interval of the size. Two images: as scanned, and flat.</p>
{show}{sort}
<table><thead><tr><th scope="col">page</th><th scope="col">scan</th>{heads}<th scope="col">mm</th></tr></thead>
<tbody>
{rows}
</tbody></table>{left_out}</body></html>
""".encode("utf-8", "backslashreplace")


def _choice(name: str, legend: str, choices: Sequence[tuple[str, str]]) -> str:
    """Return buttons of which one is pressed, the first at the beginning."""
    buttons = "".join(
        f"<label><input type='radio' name='{name}' id='{name}-{key}'{'' if at else ' checked'}>{escape(text)}</label>"
        for at, (key, text) in enumerate(choices)
    )
    return f"<fieldset><legend>{legend}</legend>{buttons}</fieldset>"


def _rows(ranked: Sequence[Ranked]) -> Iterator[str]:
    places = [_places([read(one.page) for one in ranked]) for read in ORDERS.values()]
    for number, one in enumerate(ranked):
        page = one.page
        picture = _picture(page) if number < MAX_PICTURES else ""
        notes = "".join(f"<li>{escape(note)}</li>" for note in page.notes)
        state_text = page.level if page.state == "restored" else page.state
        state = f"<br><b class='{page.level}'>{escape(state_text)}</b>" if state_text else ""
        figures = "".join(
            f"<td data-name='{escape(figure.name)}'{WORST if figure.name == one.by else ''}>"
            f"{_value(page, figure.name, figure.text)}</td>"
            for figure in SHOWN
        )
        size = "" if page.size_mm is None else f"{page.size_mm[0]:.1f} × {page.size_mm[1]:.1f}"
        size += f"<br>± {page.ci95_mm:.1f}" if page.ci95_mm is not None else ""
        order = ";".join(f"--by-{at}:{place[number]}" for at, place in enumerate(places))
        yield (
            f"<tr class='{page.level if page.state == 'restored' else 'aside'}' style='{order}'><td>{picture}</td>"
            f"<td>{escape(page.name)}{state}{f'<ul>{notes}</ul>' if notes else ''}</td>"
            f"{figures}<td data-name='mm'>{size}</td></tr>"
        )


def _places(values: Sequence[float | str]) -> list[int]:
    """Return the place of each value among all, the least first."""
    place = {at: number for number, at in enumerate(sorted(range(len(values)), key=values.__getitem__))}
    return [place[at] for at in range(len(values))]


def _value(page: PageOutcome, name: str, text: str) -> str:
    return text.format(page.figures[name]) if name in page.figures else ""


def _picture(page: PageOutcome) -> str:
    """The page, small, inside the file itself; empty when it cannot be read any more."""
    if page.preview or page.picture is None:
        return page.preview
    try:
        return preview(read_image(page.picture))
    except BadInput:
        return ""
