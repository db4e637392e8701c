"""Reading, changing and restoring the camera's settings.

Every setting is saved in the session's journal before it is changed. It can therefore be restored
even after a power cut.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from app.core.places.journal import keepable
from app.core.text import tr
from app.devices.capture.reconnection import NOT_NOW, Contact
from app.devices.capture.session import Session
from app.devices.errors import CameraNotReady, CameraRefused, DeviceError
from app.devices.protocol_profiles import KELVIN, WIDEST, ModelProfile

_NEVER: Final = 65535
# seconds; Ricoh requires this pause between `_filter` and `captureMode`
_AFTER_FILTER_S: Final = 1.0
_MANUAL: Final = 1
_EXPOSING: Final = ("shutterSpeed", "iso", "aperture")
_UNKNOWN: Final = frozenset({"invalidParameterName", "invalidParameterValue", "missingParameter"})
_TOGETHER: Final = ("fileFormat", "exposureDelay", "_imageStitching", "_topBottomCorrection")
_SEAMS: Final = frozenset({"_imageStitching", "_topBottomCorrection"})
# No warning is needed if the camera rejects a value that it reported itself.
_UNTOLD: Final = frozenset({"_autoBracket", "shutterSpeed", "iso", "aperture", "offDelay"})


def read(contact: Contact, names: Sequence[str]) -> dict[str, Any]:
    """Read options, skipping any that the camera does not support."""
    try:
        options = contact.ask(lambda: contact.client.get_options(names), NOT_NOW)
    except CameraRefused as error:
        if error.code not in _UNKNOWN:
            raise
        if len(names) <= 1:
            return {}
        # Read one at a time, since the error does not name the unsupported option.
        values: dict[str, Any] = {}
        for name in names:
            values |= read(contact, (name,))
        return values
    return {name: options[name] for name in names if name in options}


def change(contact: Contact, options: Mapping[str, Any]) -> None:
    """Change options in one call.

    Raises:
        CameraRefused: If the camera does not know an option or does not accept its value.
    """
    try:
        contact.ask(lambda: contact.client.set_options(options), NOT_NOW)
        contact.note_settings(options)
    finally:
        contact.changed_at = contact.clock.now()


def change_if_known(contact: Contact, options: Mapping[str, Any]) -> tuple[str, ...]:
    """Change the options that the camera accepts, and return the names of the others."""
    return tuple(_refusals(contact, options))


def _refusals(contact: Contact, options: Mapping[str, Any]) -> dict[str, str]:
    """Change the options that the camera accepts. Return the others' error codes by name."""
    if not options:
        return {}
    try:
        change(contact, options)
    except CameraRefused as error:
        if error.code not in _UNKNOWN | NOT_NOW:
            raise
        if len(options) == 1:
            return dict.fromkeys(options, error.code)
        refusals: dict[str, str] = {}
        for name, value in options.items():
            refusals |= _refusals(contact, {name: value})
        return refusals
    return {}


def settle(contact: Contact, profile: ModelProfile) -> None:
    """Wait until the camera has applied its options and can shoot.

    Ricoh's specification requires a second between setOptions and a photo or preview.
    """
    contact.pause(profile.settle_s - (contact.clock.now() - contact.changed_at))


def save(contact: Contact, session: Session, profile: ModelProfile) -> ModelProfile:
    """Save in the journal the settings that `prepare` and the shots will change.

    Settings already in the journal date from before an interruption and are kept unchanged.

    Returns:
        The profile without the options that the camera does not report, or reports with an invalid
        value. These must not be changed, because they could not be restored.
    """
    settings = dict(session.journal.settings_to_restore)
    if "captureMode" not in settings:
        settings = keepable(read(contact, ("captureMode",))) | settings
        session.update(settings_to_restore=settings)
    if settings.get("captureMode", "image") != "image":
        # The other options depend on the mode.
        change(contact, {"captureMode": "image"})
        contact.pause(profile.settle_s)
    missing = [name for name in profile.saved if name not in settings]
    if missing:
        settings |= keepable(read(contact, missing))
        session.update(settings_to_restore=settings)
    if profile.asks_support:
        profile = _learned(contact, profile)
    return replace(
        profile,
        saved=tuple(name for name in profile.saved if name in settings),
        extra=tuple(each for each in profile.extra if each[0] in settings),
        stitching=profile.stitching and settings.keys() >= _SEAMS,
    )


def _learned(contact: Contact, profile: ModelProfile) -> ModelProfile:
    """Complete the profile of an unknown Theta from the values that it reports."""
    support = read(contact, ("fileFormatSupport", "apertureSupport", "_shootingMethodSupport"))
    methods, apertures = support.get("_shootingMethodSupport"), support.get("apertureSupport")
    by_method = isinstance(methods, list) and "bracket" in methods
    keys = list(profile.shot_keys)
    if isinstance(apertures, list) and len(apertures) > 1:
        keys.append("aperture")
    return replace(
        profile,
        picture=_panorama(support.get("fileFormatSupport")),
        needs_method=by_method,
        sends_mode=not by_method,
        shot_keys=tuple(dict.fromkeys(keys)),
    )


