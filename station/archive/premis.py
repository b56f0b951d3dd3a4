"""PREMIS 2.3: files, what happened to them, and by whom.

PREMIS Data Dictionary, version 2.2, 2012.
"""

from __future__ import annotations

import json
from xml.etree.ElementTree import Element

from station.archive.volume import Event, StoredFile, Volume
from station.archive.xml import PREMIS, XSI, element, optional

VERSION = "2.3"
LOCAL = "local"  # identifiers that are unique within the volume
SOURCE, OUTCOME = "source", "outcome"  # eventRelatedObjectRole of the Library of Congress
EXECUTES, DECIDES = "executing program", "implementer"


def encode_object(file: StoredFile) -> Element:
    """A file: identifier, digest, size, format, and the event that made it."""
    made = element(
        f"{PREMIS}object",
        _identifier("object", file.name),
        element(
            f"{PREMIS}objectCharacteristics",
            element(f"{PREMIS}compositionLevel", 0),
            element(
                f"{PREMIS}fixity",
                element(f"{PREMIS}messageDigestAlgorithm", "SHA-512"),
                element(f"{PREMIS}messageDigest", file.sha512),
            ),
            element(f"{PREMIS}size", file.size),
            element(
                f"{PREMIS}format",
                element(f"{PREMIS}formatDesignation", element(f"{PREMIS}formatName", file.media_type)),
            ),
        ),
        element(f"{PREMIS}originalName", file.path.name),
        element(
            f"{PREMIS}linkingEventIdentifier",
            element(f"{PREMIS}linkingEventIdentifierType", LOCAL),
            element(f"{PREMIS}linkingEventIdentifierValue", file.event),
        ),
        version=VERSION,
    )
    made.set(f"{XSI}type", "premis:file")
    return made


def encode_event(event: Event) -> Element:
    """Encode an event: kind, time, parameters, outcome, program, files read and made."""
    detail = {"detail": event.detail, "parameters": dict(event.parameters)}
    note = json.dumps(dict(event.facts), sort_keys=True) if event.facts else None
    return element(
        f"{PREMIS}event",
        _identifier("event", event.identifier),
        element(f"{PREMIS}eventType", event.kind),
        element(f"{PREMIS}eventDateTime", event.time.isoformat()),
        element(f"{PREMIS}eventDetail", json.dumps({k: v for k, v in detail.items() if v}, sort_keys=True)),
        element(
            f"{PREMIS}eventOutcomeInformation",
            element(f"{PREMIS}eventOutcome", "success"),
            None
            if note is None
            else element(f"{PREMIS}eventOutcomeDetail", optional(f"{PREMIS}eventOutcomeDetailNote", note)),
        ),
        _linked("Agent", event.agent, EXECUTES),
        _linked("Agent", event.operator, DECIDES) if event.operator else None,
        [_linked("Object", name, SOURCE) for name in event.sources],
        [_linked("Object", name, OUTCOME) for name in event.results],
        version=VERSION,
    )


def encode_agents(volume: Volume) -> dict[str, Element]:
    """The programs and operators of all events, by their names; programs with version."""
    agents = {event.agent: "software" for event in volume.events}
    agents = {event.operator: "person" for event in volume.events if event.operator} | agents
    return {
        name: element(
            f"{PREMIS}agent",
            _identifier("agent", name),
            element(f"{PREMIS}agentName", name),
            element(f"{PREMIS}agentType", kind),
            version=VERSION,
        )
        for name, kind in agents.items()
    }


def _identifier(kind: str, value: str) -> Element:
    return element(
        f"{PREMIS}{kind}Identifier",
        element(f"{PREMIS}{kind}IdentifierType", LOCAL),
        element(f"{PREMIS}{kind}IdentifierValue", value),
    )


def _linked(kind: str, value: str, role: str) -> Element:
    return element(
        f"{PREMIS}linking{kind}Identifier",
        element(f"{PREMIS}linking{kind}IdentifierType", LOCAL),
        element(f"{PREMIS}linking{kind}IdentifierValue", value),
        element(f"{PREMIS}linking{kind}Role", role),
    )
