"""The cameras that can be simulated: what each model says of itself, accepts, and gets wrong.

Numbers and words are those of Ricoh's Web API v2.1 and of public replies of the models, written
down here once more on purpose: the client has tables of its own, and a slip in either shows. What
Ricoh does not document (SC2, A1) is a guess on the awkward side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

from app.devices.simulated.cameras import GENERIC, THETA_S, THETA_SC2, THETA_V, THETA_X, THETA_Z1

if TYPE_CHECKING:
    from app.devices.simulated.cameras import CameraModel

# fmt: off
_SHUTTERS: Final = (
    0.00004, 0.00005, 0.0000625, 0.00008, 0.0001, 0.000125, 0.00015625, 0.0002, 0.00025,
    0.0003125, 0.0004, 0.0005, 0.000625, 0.0008, 0.001, 0.00125, 0.0015625, 0.002, 0.0025,
    0.003125, 0.004, 0.005, 0.00625, 0.008, 0.01, 0.0125, 0.01666666, 0.02, 0.025, 0.03333333,
    0.04, 0.05, 0.06666666, 0.07692307, 0.1, 0.125, 0.16666666, 0.2, 0.25, 0.33333333, 0.4, 0.5,
    0.625, 0.76923076, 1, 1.3, 1.6, 2, 2.5, 3.2, 4, 5, 6, 8, 10, 13, 15, 20, 25, 30, 60,
)
_ISOS: Final = (
    50, 64, 80, 100, 125, 160, 200, 250, 320, 400, 500, 640, 800, 1000, 1250, 1600, 2000, 2500,
    3200, 4000, 5000, 6400,
)
# fmt: on
_PROGRAMS: Final = (1, 2, 4, 9)
_OLD_KEYS: Final = frozenset({"shutterSpeed", "iso", "_colorTemperature"})
_ALL_KEYS: Final = _OLD_KEYS | {"exposureCompensation"}


@dataclass(frozen=True, slots=True)
class BracketRules:
    """What a model wants of `_autoBracket` and how its own bracket runs.

    Attributes
    ----------
    programs : tuple[int, ...]
        Exposure programs that `exposureProgram` may name.
    """

    most: int
    required: frozenset[str]
    optional: frozenset[str] = frozenset()
    programs: tuple[int, ...] = (1,)
    method: bool = False
    watched: bool = False
    grouped: bool = False


@dataclass(frozen=True, slots=True)
class Personality:
    """One model with one firmware.

    Attributes
    ----------
    api_levels : tuple[int, ...]
        (1, 2) for models that wake up in API 2.0 and must be switched.
    sizes : tuple[tuple[int, int], ...]
        Rows and columns that it stores, the default first.
    previews : tuple[tuple[int, int, int], ...]
        Width, height and frames per second; empty where the camera reports zeros.
    status_ids : bool
        Whether the id is repeated when it is asked for a command's state; Ricoh's own examples of
        API 2.1 do not have it.
    snaps : bool
        Whether automatic exposure times lie on the list of the manual program.
    lens_stops : float
        By how many stops the lenses' ISO differs when the camera meters by itself.
    overhead_s : float
        Time that a frame takes besides its exposure, in seconds.
    thumb : tuple[int, int]
        Rows and columns of its thumbnails.
    """

    name: str
    model: str
    serial: str
    firmware: str
    camera: CameraModel
    sizes: tuple[tuple[int, int], ...]
    shutters: tuple[float, ...]
    isos: tuple[float, ...]
    apertures: tuple[float, ...]
    overhead_s: float
    bracket: BracketRules | None = None
    manufacturer: str = "RICOH"
    prefix: str = ""
    api_levels: tuple[int, ...] = (2,)
    programs: tuple[int, ...] = _PROGRAMS
    ricoh: bool = True
    insta: bool = False
    folder: str = "100RICOH"
    stem: str = "R001"
    previews: tuple[tuple[int, int, int], ...] = ((1024, 512, 30),)
    filters: tuple[str, ...] = ("off", "DR Comp", "Noise Reduction", "hdr")
    stitching: tuple[str, ...] = ()
    levelling: tuple[str, ...] = ()
    sleep_delays: tuple[int, ...] = (60, 65534, 65535)
    digest: bool = False
    numeric_ids: bool = False
    status_ids: bool = True
    ranges: bool = False
    snaps: bool = True
    lens_stops: float = 0.0
    metadata: Literal["full", "no-size", "wrong", "none"] = "full"
    keeps_settings: bool = True
    thumbs_hang: bool = False
    rest_s: float = 0.0
    preview_rest_s: float = 0.0
    header: str = ""
    address: str = "192.168.1.1"
    thumb: tuple[int, int] = (160, 320)

    @property
    def user(self) -> str:
        """User name in somebody's network: "THETA" and the whole serial number."""
        return f"THETA{self.prefix}{self.serial}"

    @property
    def switches_api(self) -> bool:
        """Whether it wakes up in API 2.0."""
        return 1 in self.api_levels


