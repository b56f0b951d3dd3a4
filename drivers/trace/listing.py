"""A capture's commands as lines of text and as plain data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from drivers.scsi.errors import BadReply
from drivers.scsi.sense import parse_sense
from drivers.trace.exchanges import Exchange
from drivers.trace.groups import Group, Span, group
from drivers.trace.roles import guess_roles

QUOTED_BYTES = 16  # bytes of what was moved, to a line
FIRST_VENDOR_CODE = 0xC0  # operation codes from here on are the vendors' own (SCSI-2 §7.2.2)

NAMES: Mapping[int, str] = {  # SCSI-2 tables 29 (all devices) and 286 (scanners)
    0x00: "TEST UNIT READY", 0x03: "REQUEST SENSE", 0x12: "INQUIRY", 0x15: "MODE SELECT(6)", 0x16: "RESERVE UNIT",
    0x17: "RELEASE UNIT", 0x18: "COPY", 0x1A: "MODE SENSE(6)", 0x1B: "SCAN", 0x1C: "RECEIVE DIAGNOSTIC RESULTS",
    0x1D: "SEND DIAGNOSTIC", 0x24: "SET WINDOW", 0x25: "GET WINDOW", 0x28: "READ(10)", 0x2A: "SEND(10)",
    0x31: "OBJECT POSITION", 0x34: "GET DATA BUFFER STATUS", 0x3B: "WRITE BUFFER", 0x3C: "READ BUFFER",
}  # fmt: skip


def command_name(opcode: int) -> str:
    """Name of a scanner's command in the standard."""
    return NAMES.get(opcode, "vendor's own" if opcode >= FIRST_VENDOR_CODE else "not a scanner's")


def sense_text(sense: bytes) -> str:
    """Sense data in words of the standard; its bytes when it is in no format of it."""
    try:
        return str(parse_sense(sense)) if sense else ""
    except BadReply:
        return sense.hex(" ")


def list_exchanges(exchanges: Sequence[Exchange]) -> Iterator[str]:
    """Yield a line for each command, then one for each kind of command with its likely role."""
    for number, exchange in enumerate(exchanges):
        moved = f"{exchange.moved}/{exchange.asked}" if exchange.asked else ""
        head = exchange.head[:QUOTED_BYTES].hex(" ") + (" …" if exchange.moved > QUOTED_BYTES else "")
        outcome = sense_text(exchange.sense) or exchange.outcome
        cdb = exchange.cdb.hex(" ").upper()
        yield f"{number:5}  {exchange.direction:4}  {cdb:47}  {moved:>11}  {outcome:12}  {head}".rstrip()
    yield ""
    evidence = {id(e): guess for guess in guess_roles(exchanges) for e in guess.group.exchanges}
    for kind in group(exchanges):
        guess = evidence.get(id(kind.exchanges[0]))
        why = f"{guess.role or '?'}: {guess.evidence}" if guess else command_name(kind.opcode)
        yield f"{len(kind.exchanges):5}× {kind.direction:4}  {kind.pattern:47}  {_lengths(kind):>11}  {why}"


def as_data(exchanges: Sequence[Exchange]) -> dict[str, Any]:
    """Return the listing for programs: hexadecimal bytes, groups by numbers of exchanges."""
    numbers = {id(exchange): number for number, exchange in enumerate(exchanges)}
    return {
        "commands": [_exchange_data(exchange) for exchange in exchanges],
        "groups": [_group_data(kind, numbers) for kind in group(exchanges)],
    }


def _lengths(kind: Group) -> str:
    return "" if kind.direction == "none" else "–".join(map(str, sorted({kind.lengths[0], kind.lengths[-1]})))


def _exchange_data(exchange: Exchange) -> dict[str, Any]:
    return {
        "bus": exchange.where[0],
        "device": exchange.where[1],
        "lun": exchange.lun,
        "cdb": exchange.cdb.hex(),
        "name": command_name(exchange.cdb[0]),
        "direction": exchange.direction,
        "asked": exchange.asked,
        "moved": exchange.moved,
        "head": exchange.head.hex(),
        "outcome": exchange.outcome,
        "sense": exchange.sense.hex(),
        "sense_text": sense_text(exchange.sense),
    }


def _group_data(kind: Group, numbers: Mapping[int, int]) -> dict[str, Any]:
    return {
        "pattern": kind.pattern,
        "name": command_name(kind.opcode),
        "direction": kind.direction,
        "lengths": list(kind.lengths),
        "length_field": _span_data(kind.length),
        "offset_field": _span_data(kind.offset),
        "largest_block": kind.largest,
        "commands": [numbers[id(exchange)] for exchange in kind.exchanges],
    }


def _span_data(span: Span | None) -> dict[str, Any] | None:
    return None if span is None else {"at": span.at, "bytes": span.size, "order": span.order}
