"""The properties of each camera model that a client needs to know, as data.

Sources: Ricoh's Web API v2.1 specification and its client library for the Theta S to X. The SC2 and
A1 are not documented. Any options that they refuse are skipped, and a refused bracket is replaced
with single photos.

Insta360 cameras use the same protocol. Their own bracket (`hdr`) chooses its steps, so single
photos are taken instead. Stitching is switched on if `photoStitchingSupport` offers it. Most models
stitch only HDR photos (Insta360_OSC, issues 2, 4, 19, 24, 34), and the merge stitches any others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias

from app.core.camera_catalogue import CAMERAS, CameraFacts, CameraLimits, camera_facts
from app.devices.theta.messages import Info

WIDEST: Final = 8192
"""Largest photo width to request, in pixels, unless the camera offers only wider photos."""

KELVIN: Final = 5000
"""Colour temperature of the fixed white balance, in kelvin."""

Style: TypeAlias = Literal["native", "watched", "single", "insta-hdr"]

_OLD_KEYS: Final = ("shutterSpeed", "iso", "_colorTemperature")
_NEW_KEYS: Final = ("exposureProgram", "shutterSpeed", "iso", "whiteBalance", "_colorTemperature")
_CORE: Final = (
    "exposureProgram",
    "shutterSpeed",
    "iso",
    "aperture",
    "exposureCompensation",
    "whiteBalance",
    "fileFormat",
    "exposureDelay",
    "sleepDelay",
    "offDelay",
)
_THETA: Final = (
    *(name for name in _CORE if name != "aperture"),
    "_colorTemperature",
    "_filter",
    "_autoBracket",
)
_STITCHED: Final = (*_THETA, "_imageStitching", "_topBottomCorrection")

# Additional properties of some models. The SC2 drops the connection if photos follow each other too
# quickly.
_BESIDES: Final[dict[str, dict[str, Any]]] = {
    "S": {"min_firmware": (1, 62), "bracket_firmware": (1, 82)},
    "SC": {"bracket_firmware": (1, 10)},
    "SC2": {"rest_s": 6.0, "poll_s": 3.0, "forgets": True},
    "V": {"max_shots": 19},
}
_NEW_V: Final = (3, 0, 1)


@dataclass(frozen=True, slots=True)
class ModelProfile:
    """A camera model, or a model with a particular kind of firmware.

    Attributes:
        name: Short name, such as "S", "V-old" or "generic".
        bracket: A "native" camera reports the end of its own bracket, and a "watched" one does not.
            A "single" camera has no bracket, and an "insta-hdr" camera has none that can be used.
            Both take single photos instead.
        overhead_s: Time that a frame takes beyond its exposure, in seconds.
        asks_support: Whether to query photo sizes, apertures and shooting methods, which is
            necessary for a Theta that is not in the table.
        picture: Columns and rows of the JPEG, or None to let the camera choose.
        rest_s: Pause between single photos, in seconds.
        settle_s: Pause between changing the options and taking a photo, in seconds.
        poll_s: Pause between successive status requests, in seconds.
        user_prefix: Letters between "THETA" and the serial number in the digest user name, or "" if
            there is no password or the letters are unknown.
    """

    name: str
    title: str
    bracket: Style
    fallback: CameraLimits
    overhead_s: float = 3.0
    max_shots: int = 13
    shot_keys: tuple[str, ...] = ()
    needs_method: bool = False
    sends_mode: bool = True
    ricoh: bool = True
    saved: tuple[str, ...] = _THETA
    extra: tuple[tuple[str, str | int], ...] = ()
    asks_support: bool = False
    picture: tuple[int, int] | None = None
    stitching: bool = False
    listed: int = 100
    rest_s: float = 0.0
    settle_s: float = 1.0
    poll_s: float = 1.0
    forgets: bool = False
    min_firmware: tuple[int, ...] = ()
    bracket_firmware: tuple[int, ...] = ()
    user_prefix: str = ""

    @property
    def brackets_itself(self) -> bool:
        """Whether to use the camera's own bracket."""
        return self.bracket in ("native", "watched")

    def user_name(self, serial: str) -> str:
        """Return the digest user name, or "" if it is unknown."""
        return f"THETA{self.user_prefix}{serial}" if self.user_prefix else ""


