"""Distance, laser power and gain of a shot.

They come from the settings, or else from autofocus and previews.
"""

from __future__ import annotations

from dataclasses import replace

from drivers.scanner import SettingsError
from drivers.vivid900.capture import exposure
from drivers.vivid900.capture.body import Body
from drivers.vivid900.capture.pitch import Pitch
from drivers.vivid900.errors import PanelError
from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import FAST, LENSES, depth_window
from drivers.vivid900.geometry.triangulation import points_of
from drivers.vivid900.profile.commands import Parameters, ShotMode
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.settings import VividSettings
from restore.scan import Bytes, Floats

LOW_CONTRAST = "AF ERROR LOW CONTRAST"
SHOT_MODES = {"fine": ShotMode.FINE_COLOUR, "fast": ShotMode.FAST_COLOUR}
AUTOFOCUS = {"commands.passive_autofocus", "commands.active_autofocus"}
START_POWER = 30  # of the first preview where no autofocus chooses one: three stops from the strongest
MAX_PREVIEWS = 4  # three stops each: enough from the weakest laser to the strongest
REFOCUS_FRACTION = 0.125  # fraction of the depth window that the page may be off centre before the shot is refocused


def choose_parameters(body: Body, settings: VividSettings, calibration: Calibration) -> Parameters:
    """Parameters of the shots that the settings ask for.

    Raises PanelError when autofocus fails, SettingsError for what the profile's scanner cannot find or set by itself.
    """
    _require_settings(body.profile, settings)
    parameters = _with_settings(_focused(body, settings), settings)
    if settings.laser_power is None or settings.distance_mm is None:
        parameters = _adjusted_by_previews(body, parameters, settings, calibration)
    return replace(parameters, mode=SHOT_MODES[settings.mode], auto_read=0)


def _require_settings(profile: Profile, settings: VividSettings) -> None:
    """Raise SettingsError for settings that the profile cannot carry out.

    It cannot write a given one, or cannot do without a missing one.
    """
    absent = profile.absences
    if settings.gain is not None and "blocks.parameters.gain" in absent:
        raise SettingsError("the command profile has no gain", "leave gain out of [capture]")
    if settings.laser_power is None and "pitch.intensity" in absent:
        raise SettingsError(
            "the range image has no brightness to choose the laser's power by", "set laser_power in [capture]"
        )
    if settings.distance_mm is None and absent.keys() >= AUTOFOCUS:
        raise SettingsError("the command profile has no autofocus", "set distance_mm in [capture]")


def _focused(body: Body, settings: VividSettings) -> Parameters:
    """Focus as the settings need it and the profile allows.

    Laser and distance that are not found stay as they are.
    """
    commands, parameters = body.profile.commands, body.read_parameters()
    if settings.laser_power is None and "active_autofocus" in commands:
        return body.autofocus("active")
    if settings.distance_mm is not None:
        return parameters
    if "passive_autofocus" not in commands:
        return body.autofocus("active")
    try:
        return body.autofocus("passive")
    except PanelError as error:  # an unprinted page has no contrast; active autofocus uses the laser
        if error.panel != LOW_CONTRAST or "active_autofocus" not in commands:
            raise
        return body.autofocus("active")


def _with_settings(parameters: Parameters, settings: VividSettings) -> Parameters:
    """The parameters with the values that the settings fix."""
    distance = parameters.distance_mm if settings.distance_mm is None else round(settings.distance_mm)
    power = parameters.laser_power or START_POWER if settings.laser_power is None else settings.laser_power
    gain = parameters.gain if settings.gain is None else settings.gain
    return replace(parameters, distance_mm=distance, laser_power=power, gain=gain)


def _adjusted_by_previews(
    body: Body, parameters: Parameters, settings: VividSettings, calibration: Calibration
) -> Parameters:
    """Adjust parameters by previews.

    Paper is then well exposed and the page centred in the depth window.
    """
    gain_is_fixed = settings.gain is not None or "blocks.parameters.gain" in body.profile.absences
    for _ in range(MAX_PREVIEWS):
        pitch = _preview(body, parameters)
        before = parameters
        if settings.laser_power is None and pitch.intensity is not None:
            parameters = _exposed(parameters, pitch.intensity, gain_is_fixed=gain_is_fixed)
        if settings.distance_mm is None:
            points = points_of(pitch.frames, calibration, FAST, parameters.distance_mm)
            parameters = replace(parameters, distance_mm=_refocused(points, calibration, parameters.distance_mm))
        if parameters == before:
            break
    return parameters


def _exposed(parameters: Parameters, intensity: Bytes, *, gain_is_fixed: bool) -> Parameters:
    level = exposure.brightness(intensity)
    if exposure.is_well_exposed(level):
        return parameters
    return exposure.corrected_exposure(parameters, level, gain_is_fixed=gain_is_fixed)


def _preview(body: Body, parameters: Parameters) -> Pitch:
    shot = body.shoot(replace(parameters, mode=ShotMode.FAST_COLOUR, auto_read=1))
    assert shot.pitch is not None  # a FAST shot has one
    return shot.pitch


def _refocused(points: Floats, calibration: Calibration, distance_mm: int) -> int:
    middle = exposure.centring_distance(points, calibration.pupil_mm)
    near, far = depth_window(LENSES[calibration.lens], FAST, distance_mm)
    if middle is None or abs(middle - distance_mm) < REFOCUS_FRACTION * (far - near):
        return distance_mm
    return round(middle)
