"""Describe the volume of a session: title, creators, language, rights and so on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from restore import BadInput
from station.errors import UsageError
from station.session.terms.texts import check_text

ABOUT = "about"  # the decision on the volume
RTL = "rtl"
Text = Annotated[str, Field(max_length=500)]
Uri = Annotated[str, Field(max_length=500, pattern=r"^https?://[^\s<>\"{}|\\^`]+$")]
Values = str | list[str] | set[str]  # a text, an ordered list, a set: as XMP distinguishes them
Language = Annotated[str, Field(max_length=35, pattern=r"^[A-Za-z]{2,8}(-[A-Za-z0-9]{1,8})*$")]  # shape of BCP 47


class Identifier(BaseModel):
    """An identifier of a volume. scheme: `urn`, `isbn`, `ppn`, …; empty where it is not known."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    scheme: Annotated[str, Field(max_length=40)] = ""
    value: Annotated[str, Field(min_length=1, max_length=500)]


class About(BaseModel):
    """What is known of a volume; empty fields are not known.

    language   BCP 47. rights: web address of a licence or statement.
    direction  in which the leaves are read: ltr or rtl, right to left.
    owner      who keeps the volume. extent: as `96 leaves`. binding: side on which it is bound.

    >>> About(title="Missale", direction="rtl").given()
    {'title': 'Missale', 'direction': 'rtl'}
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    title: Text = ""
    creators: Annotated[list[Text], Field(max_length=50)] = []
    date: Text = ""
    place: Text = ""
    publisher: Text = ""
    language: Language | Literal[""] = ""
    direction: Literal["", "ltr", "rtl"] = ""
    shelfmark: Text = ""
    identifiers: Annotated[list[Identifier], Field(max_length=50)] = []
    rights: Uri | Literal[""] = ""
    owner: Text = ""
    extent: Text = ""
    binding: Literal["", "left", "right", "top", "bottom"] = ""

    def given(self) -> dict[str, Any]:
        """Return the fields that are known, as JSON values."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def dublin_core(self) -> dict[str, Values]:
        """Return the elements of Dublin Core besides the title that are known, as XMP has them.

        >>> About(creators=["A"], shelfmark="Inc. 12").dublin_core()
        {'dc:creator': ['A'], 'dc:source': 'Inc. 12'}
        """
        found: dict[str, Values] = {
            "dc:creator": list(self.creators),
            "dc:date": [self.date] if self.date else [],
            "dc:publisher": {self.publisher} if self.publisher else set(),
            "dc:language": {self.language} if self.language else set(),
            "dc:identifier": "; ".join(one.value for one in self.identifiers),
            "dc:source": self.shelfmark,
            "dc:rights": self.rights,
        }
        return {name: value for name, value in found.items() if value}


ABOUT_TABLE: TypeAdapter[About] = TypeAdapter(About)


def about_from(table: Mapping[str, Any], name: str) -> About:
    """Return the description in JSON values. name: of where they are from, for messages.

    Raises BadInput that names the field.
    """
    try:
        about = About.model_validate(dict(table))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadInput(
            f"{name}: {'.'.join(map(str, first['loc']))}: {first['msg']}", f"fields: {FIELD_NAMES}"
        ) from error
    for field, value in about.given().items():
        for text in _texts(value):
            check_text(field, text)
    return about


def changed_about(about: About, words: Iterable[str]) -> About:
    """Return a description with fields set, or taken away where nothing follows the sign.

    words: `FIELD=VALUE`; creators are separated by semicolons, identifiers as `SCHEME:VALUE; …`.
    Raises UsageError for a field that does not exist, BadInput for a value that is not allowed.
    """
    table = about.given()
    for word in words:
        name, sign, text = word.partition("=")
        if not sign or name not in About.model_fields:
            raise UsageError(f"{word!r} sets no field", f"write FIELD=VALUE with one of {FIELD_NAMES}")
        table[name] = READ.get(name, str)(text.strip())
    return about_from(table, "--set")


def _list(text: str) -> list[str]:
    return [part.strip() for part in text.split(";") if part.strip()]


def _identifiers(text: str) -> list[dict[str, str]]:
    """Return identifiers of `SCHEME:VALUE; …`; one without a colon has no scheme."""
    parts = [one.partition(":") for one in _list(text)]
    return [{"scheme": scheme, "value": value} if sign else {"value": scheme} for scheme, sign, value in parts]


def _texts(value: Any) -> list[str]:
    """Return the texts in a field."""
    if isinstance(value, str):
        return [value]
    items = value.values() if isinstance(value, dict) else value
    return [text for item in items for text in _texts(item)]


READ: Mapping[str, Callable[[str], Any]] = {"creators": _list, "identifiers": _identifiers}
FIELD_NAMES = ", ".join(About.model_fields)