def _theta(facts: CameraFacts) -> ModelProfile:
    """Return the profile for a row of the camera table."""
    itself = facts.native_bracket
    keys = _OLD_KEYS if facts.old_bracket else _NEW_KEYS
    apertures = ("aperture",) if len(facts.limits.apertures) > 1 else ()
    method = ("_shootingMethod",) if facts.by_method else ()
    rows, columns = max(size for size in facts.sizes if size[1] <= WIDEST)
    return ModelProfile(
        name=facts.name,
        title=facts.model_text.title() if facts.model else f"Ricoh Theta {facts.name}",
        bracket="watched" if facts.watched else "native" if itself else "single",
        fallback=facts.limits,
        overhead_s=facts.overhead_s,
        max_shots=facts.max_shots,
        shot_keys=(*keys, *apertures) if itself else (),
        needs_method=facts.by_method,
        sends_mode=not facts.by_method,
        saved=(*(_STITCHED if facts.stitching else _THETA), *apertures, *method),
        picture=(columns, rows),
        stitching=facts.stitching,
        user_prefix=facts.user_prefix,
    )


_THETAS: Final = {
    facts.name: replace(_theta(facts), **_BESIDES.get(facts.name, {})) for facts in CAMERAS
}
_V: Final = _THETAS["V"]
_V_OLD: Final = replace(
    _V,
    name="V-old",
    title="Ricoh Theta V, firmware before 3.00.1",
    max_shots=13,
    shot_keys=_OLD_KEYS,
    saved=_THETA,
    stitching=False,
    min_firmware=(2, 0),
    bracket_firmware=(2, 0),
)
# Like a V, it can also be used in a local network; the camera reports its other properties itself.
_UNKNOWN_THETA: Final = replace(
    _V,
    name="theta",
    title="Ricoh Theta",
    max_shots=13,
    saved=(*_STITCHED, "aperture", "_shootingMethod"),
    asks_support=True,
    picture=None,
    user_prefix="",
)
_GENERIC: Final = ModelProfile(
    name="generic",
    title="OSC camera",
    bracket="single",
    fallback=CameraLimits(
        tuple(1.0 / 2**k for k in range(10, -3, -1)), (100.0, 200.0, 400.0, 800.0), (2.0,)
    ),
    ricoh=False,
    saved=_CORE,
    listed=10,
)
_INSTA360: Final = replace(
    _GENERIC,
    name="insta360",
    title="Insta360",
    bracket="insta-hdr",
    max_shots=9,
    saved=(*_CORE, "hdr", "photoStitching"),
    extra=(("hdr", "off"), ("photoStitching", "ondevice")),
)

PROFILES: Final = (*_THETAS.values(), _V_OLD, _UNKNOWN_THETA, _GENERIC, _INSTA360)
"""All profiles."""


def profile_named(name: str) -> ModelProfile:
    """Find a profile by its short name.

    Args:
        name: "S", "SC", "SC2", "V", "V-old", "Z1", "X", "A1", "theta", "generic" or "insta360".

    Returns:
        The profile, or that of a generic OSC camera for any other name.

    Examples:
        >>> profile_named("SC2").bracket
        'watched'
    """
    return next((each for each in PROFILES if each.name == name), _GENERIC)


def profile_for(info: Info) -> ModelProfile:
    """Return the profile that matches a camera's description.

    An unknown model gets the profile of a generic OSC camera. A model whose firmware is too old for
    its own bracket is treated as a "single" camera.
    """
    if "THETA" not in info.model.upper():
        return profile_named("insta360" if "insta360" in info.model.lower() else "generic")
    facts = camera_facts(info.model)
    if facts is None:
        return _UNKNOWN_THETA
    name = facts.name
    if name == "V" and info.firmware and info.firmware < _NEW_V:
        name = "V-old"
    profile = profile_named(name)
    if info.firmware and info.firmware < profile.bracket_firmware:
        return replace(profile, bracket="single")
    return profile
