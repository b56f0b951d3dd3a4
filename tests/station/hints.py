"""The options that a hint names, beside those of the command that prints it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import typer

from station.cli import app

OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*|-[ow])(?![\w-])")
NAMED = re.compile(r"planish (?P<command>(?:session )?[a-z][a-z-]*)(?P<rest>[^;,`]*)")
OF_OTHERS = re.compile(r"(?:pip install|dask scheduler)[^;,]*")
WHERE_IT_IS = "where the command has"  # of an option: named with that reserve


def options_of(words: Sequence[str]) -> frozenset[str]:
    """The options of the command that the words call, `--help` among them; those of the program itself without one."""
    command: Any = typer.main.get_command(app)
    for word in words:
        command = getattr(command, "commands", {}).get(word, command)
    return frozenset({"--help", *(name for one in command.params for name in (*one.opts, *one.secondary_opts))})


def missing_options(hint: str, words: Sequence[str]) -> list[str]:
    """The options in a hint that neither the command called by `words` has nor the one that the hint names for them."""
    return sorted({option for option, known in _named(hint, words) if option not in known})


def _named(hint: str, words: Sequence[str]) -> Iterator[tuple[str, frozenset[str]]]:
    """Each option that a hint names, with the options of the command that it names it for."""
    if WHERE_IT_IS in hint:
        return
    own = OF_OTHERS.sub("", hint)
    for match in NAMED.finditer(own):
        yield from ((option, options_of(match["command"].split())) for option in OPTION.findall(match["rest"]))
    yield from ((option, options_of(words)) for option in OPTION.findall(NAMED.sub("", own)))
