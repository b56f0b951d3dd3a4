"""Number the leaf sides of a volume by runs, as they are printed or foliated.

A run begins at a leaf side and goes on to the next run. Without runs the preset numbers the volume.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from station.errors import UsageError
from station.session.terms.presets import Preset

LABELS = "labels"  # the decision on the volume
MAX_RUNS = MAX_MISSING = 1000
RUN_HINT = 'write it as "from=3/right style=folio first=1"'
FLAGS = {"true": True, "yes": True, "false": False, "no": False}
Style = Literal["arabic", "roman", "ROMAN", "letters", "LETTERS", "folio", "folio-ab", "leaf", "column", "none"]
ROMAN = ((1000, "m"), (900, "cm"), (500, "d"), (400, "cd"), (100, "c"), (90, "xc"), (50, "l"), (40, "xl"))
ROMAN_UNITS = ((10, "x"), (9, "ix"), (5, "v"), (4, "iv"), (1, "i"))
FOLIATION: Mapping[str, Style] = {"pages": "arabic", "folios": "folio", "none": "none"}


class Run(BaseModel):
    """A run of labels.

    start    the leaf side that it begins at, as `3/right`; `from` in JSON.
    first    number of its first page or leaf. side: recto or verso, which the first one is.
    bracket  for numbers that are inferred. counted: false for leaves without a label.

    >>> run = Run.model_validate({"from": "3/right", "style": "folio", "side": "verso"})
    >>> [run.label(place) for place in range(3)]
    ['1v', '2r', '2v']
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, populate_by_name=True)
    start: Annotated[str, Field(alias="from", pattern=r"^[1-9][0-9]{0,3}(/(left|right))?$")] = "1"
    style: Style = "arabic"
    first: Annotated[int, Field(ge=0, le=100_000)] = 1
    side: Literal["recto", "verso"] = "recto"
    prefix: Annotated[str, Field(max_length=20)] = ""
    suffix: Annotated[str, Field(max_length=20)] = ""
    bracket: bool = False
    counted: bool = True

    def label(self, place: int) -> str:
        """Return the label at a place of the run, from 0; empty where it has none."""
        if not self.counted or self.style == "none":
            return ""
        text = STYLES[self.style](self.first, place + (self.side == "verso" and self.style in FOLIOS))
        text = f"{self.prefix}{text}{self.suffix}" if text else ""
        return f"[{text}]" if text and self.bracket else text

    def as_text(self) -> str:
        """Return the run as `parse_run` reads it."""
        table = self.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        table = {"from": self.start, "style": self.style, **table}
        return " ".join(
            f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in table.items()
        )

    def place(self, label: str) -> int | None:
        """Return the place of a label in the run, None for another kind.

        >>> Run(style="roman").place("xiv"), Run(style="folio").place("3v"), Run().place("plate")
        (13, 5, None)
        """
        inner = label.removeprefix("[").removesuffix("]") if self.bracket else label
        inner = inner.removeprefix(self.prefix).removesuffix(self.suffix)
        number = _number_of(inner, self.style)
        if number is None or not self.counted:
            return None
        after = number - self.first
        around = {"column": (after // 2,)} | dict.fromkeys(FOLIOS, range(2 * after - 1, 2 * after + 2))
        places = around.get(self.style, (after,))
        return next((place for place in places if place >= 0 and self.label(place) == label), None)


class Missing(BaseModel):
    """A leaf side that is missing, with its label. before: the leaf side that follows it."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    before: Annotated[str, Field(max_length=20)]
    label: Annotated[str, Field(max_length=80)]


MISSING_LEAVES: TypeAdapter[list[Missing]] = TypeAdapter(Annotated[list[Missing], Field(max_length=MAX_MISSING)])
LEAF_ORDER: TypeAdapter[list[str]] = TypeAdapter(Annotated[list[str], Field(max_length=20_000)])
RUNS: TypeAdapter[list[Run]] = TypeAdapter(Annotated[list[Run], Field(max_length=MAX_RUNS)])


VALUES: Mapping[str, Callable[[str], object]] = {
    "first": int,
    "bracket": FLAGS.__getitem__,
    "counted": FLAGS.__getitem__,
}


def parse_run(text: str) -> Run:
    """Read a run as an operator writes it. Raises UsageError that names the key.

    >>> parse_run("from=3/right style=folio first=2").label(1)
    '2v'
    """
    table: dict[str, object] = {}
    for word in text.split():
        key, sign, value = word.partition("=")
        if not sign:
            raise UsageError(f"--run: {word!r} sets nothing", RUN_HINT)
        try:
            table[key] = VALUES.get(key, str)(value)
        except (ValueError, KeyError) as error:
            raise UsageError(f"--run: {word!r} cannot be read", RUN_HINT) from error
    try:
        return Run.model_validate(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise UsageError(f"--run: {'.'.join(map(str, first['loc']))}: {first['msg']}", RUN_HINT) from error


def run_of_preset(preset: Preset) -> Run:
    """Return the run that numbers a volume without runs."""
    return Run(style=FOLIATION[preset.foliation], first=preset.first)


def roman(number: int) -> str:
    """Return a number from 1 on in small roman numerals; an empty text for 0.

    >>> roman(1994)
    'mcmxciv'
    """
    text = ""
    for value, letters in (*ROMAN, *ROMAN_UNITS):
        count, number = divmod(number, value)
        text += letters * count
    return text


def letters(number: int) -> str:
    """Return a, b, …, z, aa, ab, … for numbers from 1 on.

    >>> letters(1), letters(26), letters(28)
    ('a', 'z', 'ab')
    """
    text = ""
    while number > 0:
        number, rest = divmod(number - 1, 26)
        text = chr(ord("a") + rest) + text
    return text


def _leaf(first: int, place: int, sides: tuple[str, str]) -> str:
    leaf, verso = divmod(place, 2)
    return f"{first + leaf}{sides[verso]}" if sides[verso] or not verso else ""


FOLIOS = ("folio", "folio-ab", "leaf")
STYLES: Mapping[Style, Callable[[int, int], str]] = {
    "arabic": lambda first, place: str(first + place),
    "roman": lambda first, place: roman(first + place),
    "ROMAN": lambda first, place: roman(first + place).upper(),
    "letters": lambda first, place: letters(first + place),
    "LETTERS": lambda first, place: letters(first + place).upper(),
    "folio": lambda first, place: _leaf(first, place, ("r", "v")),
    "folio-ab": lambda first, place: _leaf(first, place, ("a", "b")),
    "leaf": lambda first, place: _leaf(first, place, ("", "")),
    "column": lambda first, place: f"{first + 2 * place}–{first + 2 * place + 1}",
}


def numbers_in(label: str) -> set[int]:
    """Return the numbers in a label: of pages, leaves or columns, arabic or roman.

    >>> numbers_in("12v–13r"), numbers_in("[xiv]")
    ({12, 13}, {14})
    """
    arabic = {int(number) for number in re.findall(r"\d{1,6}", label)}
    roman_number = _number_of(label.strip("[]() ."), "roman")
    return arabic or ({roman_number} if roman_number else set())


def _number_of(text: str, style: Style) -> int | None:
    """Return the number in a label of a style; None without one."""
    match = re.match(r"\d{1,6}", text)
    if match:
        return int(match[0])
    if style.lower() == "roman" and re.fullmatch(r"[ivxlcdm]{1,20}", text, re.IGNORECASE):
        values = [{"i": 1, "v": 5, "x": 10, "l": 50, "c": 100, "d": 500, "m": 1000}[one] for one in text.lower()]
        return sum(-one if any(later > one for later in values[at + 1 :]) else one for at, one in enumerate(values))
    if style.lower() == "letters" and re.fullmatch(r"[a-z]{1,4}", text, re.IGNORECASE):
        number = 0
        for one in text.lower():
            number = 26 * number + ord(one) - ord("a") + 1
        return number
    return None
