"""The morning report: one HTML file with pictures and figures.

It shows all pages, the worst first, and opens offline.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
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
STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.4 system-ui, sans-serif; margin: 2rem auto; max-width: 74rem; padding: 0 1rem; }
h1 { font-size: 1.4rem; margin: 0; }
table { border-collapse: collapse; width: 100%; }
th, td { border-bottom: 1px solid #8884; padding: .5rem .6rem; text-align: right; vertical-align: top; }
th { position: sticky; top: 0; background: Canvas; font-weight: 600; white-space: nowrap; }
th:first-child, td:first-child, td.name, th.name { text-align: left; }
td.name { overflow-wrap: anywhere; min-width: 14rem; }
td.worst { font-weight: 700; }
img { max-width: 160px; max-height: 160px; display: block; border: 1px solid #8886; }
ul { margin: .3rem 0 0; padding-left: 1.1rem; color: #666; }
.aside td.name b, b.red { color: #b3261e; }
b.amber { color: #8a5a00; }
b.green { color: #1b6e35; }
@media (prefers-color-scheme: dark) { ul { color: #aaa; } .aside td.name b, b.red { color: #ff8a80; }
  b.amber { color: #ffc766; } b.green { color: #7fd99a; } }
"""


def encode_report(pages: Sequence[PageOutcome], *, title: str, now: datetime) -> bytes:
    """The report of a batch's pages as HTML."""
    ranked, counts = worst_first(pages), Counter(page.state for page in pages)
    heads = "".join(f"<th scope='col'>{escape(figure.name)}</th>" for figure in FIGURES)
    rows = "\n".join(_rows(ranked))
    verdicts = Counter(page.level for page in pages)
    levels = "".join(f", {verdicts[level]} {level}" for level in reversed(LEVELS) if verdicts[level])
    seconds = sum(page.seconds for page in pages)
    left_out = f"<p>{len(ranked) - MAX_ROWS} better pages are not listed.</p>" if len(ranked) > MAX_ROWS else ""
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title><style>{STYLE}</style></head><body>
<h1>{escape(title)}</h1>
<p>{escape(now.isoformat(" ", "minutes"))} · {counts["restored"]} restored, {counts["set aside"]} set aside,
{counts["missing"]} not done{levels} · {seconds / 3600:.1f} processor hours. The worst pages come first:
by their verdict, then by the figure that is bold. ±: half of the 95 % interval of the size.</p>
<table><thead><tr><th scope="col">page</th><th scope="col" class="name">scan</th>{heads}
<th scope="col">mm</th><th scope="col">seconds</th></tr></thead>
<tbody>
{rows}
</tbody></table>{left_out}</body></html>
""".encode("utf-8", "backslashreplace")


def _rows(ranked: Sequence[Ranked]) -> Iterator[str]:
    for number, one in enumerate(ranked[:MAX_ROWS]):
        page = one.page
        picture = _picture(page) if number < MAX_PICTURES else ""
        notes = "".join(f"<li>{escape(note)}</li>" for note in page.notes)
        state_text = page.level if page.state == "restored" else page.state
        state = f"<br><b class='{page.level}'>{escape(state_text)}</b>" if state_text else ""
        figures = "".join(
            f"<td{WORST if figure.name == one.by else ''}>{_value(page, figure.name, figure.text)}</td>"
            for figure in FIGURES
        )
        size = "" if page.size_mm is None else f"{page.size_mm[0]:.1f} × {page.size_mm[1]:.1f}"
        size += f"<br>± {page.ci95_mm:.1f}" if page.ci95_mm is not None else ""
        row = " class='aside'" if page.state != "restored" else ""
        yield (
            f"<tr{row}><td>{picture}</td><td class='name'>{escape(page.name)}{state}"
            f"{f'<ul>{notes}</ul>' if notes else ''}</td>{figures}<td>{size}</td>"
            f"<td>{f'{page.seconds:.1f}' if page.seconds else ''}</td></tr>"
        )


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
