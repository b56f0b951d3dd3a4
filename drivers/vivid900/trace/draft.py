"""A draft of a command profile from a capture, in the layout of `configs/profiles`.

What was seen is filled in, what has to be found out is a comment: until that is done the draft is no profile, and the
driver refuses it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from drivers.scanner import MAX_DISTANCE_MM, MIN_DISTANCE_MM
from drivers.vivid900.errors import BadReply
from drivers.vivid900.scsi import INQUIRY, Identity, parse_identity
from drivers.vivid900.trace.exchanges import Exchange
from drivers.vivid900.trace.groups import Group, Span
from drivers.vivid900.trace.roles import Guess, guess_roles

ROLES = (
    "read_parameters", "write_parameters", "passive_autofocus", "active_autofocus", "release", "status",
    "read_pitch", "read_colour",
)  # fmt: skip
BLOCK_FIELDS = {
    "parameters": ("distance_mm", "laser_power", "gain", "mode", "auto_read", "threshold", "colour"),
    "status": ("state", "panel", "lens", "shot", "lens_serial", "body_serial"),
    "pitch": ("rows", "cols", "shot"),
    "colour": ("rows", "cols", "shot"),
}
BLOCK_SOURCES = {
    "parameters": ("write_parameters", "read_parameters"),
    "status": ("status",),
    "pitch": ("read_pitch",),
    "colour": ("read_colour",),
}
TABLES = {
    "states": ("warming-up", "barrier-closed", "ready", "busy", "data"),
    "lenses": ("TELE", "MIDDLE", "WIDE"),
}
MAX_SAMPLES = 6  # of a block's bytes, as comments


def draft_profile(exchanges: Sequence[Exchange], *, name: str) -> str:
    """The text of the draft, valid TOML for every capture."""
    guesses = guess_roles(exchanges)
    parts = (_opening(exchanges, name), _commands(guesses), *_all_blocks(guesses), _pixels(guesses), _tables())
    return "\n".join(chain.from_iterable(parts)) + "\n"


def _opening(exchanges: Sequence[Exchange], name: str) -> Iterator[str]:
    yield "# A DRAFT from a capture of the vendor's program. The lengths and bytes were seen, the roles are guesses."
    yield "# Replace every ? by what you find out. Send nothing of it to a scanner before you know what it does:"
    yield "# an unknown command may move parts or switch the laser on."
    yield f"\nname = {_quoted(name)}"
    yield 'about = "drafted from a capture, not verified"'
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
    for guess in sorted(guesses, key=lambda guess: ROLES.index(guess.role) if guess.role else len(ROLES)):
        layout, unknown = _layout(guess.group, guess.role)
        yield f"# {len(guess.group.exchanges)} times {guess.group.pattern}: {guess.evidence}"
        if unknown:
            yield f"# what is in byte {', '.join(map(str, unknown))}?"
        sure = guess.role and guess.role not in taken and not unknown
        yield f"{'' if sure else '# '}{guess.role or '?'} = {_quoted(layout)}"
        taken |= {guess.role} if guess.role and sure else set()
    yield from (f'# {role} = "?"  # was not seen' for role in ROLES if role not in taken)


def _layout(kind: Group, role: str | None) -> tuple[str, tuple[int, ...]]:
    """The CDB in a profile's notation, and the offsets of varying bytes without a known role."""
    fields: dict[str, Span] = {}
    if kind.length:
        fields["length"] = kind.length
    if kind.offset:
        fields["offset"] = kind.offset
    covered = {place for start, size in fields.values() for place in range(start, start + size)}
    unknown = tuple(sorted(kind.varying - covered))
    if role == "read_colour" and len(unknown) == 1:  # the development kit asks for a kind of image
        fields["kind"], unknown = (unknown[0], 1), ()
    starts = {start: f"{name}/{size}" for name, (start, size) in fields.items()}
    covered = {place for start, size in fields.values() for place in range(start + 1, start + size)}
    cdb = kind.exchanges[0].cdb
    words = (starts.get(place, f"{byte:02X}") for place, byte in enumerate(cdb) if place not in covered)
    return " ".join(words), unknown


def _all_blocks(guesses: Sequence[Guess]) -> Iterator[Iterator[str]]:
    for block, roles in BLOCK_SOURCES.items():
        found = [guess.group for guess in guesses if guess.role in roles]
        yield _block(block, found)


def _block(name: str, found: Sequence[Group]) -> Iterator[str]:
    heads = list(dict.fromkeys(exchange.head for kind in found for exchange in _first_pieces(kind) if exchange.head))
    yield f"\n[blocks.{name}]"
    if name in ("parameters", "status") and found:
        yield f"length = {found[0].lengths[-1]}"
    else:
        yield "# length = ?  # of the header before the image"
    yield "# crc32 = ?  # where it lies, when there is one"
    yield from (f"# seen: {head.hex(' ')}" for head in heads[:MAX_SAMPLES])
    yield f"[blocks.{name}.fields]"
    for field in BLOCK_FIELDS[name]:
        places = _distance_places(heads) if field == "distance_mm" else ""
        yield f"# {field} = {{ at = ?, bytes = ? }}{places}"


def _first_pieces(kind: Group) -> Iterator[Exchange]:
    offset = kind.offset
    return (e for e in kind.good if offset is None or not any(e.cdb[offset[0] : sum(offset)]))


def _distance_places(heads: Sequence[bytes]) -> str:
    """Comment with the offsets at which two bytes are always a valid distance."""
    shortest = min(map(len, heads), default=0)
    places = [
        place
        for place in range(shortest - 1)
        if all(MIN_DISTANCE_MM <= int.from_bytes(head[place : place + 2], "big") <= MAX_DISTANCE_MM for head in heads)
    ]
    return f"  # two bytes from 500 to 2500 are at {', '.join(map(str, places))}" if places else ""


def _pixels(guesses: Sequence[Guess]) -> Iterator[str]:
    yield "\n[pitch]"
    yield from (f"# {guess.evidence}" for guess in guesses if guess.role == "read_pitch")
    yield '# order = "?"  # big or little'
    yield '# pixel = [["sum", "u?"], ["moment", "u?"], ["intensity", "u?"]]'
    yield "\n[colour]"
    yield '# layout = "?"  # interleaved or planar'
    yield '# channels = "?"  # RGB, BGR …'


def _tables() -> Iterator[str]:
    for table, keys in TABLES.items():
        yield f"\n[{table}]"
        yield from (f"# {key} = ?" for key in keys)


def _quoted(text: str) -> str:
    """A TOML string: INQUIRY text is printable ASCII, a name may be anything."""
    escaped = "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in text)
    return f'"{escaped}"'
