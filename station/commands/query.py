"""`planish query`: a scanner's answers to a command profile's questions.

They are asked before the profile is trusted.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from station.commands.options import Config, Debug, Json
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from drivers.vivid900.profile.profile import Profile
    from drivers.vivid900.query import Answer

BYTES_A_LINE = 16


def query(config: Config, as_json: Json = False, debug: Debug = False) -> None:
    """Read a scanner's identity, status and parameters.

    Nothing is written to the scanner.
    """
    with report_faults(debug=debug):
        from drivers import open_link
        from drivers.vivid900.query import ask as ask_scanner
        from station.config import load_config

        link, profile = open_link(load_config(config).scanner)
        try:
            identity, answers = ask_scanner(link, profile)
        finally:
            link.transport.close()
        if as_json:
            print_result(json.dumps(_as_data(identity, profile, answers), indent=2))
            return
        print_result(f"{identity}")
        print_result("\n".join([*_profile_lines(profile), *(line for answer in answers for line in _lines(answer))]))


def _as_data(identity: object, profile: Profile, answers: Sequence[Answer]) -> dict[str, Any]:
    """The answers as JSON values; bytes in hexadecimal."""
    blocks = [
        {"name": one.name, "data": one.data.hex(), "values": dict(one.values), "problem": one.problem}
        for one in answers
    ]
    return {"device": str(identity), "profile": profile.name, "trusted": profile.trusted, "blocks": blocks}


def _profile_lines(profile: Profile) -> Iterator[str]:
    trust = "trusted" if profile.trusted else "not trusted: the driver only queries: it neither writes nor captures"
    yield f"profile {profile.name}: {trust}"
    if profile.lacking:
        yield f"  has to be found out: {', '.join(profile.lacking)}"
    yield from (f"  without {name}: {text}" for name, text in profile.absences.items() if name not in profile.lacking)


def _lines(answer: Answer) -> Iterator[str]:
    rows = [answer.data[at : at + BYTES_A_LINE].hex(" ") for at in range(0, len(answer.data), BYTES_A_LINE)]
    yield f"{answer.name}: {rows[0] if rows else ''}".rstrip()
    yield from (f"{'':{len(answer.name) + 2}}{row}" for row in rows[1:])
    yield from (f"  {name} = {value}" for name, value in answer.values.items())
    if answer.problem:
        yield f"  {answer.problem}"
