"""Settings of capture, restoration and quality check, with ranges, units and presets.

A change is one decision on the volume, so that undo takes it back, and so that it holds at the next opening.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, get_args

from pydantic import ValidationError

from drivers import CaptureSettings, SettingsError
from restore import Settings
from station.console.faults import ConsoleFault
from station.session import Session
from station.session.terms.presets import Preset, changed_preset
from station.verdict.table import MEASURES
from station.verdict.thresholds import Thresholds, check_limits

CAPTURE, RESTORE, VERDICT = "capture", "restore", "verdict"
STORED = {CAPTURE: "capture", RESTORE: "settings", VERDICT: "thresholds"}  # names of the groups in the decision
Changes = dict[str, dict[str, Any]]

RESTORE_UNITS = {"dpi": "dpi", "inpaint_mm": "mm"}


def changes_of(session: Session | None) -> Changes:
    """What was changed in a session, by group; empty without a session."""
    table = {} if session is None else session.history.volume.decided.settings
    return {group: dict(table.get(stored, {})) for group, stored in STORED.items()}


def capture_settings(configured: CaptureSettings, changes: Changes) -> CaptureSettings:
    """The settings of a capture with the changes. Raises SettingsError, TypeError."""
    return replace(configured, **changes[CAPTURE])


def changed(changes: Changes, values: Mapping[str, Any], configured: CaptureSettings, base: Preset | None) -> Changes:
    """Return the changes with further ones by key.

    Like `restore.dpi` → 300; None restores the base's. Raises ConsoleFault that names the key of a value that is not
    possible.
    """
    known = {one["key"] for group in groups(configured, base, changes) for one in group["settings"]}
    merged = {group: dict(table) for group, table in changes.items()}
    for key, value in values.items():
        group, _, name = key.partition(".")
        if key not in known:
            raise _invalid(key, "the setting is not known")
        merged[group].pop(name, None)
        if value is not None:
            merged[group][name] = value
        _check(key, merged, configured, base)
    return merged


def as_decision(changes: Changes) -> dict[str, Any]:
    """The changes as the value of the decision."""
    return {stored: changes[group] for group, stored in STORED.items()}


def groups(
    configured: CaptureSettings, base: Preset | None, changes: Changes, *, without: Collection[str] = ()
) -> list[dict[str, Any]]:
    """Return the settings next to those of configuration and preset.

    The preset's are None without a session. without: measures that the scanner's captures do not have.
    """
    found = [{"key": CAPTURE, "settings": [*_capture(configured, changes[CAPTURE])]}]
    if base is not None:
        restoration = Settings.model_validate(base.settings)
        found.append({"key": RESTORE, "settings": [*_restoration(restoration, changes[RESTORE])]})
        found.append({"key": VERDICT, "settings": [*_verdict(base.thresholds, changes[VERDICT], without)]})
    return found


def _capture(configured: CaptureSettings, changes: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [
        _setting(
            CAPTURE,
            one.name,
            one.kind,
            getattr(configured, one.name),
            changes,
            one.unit,
            one.low,
            one.high,
            list(one.choices) or None,
            one.optional,
            one.text,
        )
        for one in configured.declared()
    ]


def _restoration(base: Settings, changes: Mapping[str, Any]) -> list[dict[str, Any]]:
    schema, found = Settings.model_json_schema()["properties"], []
    for name, field in Settings.model_fields.items():
        choices = [*get_args(field.annotation)] or None
        kind = "choice" if choices else "integer" if field.annotation is int else "number"
        low, high = schema[name].get("minimum"), schema[name].get("maximum")
        unit, text = RESTORE_UNITS.get(name, ""), field.description or ""
        found.append(_setting(RESTORE, name, kind, getattr(base, name), changes, unit, low, high, choices, False, text))
    return found


def _verdict(base: Thresholds, changes: Mapping[str, Any], without: Collection[str]) -> list[dict[str, Any]]:
    return [
        _setting(
            VERDICT,
            name,
            "limits",
            None if value is None else list(value),
            changes,
            MEASURES[name].unit,
            None,
            None,
            None,
            True,
            "green up to the first value, amber up to the second, red beyond it",
        )
        for name, value in base
        if name not in without
    ]


def _setting(
    group: str,
    name: str,
    kind: str,
    preset: Any,
    changes: Mapping[str, Any],
    unit: str,
    low: float | None,
    high: float | None,
    choices: list[str] | None,
    optional: bool,
    text: str,
) -> dict[str, Any]:
    value = changes.get(name, preset)
    step = {"integer": 1, "number": 1}.get(kind)
    return {
        "key": f"{group}.{name}",
        "kind": kind,
        "value": value,
        "preset": preset,
        "changed": value != preset,
        "unit": unit,
        "min": low,
        "max": high,
        "step": step,
        "choices": choices,
        "optional": optional,
        "description": text,
    }


def _check(key: str, changes: Changes, configured: CaptureSettings, base: Preset | None) -> None:
    """Raise ConsoleFault unless the settings are possible."""
    group, _, name = key.partition(".")
    try:
        if group == CAPTURE:
            capture_settings(configured, changes)
        elif base is not None:
            thresholds = changed_preset(base, as_decision(changes)).thresholds
            if group == VERDICT and name in changes[VERDICT]:  # the preset itself stays as it is
                check_limits(name, getattr(thresholds, name))
    except SettingsError as error:
        raise _invalid(key, f"{error}; {error.hint}") from error
    except ValidationError as error:
        raise _invalid(key, error.errors()[0]["msg"]) from error
    except (TypeError, ValueError) as error:
        raise _invalid(key, str(error)) from error


def _invalid(key: str, text: str) -> ConsoleFault:
    fault = ConsoleFault("invalid", f"{key}: {text}", "see the ranges of the settings")
    fault.data |= {"key": key, "text": text}
    return fault