def _panorama(value: Any) -> tuple[int, int] | None:
    """Return the size (columns, rows) of the largest JPEG panorama within `WIDEST` columns."""
    sizes = set()
    for each in value if isinstance(value, list) else ():
        if isinstance(each, dict) and each.get("type") == "jpeg" and "_mode" not in each:
            width, height = each.get("width"), each.get("height")
            if isinstance(width, int) and isinstance(height, int) and width == 2 * height > 0:
                sizes.add((width, height))
    return max((size for size in sizes if size[0] <= WIDEST), default=min(sizes, default=None))


def prepare(contact: Contact, profile: ModelProfile) -> None:
    """Set the camera to take plain photos and stay awake, using the options that it supports.

    Raises:
        CameraRefused: If the camera cannot be set to take photos.
    """
    change(contact, {"captureMode": "image"})
    contact.pause(profile.settle_s)
    names = set(profile.saved)
    for options in _plain_pictures(profile):
        change_if_known(contact, {name: options[name] for name in options if name in names})
    for name, value in profile.extra:
        choices = read(contact, (f"{name}Support",)).get(f"{name}Support")
        if not isinstance(choices, list) or value in choices:
            change_if_known(contact, {name: value})


def _plain_pictures(profile: ModelProfile) -> Iterable[dict[str, Any]]:
    yield {"_filter": "off"}
    yield {"_shootingMethod": "normal"}
    yield {"sleepDelay": _NEVER, "offDelay": _NEVER}
    yield {"exposureDelay": 0}
    if profile.picture is not None:
        width, height = profile.picture
        yield {"fileFormat": {"type": "jpeg", "width": width, "height": height}}
    # As in the camera's own bracket, use the seam and level of the first frame for all frames.
    yield {"_imageStitching": "auto"}
    yield {"_topBottomCorrection": "ApplyAuto"}
    yield locked_white(profile)


def locked_white(profile: ModelProfile) -> dict[str, Any]:
    """Return the options for a fixed white balance."""
    if profile.ricoh:
        return {"whiteBalance": "_colorTemperature", "_colorTemperature": KELVIN}
    return {"whiteBalance": "daylight"}


def restore(contact: Contact, session: Session) -> tuple[str, ...]:
    """Restore the camera's settings and remove them from the journal.

    Returns:
        The names of the options that the camera refused.

    Raises:
        DeviceError: If the camera cannot be reached or is busy. In that case the settings stay in
            the journal.
    """
    settings = dict(session.journal.settings_to_restore)
    if not settings:
        return ()
    contact.reconnect()  # A Theta S that reconnected unnoticed would refuse everything.
    refusals: dict[str, str] = {}
    for options in _in_order(settings):
        if "captureMode" in options:
            contact.pause(_AFTER_FILTER_S - (contact.clock.now() - contact.changed_at))
        refusals |= _refusals(contact, options)
    later = {name: settings[name] for name, code in refusals.items() if code in NOT_NOW}
    session.update(settings_to_restore=later)
    if later:
        raise CameraNotReady(tr("The camera is busy."), tr("Wait until it has finished."), "busy")
    return tuple(name for name in refusals if name not in _UNTOLD)


def restore_or_say(contact: Contact, session: Session) -> str:
    """Restore the settings as `restore` does, and describe any failure.

    Returns:
        A sentence about the failure, or "" if there was none.
    """
    try:
        refusals = restore(contact, session)
    except DeviceError:
        return tr(
            "The camera is still using the capture settings. To restore its original settings, "
            "connect to it and open this session again."
        )
    return untaken_words(refusals)


def untaken_words(names: Sequence[str]) -> str:
    """Return a sentence naming the settings that were not restored, or "" if there are none."""
    if not names:
        return ""
    return tr(
        "These camera settings could not be restored: {settings}.",
        settings=", ".join(names),
    )


def _in_order(settings: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Yield groups of options in an order that the camera accepts."""
    rest = dict(settings)
    mode = rest.pop("captureMode", None)
    # The camera accepts a bracket only while its values are legal, so send it before the program.
    yield _take(rest, ("_autoBracket",))
    yield _take(rest, ("_shootingMethod",))
    program = rest.get("exposureProgram")
    yield _take(rest, ("exposureProgram",))
    exposing = _take(rest, _EXPOSING)
    # 0 means automatic, except in the manual program.
    yield {name: value for name, value in exposing.items() if value}
    compensation = _take(rest, ("exposureCompensation",))
    yield compensation if program != _MANUAL else {}
    yield from _white(rest)
    yield _take(rest, _TOGETHER)
    for name in tuple(rest):
        yield _take(rest, (name,))
    if mode is not None:
        yield {"captureMode": mode}


def _white(rest: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Yield the colour temperature in the only mode that accepts it, then the white balance."""
    balance = _take(rest, ("whiteBalance",))
    kelvin = _take(rest, ("_colorTemperature",))
    if kelvin and kelvin["_colorTemperature"] != KELVIN:
        yield {"whiteBalance": "_colorTemperature", **kelvin}
    yield balance


def _take(rest: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    return {name: rest.pop(name) for name in names if name in rest}