def _between(low: float, high: float, values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(value for value in values if low <= value <= high)


_LONG: Final = tuple(sorted([*_SHUTTERS, 40, 50]))
_X_SHUTTERS: Final = tuple(
    sorted([0.00007812, *(t for t in _between(0.0000625, 60, _LONG) if t != 0.00008)])
)
_STITCHING: Final = ("auto", "static", "dynamicAuto", "dynamicSave", "dynamicLoad", "none")
_LEVELLING: Final = ("ApplyAuto", "Apply", "ApplySave", "ApplyLoad", "Disapply")
_V_PREVIEWS: Final = ((1024, 512, 30), (1024, 512, 8), (1920, 960, 8), (640, 320, 30))
_NEW_KEYS: Final = frozenset({"exposureProgram", "whiteBalance"})

_S: Final = Personality(
    name="S",
    model="RICOH THETA S",
    serial="00141592",
    prefix="XS",
    firmware="01.82",
    camera=THETA_S,
    sizes=((2688, 5376), (1024, 2048)),
    shutters=_between(0.00015625, 60, _SHUTTERS),
    isos=_between(100, 1600, _ISOS),
    apertures=(2.0,),
    overhead_s=6.5,
    bracket=BracketRules(13, _OLD_KEYS, grouped=True),
    status_ids=False,
    api_levels=(1, 2),
    folder="7d414c4e5448535d2f08c10201a2b300/100RICOH",
    previews=((640, 320, 10),),
    filters=("off", "DR Comp", "Noise Reduction", "hdr"),
    sleep_delays=(30, 1800, 65535),
    snaps=False,
    lens_stops=0.67,
    metadata="none",
    thumb=(80, 160),
)
_SC: Final = replace(
    _S,
    name="SC",
    model="RICOH THETA SC",
    serial="30271828",
    firmware="01.20",
    camera=replace(
        THETA_S,
        name="SC",
        model="RICOH THETA SC".ljust(63),
        software="RICOH THETA SC Ver 1.20".ljust(31),
    ),
    shutters=_between(0.000125, 60, _SHUTTERS),
    folder="7d414c4e54485343f208c10201c4d500/100RICOH",
    preview_rest_s=1.2,
)
_SC2: Final = Personality(
    name="SC2",
    model="RICOH THETA SC2",
    serial="20161803",
    prefix="YP",
    firmware="01.82",
    camera=THETA_SC2,
    sizes=((2688, 5376),),
    shutters=_between(0.000125, 60, _SHUTTERS),
    isos=_between(64, 3200, _ISOS),
    apertures=(2.0,),
    overhead_s=7.5,
    bracket=BracketRules(13, _OLD_KEYS, watched=True),
    status_ids=False,
    folder="thetasc25ca1ab1e0ddba11000c0ffee0/100RICOH",
    previews=(),
    filters=("off", "Noise Reduction", "hdr"),
    metadata="wrong",
    keeps_settings=False,
    thumbs_hang=True,
    rest_s=1.5,
)
_V: Final = Personality(
    name="V",
    model="RICOH THETA V",
    serial="00112358",
    prefix="YL",
    firmware="3.82.1",
    camera=replace(THETA_V, software="RICOH THETA V Ver 3.82.1"),
    sizes=((2688, 5376),),
    shutters=_LONG,
    isos=_between(64, 3200, _ISOS),
    apertures=(2.0,),
    overhead_s=3.0,
    bracket=BracketRules(19, _NEW_KEYS, _ALL_KEYS, programs=(1, 2, 4, 9), grouped=True),
    status_ids=False,
    folder="150100524436344d42013d00a5b1c800/100RICOH",
    previews=_V_PREVIEWS,
    filters=("off", "DR Comp", "Noise Reduction", "hdr", "Hh hdr"),
    stitching=_STITCHING,
    levelling=_LEVELLING,
    digest=True,
    ranges=True,
    lens_stops=0.33,
)
_V_OLD: Final = replace(
    _V,
    name="V-old",
    firmware="2.50.1",
    # It states its tilt and leaves levelling to others.
    camera=replace(THETA_V, name="V-old", software="RICOH THETA V Ver 2.50.1", levels_itself=False),
    shutters=_SHUTTERS,
    bracket=BracketRules(13, _OLD_KEYS, grouped=True),
    stitching=(),
    levelling=(),
    ranges=False,
    previews=((1024, 512, 30), (1920, 960, 8)),
)
_Z1: Final = replace(
    _V,
    name="Z1",
    model="RICOH THETA Z1",
    serial="10086420",
    prefix="YN",
    firmware="3.50.2",
    camera=replace(THETA_Z1, software="RICOH THETA Z1 Ver 3.50.2"),
    sizes=((3360, 6720),),
    isos=_between(80, 6400, _ISOS),
    apertures=(2.1, 3.5, 5.6),
    programs=(1, 2, 3, 4, 9),
    overhead_s=2.4,
    bracket=BracketRules(
        19, _NEW_KEYS, _ALL_KEYS | {"aperture"}, programs=(1, 2, 3, 4, 9), grouped=True
    ),
    folder="150100525831424d42075b53ce68c300/100RICOH",
    lens_stops=0.0,
)
_X: Final = Personality(
    name="X",
    model="RICOH THETA X",
    serial="14013579",
    prefix="YR",
    firmware="2.80.1",
    camera=THETA_X,
    sizes=((5504, 11008), (2752, 5504)),
    shutters=_X_SHUTTERS,
    isos=_between(50, 3200, _ISOS),
    apertures=(2.4,),
    overhead_s=3.0,
    bracket=BracketRules(
        13,
        frozenset({"exposureProgram"}),
        _ALL_KEYS | {"whiteBalance"},
        method=True,
        grouped=True,
    ),
    previews=((1024, 512, 30), (512, 512, 30), (1920, 960, 30), (3840, 1920, 30)),
    filters=("off", "Noise Reduction", "hdr"),
    stitching=(
        "auto", "none", "static", "dynamic", "dynamicSemiAuto", "dynamicSave", "dynamicLoad",
    ),
    levelling=(*_LEVELLING, "ApplySemiAuto", "Manual"),
    digest=True,
    numeric_ids=True,
    ranges=True,
    lens_stops=0.33,
    metadata="no-size",
)  # fmt: skip
_X_OLD: Final = replace(
    _X,
    name="X-old",
    firmware="2.20.1",
    camera=replace(THETA_X, name="X-old", software="RICOH THETA X Ver 2.20.1"),
    bracket=BracketRules(13, frozenset({"exposureProgram"}), _ALL_KEYS, method=True, grouped=True),
    previews=((1024, 512, 30), (512, 512, 30)),
    numeric_ids=False,
    ranges=False,
)
_A1: Final = replace(
    _X,
    name="A1",
    model="RICOH360 THETA A1",
    manufacturer="Ricoh Company, Ltd.",
    serial="10099887",
    prefix="AA",
    firmware="1.20.0",
    camera=replace(
        THETA_X, name="A1", model="RICOH360 THETA A1", software="RICOH360 THETA A1 Ver 1.20.0"
    ),
    bracket=None,
    overhead_s=3.5,
    previews=((1024, 512, 30), (1024, 512, 10)),
    lens_stops=0.0,
)
_GENERIC: Final = Personality(
    name="generic",
    model="Simulated 360",
    manufacturer="Turnlight",
    serial="1234567",
    firmware="1.0",
    camera=GENERIC,
    sizes=((2048, 4096),),
    shutters=_between(0.000125, 30, _SHUTTERS),
    isos=(100, 200, 400, 800, 1600, 3200),
    apertures=(2.0, 2.8, 4.0, 5.6, 8.0),
    overhead_s=2.0,
    ricoh=False,
    folder="DCIM/100IMITA",
    stem="IMG_",
    filters=(),
    ranges=True,
    snaps=False,
    metadata="none",
)
_INSTA: Final = replace(
    _GENERIC,
    name="insta360",
    model="Insta360 X3",
    manufacturer="Arashi Vision",
    serial="IAHEA2311ABCDE",
    firmware="v1.1.6_build1",
    camera=replace(
        GENERIC,
        name="insta360",
        make="Arashi Vision",
        model="Insta360 X3",
        software="v1.1.6_build1",
        shape=(2944, 5888),
        apertures=(1.9,),
    ),
    sizes=((2944, 5888),),
    shutters=(0.000125, *_between(0.00015625, 60, _SHUTTERS), 120),
    apertures=(1.9,),
    insta=True,
    folder="DCIM/Camera01",
    header="x-xsrf-protected",
    address="192.168.42.1",
)

PERSONALITIES: Final = (
    _S, _SC, _SC2, _V, _V_OLD, _Z1, _X, _X_OLD, _A1, _GENERIC, _INSTA,
)  # fmt: skip
"""All of them."""


def personality_named(name: str) -> Personality:
    """Find a personality by name.

    Parameters
    ----------
    name : str
        "S", "SC", "SC2", "V", "V-old", "Z1", "X", "X-old", "A1", "generic" or "insta360", in any
        case.

    Raises
    ------
    ValueError
        When there is none of that name.

    Examples
    --------
    >>> personality_named("z1").apertures
    (2.1, 3.5, 5.6)
    """
    for personality in PERSONALITIES:
        if personality.name.casefold() == name.strip().casefold():
            return personality
    known = ", ".join(personality.name for personality in PERSONALITIES)
    raise ValueError(f"there is no camera {name!r}; known: {known}")
