"""What each camera model needs of a client, as data.

Sources: Ricoh's Web API v2.1 specification and its own client library for the Theta S to X; the
SC2 and the A1 are not documented and described with care: whatever such a camera refuses is left
out, and a bracket that is refused is shot as single pictures.

Insta360's cameras answer to the same protocol. Their own bracket (`hdr`) steps as it likes, so
single pictures are taken of them. Stitching is asked for where `photoStitchingSupport` offers it;
most models stitch HDR pictures only (Insta360_OSC, issues 2, 4, 19, 24, 34), and the merge stitches
the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.core.hdr.planner import CameraLimits, theta_limits

if TYPE_CHECKING:
    from app.devices.theta.messages import Info

KELVIN: Final = 5000
"""Colour temperature that white balance is locked to."""

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


@dataclass(frozen=True, slots=True)
class ModelProfile:
    """One model, or one model with one kind of firmware.

    Attributes
    ----------
    name : str
        Short: "S", "V-old", "generic".
    bracket : {"native", "watched", "single", "insta-hdr"}
        How it brackets: by itself and says when it is done; by itself without ever saying so; not
        at all; or in a way that is of no use here. The last two are shot as single pictures.
    overhead_s : float
        Time a frame takes besides its exposure, in seconds.
    asks_support : bool
        Whether the camera is asked for its picture sizes, apertures and shooting methods: a Theta
        that is not known here.
    picture : tuple[int, int] or None
        Columns and rows of the JPEG to ask for; None leaves it to the camera.
    rest_s : float
        Rest between single pictures, in seconds.
    settle_s : float
        Rest between changing options and taking a picture, in seconds.
    poll_s : float
        Time between two questions how far it is, in seconds.
    previews : tuple[tuple[int, int, int], ...]
        Width, height and frames per second that `previewFormat` accepts, the best for looking
        first; empty where it must not be set.
    user_prefix : str
        Letters between "THETA" and the serial number in the digest user name; "" where there is
        no password or the letters are not known.
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
    api_switch: bool = False
    forgets: bool = False
    min_firmware: tuple[int, ...] = ()
    bracket_firmware: tuple[int, ...] = ()
    previews: tuple[tuple[int, int, int], ...] = ((1024, 512, 30),)
    user_prefix: str = ""
    digest: bool = False
    headers: tuple[tuple[str, str], ...] = ()
    address: str = "192.168.1.1"

    @property
    def brackets_itself(self) -> bool:
        """Whether its own bracket is used."""
        return self.bracket in ("native", "watched")

    def user_name(self, serial: str) -> str:
        """Return the digest user name, "" where it is not known."""
        return f"THETA{self.user_prefix}{serial}" if self.user_prefix else ""


def _theta(name: str, **facts: object) -> ModelProfile:
    """Make the profile of a model whose lists the probe's table has."""
    known = theta_limits(name)
    if known is None:
        raise ValueError(f"no limits for {name}")
    base = ModelProfile(
        name=name,
        title=f"Ricoh Theta {name}",
        bracket="native" if known.native_bracket else "single",
        fallback=known.limits,
        overhead_s=known.overhead_s,
        max_shots=known.max_shots,
    )
    return replace(base, **facts)  # type: ignore[arg-type]


_S: Final = _theta(
    "S",
    shot_keys=_OLD_KEYS,
    picture=(5376, 2688),
    api_switch=True,
    min_firmware=(1, 62),
    bracket_firmware=(1, 82),
    previews=((640, 320, 10),),
)
_V: Final = _theta(
    "V",
    max_shots=19,
    shot_keys=_NEW_KEYS,
    saved=_STITCHED,
    picture=(5376, 2688),
    stitching=True,
    user_prefix="YL",
    digest=True,
    previews=((1024, 512, 30), (1024, 512, 8), (1920, 960, 8), (640, 320, 30)),
)
_X: Final = _theta(
    "X",
    shot_keys=_NEW_KEYS,
    needs_method=True,
    sends_mode=False,
    saved=(*_STITCHED, "_shootingMethod"),
    picture=(5504, 2752),
    stitching=True,
    user_prefix="YR",
    digest=True,
    previews=((1024, 512, 30), (1920, 960, 30), (512, 512, 30)),
)
_CAUTIOUS: Final = CameraLimits(
    tuple(1.0 / 2**k for k in range(10, -3, -1)),
    (100.0, 200.0, 400.0, 800.0),
    (2.0,),
)
_GENERIC: Final = ModelProfile(
    name="generic",
    title="OSC camera",
    bracket="single",
    fallback=_CAUTIOUS,
    max_shots=13,
    ricoh=False,
    saved=_CORE,
    listed=10,
    previews=(),
)
# Like a V, in its own network as well; what else it can it says itself.
_UNKNOWN_THETA: Final = replace(
    _V,
    name="theta",
    title="Ricoh Theta",
    max_shots=13,
    saved=(*_STITCHED, "aperture", "_shootingMethod"),
    asks_support=True,
    picture=None,
    user_prefix="",
    previews=((1024, 512, 30),),
)

