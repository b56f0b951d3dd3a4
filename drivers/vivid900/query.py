"""Reads what a profile in progress allows: identity, status, parameters.

Nothing is written.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from drivers.scanner import ScannerError
from drivers.scsi.commands import Identity
from drivers.scsi.errors import BadReply
from drivers.vivid900.link import Link
from drivers.vivid900.profile import commands
from drivers.vivid900.profile.commands import Command
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.profile.template import Template


@dataclass(frozen=True)
class Answer:
    """A block that the scanner sent.

    values  field → number, with the profile's name for it where it has one.
    problem why the block could not be read, or not be had; empty when all is well.
    """

    name: str
    data: bytes = b""
    values: Mapping[str, str] = field(default_factory=dict)
    problem: str = ""


def ask(link: Link, profile: Profile) -> tuple[Identity, list[Answer]]:
    """Return identity and blocks of a scanner.

    Raises ProfileMismatch before a command of the profile is sent, and as Link.
    """
    identity = link.identify()
    profile.require(identity)
    known = Link(link.transport, profile, link.clock, link.sleep)
    known.clear_attentions()
    return identity, list(_answers(known, profile))


def _answers(link: Link, profile: Profile) -> Iterator[Answer]:
    modes = profile.modes or {mode.name: int(mode) for mode in commands.ShotMode}
    tables = {"state": profile.states, "lens": profile.lenses, "panel": profile.panels, "mode": modes}
    if "status" in profile.commands:
        yield _answer(link, commands.status(profile), profile.blocks.status, tables)
    else:
        yield Answer("status", problem=f"no command for it; TEST UNIT READY reports: {link.readiness()}")
    if "read_parameters" in profile.commands:
        yield _answer(link, commands.read_parameters(profile), profile.blocks.parameters, tables)
    else:
        yield Answer("read_parameters", problem="no command for it in the profile")


def _answer(link: Link, command: Command, block: Template, tables: Mapping[str, Mapping[str, int]]) -> Answer:
    try:
        data = link.run(command)
    except ScannerError as error:
        return Answer(command.name, problem=str(error))
    try:
        values = block.parse(data)
    except BadReply as error:
        return Answer(command.name, data, problem=str(error))
    return Answer(command.name, data, {name: _named(value, tables.get(name, {})) for name, value in values.items()})


def _named(value: int, table: Mapping[str, int]) -> str:
    names = [name for name, number in table.items() if number == value]
    return f"{value} ({names[0]})" if names else str(value)
