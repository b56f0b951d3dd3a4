"""A draft of a command profile from a capture, in the layout of `configs/profiles`.

What was seen is filled in, what has to be found out is a comment. The draft is not trusted: with it the driver asks,
and neither writes nor shoots.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import get_args

from drivers.scsi.commands import INQUIRY, Identity, parse_identity
from drivers.scsi.errors import BadReply
from drivers.trace.checksums import find_checksum
from drivers.trace.compare import inline_table
from drivers.trace.exchanges import Exchange
from drivers.trace.groups import Group, Span
from drivers.trace.pixels import Packing, colour_packing, pitch_packing
from drivers.trace.roles import Guess, Shape, colour_shape, guess_roles, pitch_shape
from drivers.trace.states import States, find_states
from drivers.vivid900.profile.contents import PARAMETERS, CommandName
from drivers.vivid900.profile.template import Checksum

ROLES = get_args(CommandName)
BLOCK_FIELDS: Mapping[str, Sequence[str]] = {
    "parameters": PARAMETERS,
    "status": ("state", "panel", "lens", "shot", "lens_serial", "body_serial"),
    "pitch": ("rows", "cols", "shot"),
    "colour": ("rows", "cols", "shot"),
}
BLOCK_SOURCES: Mapping[str, Sequence[CommandName]] = {
    "parameters": ("write_parameters", "read_parameters"),
    "status": ("status",),
    "pitch": ("read_pitch",),
    "colour": ("read_colour",),
}
BLOCK_ROLES = {role for roles in BLOCK_SOURCES.values() for role in roles}
TABLES = {
    "modes": ("FINE_COLOUR", "FAST_COLOUR"),
    "states": ("warming-up", "barrier-closed", "ready", "busy", "data"),
    "lenses": ("TELE", "MIDDLE", "WIDE"),
}
MAX_SAMPLES = 6  # of a block's bytes, as comments
Found = Mapping[CommandName, Group]


def draft_profile(exchanges: Sequence[Exchange], *, name: str) -> str:
    """The text of the draft, valid TOML for every capture."""
    guesses = guess_roles(exchanges)
    found = {guess.role: guess.group for guess in _merged(guesses) if guess.role}
    checksums = {block: _checksum(block, found) for block in BLOCK_SOURCES}
    states = find_states(exchanges, guesses, checksums["status"])
    blocks = (_block(block, found, checksums[block], states) for block in BLOCK_SOURCES if _kinds(block, found))
    parts = (_opening(exchanges, name), _commands(guesses), *blocks, _pixels(found), _tables(states))
    return "\n".join(chain.from_iterable(parts)) + "\n"


def _opening(exchanges: Sequence[Exchange], name: str) -> Iterator[str]:
    yield "# A DRAFT from a capture of the vendor's program. The lengths and bytes were seen, the roles are guesses."
    yield "# Replace every ? by what you find out; `planish query` reads blocks with what there is, and says what is"
    yield "# missing. What your scanner does not have is skipped: `planish query` says what that means."
    yield f"\nname = {_quoted(name)}"
    yield 'about = "drafted from a capture, not verified"'
    yield "trusted = false  # true lets the driver write and capture: only when you know what every command does"
    yield f"chunk_bytes = {max(512, *(exchange.asked for exchange in exchanges))}  # the most in one command"
    yield "\n[firmware]"
    identities = list(dict.fromkeys(_identities(exchanges)))
    if not identities:
        yield from ('# vendor = "?"  # no INQUIRY was captured', '# product = "?"', '# revisions = ["?"]')
    for index, identity in enumerate(identities):  # more than one device: the others as comments
        mark = "# " * (index > 0)
        yield f"{mark}vendor = {_quoted(identity.vendor)}"
        yield f"{mark}product = {_quoted(identity.product)}"
        yield f"{mark}revisions = [{_quoted(identity.revision)}]"


def _identities(exchanges: Sequence[Exchange]) -> Iterator[Identity]:
    for exchange in exchanges:
        if exchange.cdb[0] == INQUIRY and not exchange.cdb[1]:  # others are pages of vital product data
            try:
                yield parse_identity(exchange.head)
            except BadReply:
                continue


def _commands(guesses: Sequence[Guess]) -> Iterator[str]:
    yield "\n[commands]"
    taken: set[str] = set()
    for guess in sorted(_merged(guesses), key=lambda guess: ROLES.index(guess.role) if guess.role else len(ROLES)):
        kind = guess.group
        yield f"# {len(kind.exchanges)} times {kind.pattern}: {guess.evidence}"
        unknown = () if _kind_byte(guess) else sorted(kind.unexplained)
        if unknown:
            yield f"# what is in byte {', '.join(map(str, unknown))}?"
        sure = guess.role and guess.role not in taken and not unknown
        yield f"{'' if sure else '# '}{guess.role or '?'} = {_bytes_of(guess)}"
        taken |= {guess.role} if guess.role and sure else set()
    yield from (f'# {role} = "?"  # was not seen' for role in ROLES if role not in taken)


def _merged(guesses: Sequence[Guess]) -> Iterator[Guess]:
    """Yield the guesses, with groups that read colour images merged.

    The development kit asks for a kind of image.
    """
    colours = [guess for guess in guesses if guess.role == "read_colour"]
    yield from (guess for guess in guesses if guess.role != "read_colour")
    if colours:
        exchanges = sorted((e for guess in colours for e in guess.group.exchanges), key=lambda e: e.number)
        whole = replace(colours[0], group=replace(colours[0].group, exchanges=tuple(exchanges)))
        yield from [whole] if len(colours) == 1 or _kind_byte(whole) else colours


def _kind_byte(guess: Guess) -> tuple[int, ...]:
    """Return the byte of a colour-image command that varies freely.

    In addition to length and offset; empty for other commands.
    """
    one = guess.role == "read_colour" and len(guess.group.unexplained) == 1
    return tuple(guess.group.unexplained) if one else ()


def _bytes_of(guess: Guess) -> str:
    """Return a command in a profile's notation.

    The data sent with it are those of the first time.
    """
    kind = guess.group
    cdb, sent = _quoted(_layout(guess)), _quoted(kind.exchanges[0].data.hex(" ").upper())
    with_data = kind.direction == "out" and guess.role != "write_parameters"
    return f"{{ cdb = {cdb}, out = {sent} }}" if with_data else cdb


def _layout(guess: Guess) -> str:
    kind = guess.group
    kinds = (Span(at, 1) for at in _kind_byte(guess))
    length = kind.length if guess.role in BLOCK_ROLES else None  # that of other data is one of its constants
    spans = {"length": length, "offset": kind.offset, "kind": next(kinds, None)}
    starts = {span.at: f"{name}/{span.text}" for name, span in spans.items() if span}
    covered = {place for span in spans.values() if span for place in range(span.at + 1, span.end)}
    cdb = kind.exchanges[0].cdb
    return " ".join(starts.get(place, f"{byte:02X}") for place, byte in enumerate(cdb) if place not in covered)


def _kinds(block: str, found: Found) -> list[Group]:
    return [found[role] for role in BLOCK_SOURCES[block] if role in found]


def _checksum(name: str, found: Found) -> Checksum | None:
    kinds = _kinds(name, found)
    shape = _shape(name, kinds[0]) if kinds else None
    blocks = [b"".join(piece.data for piece in block) for kind in kinds for block in kind.blocks]
    whole = [block for block in blocks if block and (shape is None or len(block) == kinds[0].largest)]
    return find_checksum(whole, shape.header if shape else min(map(len, whole))) if whole else None


def _shape(name: str, kind: Group) -> Shape | None:
    """Return the shape of an image, None for another block."""
    return pitch_shape(kind) if name == "pitch" else colour_shape(kind) if name == "colour" else None


def _block(name: str, found: Found, checksum: Checksum | None, states: States | None) -> Iterator[str]:
    kinds = _kinds(name, found)
    shape = _shape(name, kinds[0])
    heads = list(dict.fromkeys(block[0].head for kind in kinds for block in kind.blocks if block[0].head))
    yield f"\n[blocks.{name}]"
    if name in ("parameters", "status"):
        yield f"length = {kinds[0].lengths[-1]}"
    else:
        yield f"{f'length = {shape.header}' if shape else '# length = ?'}  # of the header before the image"
    if checksum:
        yield f"checksum = {inline_table(checksum)}  # right in all that were seen"
    yield from (f"# seen: {head.hex(' ')}" for head in heads[:MAX_SAMPLES])
    yield f"[blocks.{name}.fields]"
    for field in BLOCK_FIELDS[name] if shape is None or shape.header else ():
        if field == "state" and states:
            yield f"state = {{ at = {states.at} }}  # changes with a release, and again before the images"
        else:
            yield f"# {field} = {{ at = ?, bytes = ? }}"


def _pixels(found: Found) -> Iterator[str]:
    pitch = pitch_packing(found["read_pitch"]) if "read_pitch" in found else None
    yield "\n[pitch]"
    yield from _packing(pitch)
    if pitch is None:
        yield '# order = "?"  # big or little'
        yield '# pixel = [["sum", "u?"], ["moment", "u?"], ["intensity", "u?"]]'
    colour = colour_packing(found["read_colour"]) if "read_colour" in found else None
    yield "\n[colour]"
    yield from _packing(colour)
    if colour is None:
        yield '# layout = "?"  # interleaved, lines or planar'
        yield '# channels = "?"  # RGB, BGR …'


def _packing(packing: Packing | None) -> Iterator[str]:
    if packing:
        yield f"# {packing.evidence}"
        yield from (f"{name} = {json.dumps(value)}" for name, value in packing.table.items())


def _tables(states: States | None) -> Iterator[str]:
    for table, keys in TABLES.items():
        known = states.values if states and table == "states" else {}
        yield f"\n[{table}]"
        yield from (f"{key} = {known[key]}" if key in known else f"# {key} = ?" for key in keys)


def _quoted(text: str) -> str:
    """A TOML string: INQUIRY text is printable ASCII, a name may be anything."""
    escaped = "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in text)
    return f'"{escaped}"'