PROFILES: Final = (
    _S,
    _theta(
        "SC",
        shot_keys=_OLD_KEYS,
        picture=(5376, 2688),
        api_switch=True,
        bracket_firmware=(1, 10),
        previews=((640, 320, 10),),
    ),
    # It drops the connection when pictures follow each other too fast, and reports zeros for the
    # format of its preview, which must not be set therefore.
    _theta(
        "SC2",
        bracket="watched",
        shot_keys=_OLD_KEYS,
        picture=(5376, 2688),
        rest_s=6.0,
        poll_s=3.0,
        forgets=True,
        previews=(),
    ),
    replace(
        _V,
        name="V-old",
        title="Ricoh Theta V, firmware before 3.00.1",
        max_shots=13,
        shot_keys=_OLD_KEYS,
        saved=_THETA,
        stitching=False,
        min_firmware=(2, 0),
        bracket_firmware=(2, 0),
    ),
    _V,
    _theta(
        "Z1",
        shot_keys=(*_NEW_KEYS, "aperture"),
        saved=(*_STITCHED, "aperture"),
        picture=(6720, 3360),
        stitching=True,
        user_prefix="YN",
        digest=True,
        previews=((1024, 512, 30), (1024, 512, 8), (1920, 960, 8), (640, 320, 30)),
    ),
    _X,
    _theta(
        "A1",
        title="Ricoh360 Theta A1",
        saved=_STITCHED,
        picture=(5504, 2752),
        stitching=True,
        digest=True,
        previews=((1024, 512, 30), (1024, 512, 10)),
    ),
    _UNKNOWN_THETA,
    _GENERIC,
    replace(
        _GENERIC,
        name="insta360",
        title="Insta360",
        bracket="insta-hdr",
        max_shots=9,
        saved=(*_CORE, "hdr", "photoStitching"),
        extra=(("hdr", "off"), ("photoStitching", "ondevice")),
        headers=(("X-XSRF-Protected", "1"),),
        address="192.168.42.1",
    ),
)
"""All profiles."""

_NEW_V: Final = (3, 0, 1)


def profile_named(name: str) -> ModelProfile:
    """Find a profile by its short name.

    Parameters
    ----------
    name : str
        "S", "SC", "SC2", "V", "V-old", "Z1", "X", "A1", "theta", "generic" or "insta360".

    Returns
    -------
    ModelProfile
        The profile; that of any OSC camera where there is none of that name.

    Examples
    --------
    >>> profile_named("SC2").bracket
    'watched'
    """
    return next((each for each in PROFILES if each.name == name), _GENERIC)


def profile_for(info: Info) -> ModelProfile:
    """Choose the profile of a camera by what it says of itself.

    Returns
    -------
    ModelProfile
        That of any OSC camera where the model is not known. A model whose firmware is too old for
        a bracket of its own has "single" for its style.
    """
    if "THETA" not in info.model.upper():
        return profile_named("insta360" if "insta360" in info.model.lower() else "generic")
    known = theta_limits(info.model)
    if known is None:
        return _UNKNOWN_THETA
    name = known.model
    if name == "V" and info.firmware and info.firmware < _NEW_V:
        name = "V-old"
    profile = profile_named(name)
    if info.firmware and info.firmware < profile.bracket_firmware:
        return replace(profile, bracket="single")
    return profile
