"""The models of the simulated camera.

Each row of the camera table describes one model. The metadata (maker, padded model, software) come
from public sample files, and the replies are modelled on public ones. Values that are not
documented (SC2, A1) are guesses. The sensor values are typical of the pixel pitch, since Ricoh
publishes none, and affect only the noise.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from app.core.base.paths import resources
from app.core.camera_catalogue import CAMERAS, CameraFacts, camera_facts, tuples

_PROGRAMS: Final = (1, 2, 4, 9)
_OLD_KEYS: Final = frozenset({"shutterSpeed", "iso", "_colorTemperature"})
_ALL_KEYS: Final = _OLD_KEYS | {"exposureCompensation"}

_STITCHING: Final = ("auto", "static", "dynamicAuto", "dynamicSave", "dynamicLoad", "none")
_LEVELLING: Final = ("ApplyAuto", "Apply", "ApplySave", "ApplyLoad", "Disapply")
_NEW_KEYS: Final = frozenset({"exposureProgram", "whiteBalance"})


@dataclass(frozen=True, slots=True)
class CameraModel:
    """The sensor of a model, and the metadata in its files.

    Attributes:
        shape: Rows and columns of the full-size panorama.
        base_iso: Lowest ISO. It takes `full_well` electrons to saturate a pixel of the panorama at
            this ISO, and half as many at twice the ISO.
        channel_gains: Gains for red, green and blue that produce a neutral picture. They make red
            and blue noisier.
        lens_words: Number of 16-bit words for each lens in maker note tag 0x0101: 2 up to the V, 1
            in the X.
    """

    name: str
    make: str
    model: str
    software: str
    shape: tuple[int, int]
    apertures: tuple[float, ...]
    base_iso: float
    full_well: float
    read_noise: float
    channel_gains: tuple[float, float, float] = (1.8, 1.0, 1.6)
    levels_itself: bool = True
    maker_note: bool = True
    lens_words: int = 2


def _theta(
    name: str, software: str, full_well: float, read_noise: float, pad: int = 16, **more: Any
) -> CameraModel:
    """Return the sensor for a row of the camera table, with the EXIF model name padded to `pad`."""
    facts = camera_facts(name)
    assert facts is not None
    return CameraModel(
        name=name,
        make=more.pop("make", "RICOH"),
        model=facts.model_text.ljust(pad),
        software=software,
        shape=facts.sizes[0],
        apertures=facts.limits.apertures,
        base_iso=facts.limits.isos[0],
        full_well=full_well,
        read_noise=read_noise,
        **more,
    )


THETA_S: Final = _theta(
    "S",
    "RICOH THETA S Ver 1.82".ljust(31),
    6000.0,
    4.0,
    63,
    make="RICOH".ljust(21),
    levels_itself=False,
)
THETA_SC2: Final = _theta("SC2", "RICOH THETA SC2 Ver 01.42", 7500.0, 3.5)
THETA_V: Final = _theta("V", "RICOH THETA V Ver 3.30.1", 7500.0, 3.5)
THETA_Z1: Final = _theta("Z1", "RICOH THETA Z1 Ver 2.10.3", 15000.0, 3.0)
THETA_X: Final = _theta("X", "RICOH THETA X Ver 2.80.1", 5000.0, 2.5, 14, lens_words=1)
GENERIC: Final = CameraModel(
    name="generic",
    make="Turnlight",
    model="Simulated 360",
    software="Simulated 360 1.0",
    shape=(2048, 4096),
    apertures=(2.0, 2.8, 4.0, 5.6, 8.0),
    base_iso=100.0,
    full_well=20000.0,
    read_noise=3.0,
    levels_itself=False,
    maker_note=False,
)
SENSORS: Final = {
    camera.name: camera for camera in (THETA_S, THETA_SC2, THETA_V, THETA_Z1, THETA_X, GENERIC)
}
"""All sensors, keyed by the short name of the model."""
_SPAN_S: Final = (0.000125, 30.0)  # range of exposure times, in seconds, for another make


@dataclass(frozen=True, slots=True)
class BracketRules:
    """The keys in a model's `_autoBracket`, and the behaviour of its own bracket.

    Attributes:
        programs: Exposure programs that are valid for `exposureProgram`.
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
    """A model with one firmware version.

    Attributes:
        api_levels: (1, 2) for models that start with API 2.0 and must be switched.
        sizes: Rows and columns of the photos, starting with the default size.
        previews: Width, height and frames per second of each preview, or an empty tuple if the
            camera reports zeros.
        status_ids: Whether status replies have an id. Ricoh's own examples for API 2.1 have none.
        snaps: Whether automatic exposure times are limited to the list of the manual program.
        lens_stops: Difference between the ISO values of the two lenses in automatic programs, in
            stops.
        overhead_s: Time that a frame takes beyond its exposure, in seconds.
        thumb: Rows and columns of the thumbnails.
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
    address: str = "192.168.1.1"
    thumb: tuple[int, int] = (160, 320)

    @property
    def switches_api(self) -> bool:
        """Whether the camera starts with API 2.0."""
        return 1 in self.api_levels


def _listed(values: Iterable[float]) -> tuple[float, ...]:
    """Return a sorted list as cameras format it, with whole numbers as int."""
    return tuple(int(value) if value == int(value) else value for value in sorted(values))


def _personality(facts: CameraFacts) -> Personality:
    """Return the camera for a row of the camera table."""
    sensor = SENSORS[facts.sensor or facts.name]
    firmware = "1.00.0"
    several = {"aperture"} if len(facts.limits.apertures) > 1 else set()
    rules = BracketRules(facts.max_shots, _OLD_KEYS, grouped=True, watched=facts.watched)
    if not facts.old_bracket:
        rules = replace(rules, required=_NEW_KEYS, optional=_ALL_KEYS | several)
    if facts.by_method:
        keys = frozenset({"exposureProgram"})
        rules = replace(rules, required=keys, optional=_ALL_KEYS | {"whiteBalance"}, method=True)
    return Personality(
        name=facts.name,
        model=facts.model_text,
        serial="10000001",
        prefix=facts.user_prefix,
        firmware=firmware,
        camera=sensor
        if sensor.name == facts.name
        else replace(
            sensor,
            name=facts.name,
            model=facts.model_text,
            software=f"{facts.model_text} Ver {firmware}",
            shape=facts.sizes[0],
        ),
        sizes=facts.sizes,
        shutters=_listed(facts.limits.shutters_s),
        isos=_listed(facts.limits.isos),
        apertures=facts.limits.apertures,
        overhead_s=facts.overhead_s,
        bracket=rules if facts.native_bracket else None,
        api_levels=(1, 2) if facts.switches_api else (2,),
        previews=facts.previews,
        stitching=_STITCHING if facts.stitching else (),
        levelling=_LEVELLING if facts.stitching else (),
        digest=facts.password,
    )


_TABLE: Final = {facts.name: _personality(facts) for facts in CAMERAS}


def _rules(bracket: dict[str, Any]) -> BracketRules | None:
    keys: dict[str, Any] = {name: tuples(value) for name, value in bracket.items()}
    keys |= {key: frozenset(bracket.get(key, ())) for key in ("required", "optional")}
    return BracketRules(**keys)


def read_personalities(file: Path, others: Mapping[str, Personality]) -> dict[str, Personality]:
    """Read cameras from a TOML file in the format of ``simulated.toml``.

    Args:
        others: Cameras that a "like" entry may name, in addition to those in earlier sections.
    """
    read: dict[str, Personality] = {}
    for name, row in tomllib.loads(file.read_text(encoding="utf-8")).items():
        base = (read | dict(others))[row.pop("like")] if "like" in row else _TABLE[name]
        model, *fields = row.pop("table", [name])
        values: dict[str, Any] = {each: getattr(_TABLE[model], each) for each in fields}
        sensor = {field: tuples(value) for field, value in row.pop("camera", {}).items()}
        values["camera"] = replace(SENSORS[base.camera.name], **sensor)
        if "bracket" in row:
            bracket = row.pop("bracket")
            values["bracket"] = _rules(bracket) if bracket else None
        if "more_shutters" in row:
            times = values.get("shutters", base.shutters)
            values["shutters"] = _listed({*times, *row.pop("more_shutters")})
        values |= {field: tuples(value) for field, value in row.items()}
        read[name] = replace(base, name=name, **values)
    return read


def _other_make() -> Personality:
    """Return a camera of another make, with the V's exposure times from 1/8000 s to 30 s."""
    first, last = _SPAN_S
    times = tuple(time for time in _TABLE["V"].shutters if first <= time <= last)
    return Personality("", "", "", "", GENERIC, (), times, (), (), 0.0)


_OWN: Final = read_personalities(resources() / "cameras" / "simulated.toml", {"": _other_make()})
PERSONALITIES: Final = tuple((_OWN | _TABLE | _OWN).values())
"""All personalities."""


def personality_named(
    name: str, personalities: Iterable[Personality] = PERSONALITIES
) -> Personality:
    """Return a camera by name, such as "S", "SC", "Z1" or "generic", ignoring case.

    Raises:
        ValueError: If the name is unknown.

    Examples:
        >>> personality_named("z1").apertures
        (2.1, 3.5, 5.6)
    """
    by_name = {each.name.casefold(): each for each in personalities}
    match = by_name.get(name.strip().casefold())
    if match is None:
        names = ", ".join(each.name for each in by_name.values())
        raise ValueError(f"there is no camera {name!r}; known: {names}")
    return match
