"""What the Probe screen says: lamps, frames, plans, advice, and what went wrong."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal

from app.core.base.angles import wrap
from app.core.base.errors import CoreError, ProbeError
from app.core.hdr.frame import Exposure
from app.core.hdr.planner import Plan, plan
from app.devices.errors import DISK, DeviceError, DownloadFailed, Unreachable
from app.devices.profiles import profile_for
from app.devices.theta.messages import Info
from app.ui.presenters.frame import camera_words, time_words
from app.ui.presenters.saving import is_full
from app.ui.screens.probe.state import FrameTile, LampRow, Notice, PlanPart

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from app.core.hdr.findings import Findings, Lamp
    from app.core.storage.places.place import CaptureFacts, FrameFacts, Place
    from app.ui.presenters.model import CameraSeen
    from app.ui.presenters.unfinished import Unfinished
    from app.ui.screens.probe.state import CameraBlock


_LOST: Final = frozenset({"interrupted", "bad-answers"})
_ORDINALS: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")
_NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
_RESUME: Final = ("resume", "Resume")
_AGAIN: Final = ("again", "Try again")


@dataclass(frozen=True, slots=True)
class HowFar:
    """How far a capture had come."""

    here: int = 0
    total: int = 0
    exposing: bool = False
    resumable: bool = False


def trouble_notice(error: Exception, far: HowFar) -> Notice:
    """Say what went wrong with a capture."""
    if getattr(error, "code", "") in DISK or is_full(error):
        return _disk(far)
    if isinstance(error, Unreachable) or (
        isinstance(error, DownloadFailed) and error.code in _LOST
    ):
        return _lost(error, far)
    if getattr(error, "code", "") == "misfit" and isinstance(error, DeviceError):
        hint = "Something changed during the bracket, or the file is damaged on the camera."
        return Notice("error", error.message, hint, (("resume", "Use all frames"), _AGAIN))
    buttons = (_RESUME, _AGAIN) if far.resumable and far.total else (_AGAIN,)
    if isinstance(error, (DeviceError, CoreError)):
        return Notice("error", error.message, error.hint, buttons)
    return Notice("error", f"Something unexpected went wrong: {error}.", "", buttons)


def offer_notice(found: Unfinished, when: str) -> Notice:
    """Offer to finish a place that was interrupted."""
    here, total = found.here, found.total
    whole = bool(found.files) or (total > 0 and here == total)
    frames = f"{here} of {total} frames are here." if total else "It had only just begun."
    if whole:
        frames = "All frames are here and only have to be merged."
    buttons = [("resume-offer", "Merge them" if whole else "Resume")]
    if 2 <= here < total:
        buttons.append(("merge-offer", f"Merge {_these(here)}"))
    return Notice(
        "offer",
        f"“{found.name}” of {when} is not finished.",
        frames,
        (*buttons, ("leave-offer", "Not now")),
    )


def _disk(far: HowFar) -> Notice:
    body = "Make room, then resume."
    if far.total and far.here < far.total:
        number = far.here + 1
        frames = f"Frame {number} is" if number == far.total else f"Frames {number} to {far.total}"
        verb = "" if number == far.total else " are"
        body = f"{frames}{verb} still on the camera. {body}"
    return Notice(
        "error", "No space left on this disk.", body, (_RESUME if far.resumable else _AGAIN,)
    )


def _lost(error: Exception, far: HowFar) -> Notice:
    here, total = far.here, far.total
    if here and here < total:
        title = f"Camera disconnected after frame {here} of {total}."
        kept = "Both frames are" if here == 2 else f"{_number(here)} frames are"
        kept = "That frame is" if here == 1 else kept
        rest = f"take the {_ordinal(here + 1)}" if here + 1 == total else "take the rest"
        merge = f", or merge {_these(here)}" if here > 1 else ""
        buttons = [("resume", "Resume")]
        if here > 1:
            buttons.append(("merge", f"Merge {_these(here)}"))
        return Notice("error", title, f"{kept} kept. Reconnect and {rest}{merge}.", tuple(buttons))
    if far.exposing and far.resumable:
        return Notice(
            "error",
            "Camera disconnected while taking the frames.",
            "What it took is on the camera. Reconnect, then resume.",
            (_RESUME,),
        )
    hint = getattr(error, "hint", "")
    return Notice(
        "error", getattr(error, "message", str(error)), hint, (_AGAIN, ("search", "Search again"))
    )


def _these(count: int) -> str:
    return f"these {_NUMBERS[count]}" if count < len(_NUMBERS) else f"these {count}"


def _number(count: int) -> str:
    return (_NUMBERS[count] if count < len(_NUMBERS) else str(count)).capitalize()


def _ordinal(number: int) -> str:
    return _ORDINALS[number - 1] if number <= len(_ORDINALS) else f"{number}th"


_USUAL: Final = Exposure(1.0 / 60.0, 100.0, 2.0)
"""Of a bright room: what is planned with before anything was metered."""

_LIKELY: Final = tuple(Exposure(1.0 / part, 100.0, 2.0) for part in (1000, 250, 60, 15, 4))
"""From a place in the sun to a dim room."""

_MOST: Final = 0.5
_TITLES: Final[dict[str, str]] = {"paper": "Paper", "full": "Full range"}
_NAMES: Final = {"sun": "Sun", "lamp": "Lamp", "window": "Window", "bright area": "Bright area"}
_NO_DOUBT: Final = "No style's turn depends"
_LOOPBACK: Final = ("127.", "localhost", "::1")


def where_words(azimuth_deg: float, elevation_deg: float) -> str:
    """Say where a light is, seen by a sitter who faces azimuth 0; each side is named twice.

    Args:
        azimuth_deg, elevation_deg: Counted from where the photographer stands, positive clockwise;
            deg.

    Examples:
        >>> where_words(3.0, 40.0), where_words(-140.0, 0.0)
        ('in front, high', 'behind, sitter’s left (camera right)')
    """
    if abs(elevation_deg) >= 70.0:
        return "overhead" if elevation_deg > 0 else "underfoot"
    azimuth = wrap(azimuth_deg)
    side = "sitter’s right (camera left)" if azimuth > 0 else "sitter’s left (camera right)"
    away = abs(azimuth)
    words = side
    if away <= 25.0 or away >= 155.0:
        words = "in front" if away <= 25.0 else "behind"
    elif not 65.0 <= away <= 115.0:
        words = f"{'in front' if away < 90.0 else 'behind'}, {side}"
    if elevation_deg >= 30.0:
        return f"{words}, high"
    return f"{words}, low" if elevation_deg <= -20.0 else words


def lamp_rows(findings: Findings, front_deg: float) -> tuple[LampRow, ...]:
    """Write the table of lamps."""
    return tuple(_lamp_row(lamp, front_deg) for lamp in findings.lamps)


def share_words(share: float, clipped: bool) -> str:
    """Say how much of the light a lamp gives: "at least 64 %", "3 %", "0.4 %"."""
    percent = 100.0 * share
    # A lower bound is never rounded up.
    number = f"{percent:.0f}" if percent >= 0.95 else f"{max(percent, 0.1):.1f}"
    if clipped:
        number = str(int(percent + 1e-9)) if percent >= 1.0 else f"{int(10.0 * percent) / 10.0:g}"
    return f"at least {number} %" if clipped else f"{number} %"


def _lamp_row(lamp: Lamp, front_deg: float) -> LampRow:
    azimuth = wrap(lamp.azimuth_deg - front_deg)
    name, where = _NAMES.get(lamp.kind, lamp.kind), where_words(azimuth, lamp.elevation_deg)
    degrees = _degrees(azimuth)
    up = round(lamp.elevation_deg)
    height = "level" if up == 0 else f"{abs(up)}° {'up' if up > 0 else 'down'}"
    share = share_words(lamp.share, lamp.clipped)
    spoken = f"{lamp.letter}, {name}, {where}, azimuth {degrees}, elevation {height}, share {share}"
    return LampRow(
        letter=lamp.letter,
        name=name,
        where=where,
        azimuth=degrees,
        elevation=height,
        share=share,
        clipped=lamp.clipped,
        azimuth_deg=lamp.azimuth_deg,
        elevation_deg=lamp.elevation_deg,
        spoken=f"{spoken}, clipped" if lamp.clipped else spoken,
    )


def _degrees(angle: float) -> str:
    whole = round(angle)
    return f"−{-whole}°" if whole < 0 else f"{whole}°"


# -- frames --------------------------------------------------------------------------------------


def ev_words(stops: float) -> str:
    """Write an exposure: "+2 EV", "−1.7 EV", "0 EV"."""
    tenths = round(10.0 * stops) / 10.0
    number = f"{abs(tenths):.1f}".removesuffix(".0")
    sign = "" if tenths == 0.0 else "+" if tenths > 0.0 else "−"
    return f"{sign}{number} EV"


def shutter_words(seconds: float) -> str:
    """Write an exposure time: "1/250 s", "0.6 s", "2 s"."""
    return f"1/{round(1.0 / seconds)} s" if 0.0 < seconds < 0.3 else f"{seconds:g} s"


def _clip_words(share: float) -> str:
    percent = 100.0 * share
    if percent <= 0.0:
        return "nothing clipped"
    if percent < 0.1:
        return "under 0.1 % clipped"
    return f"{percent:.1f} % clipped" if percent < 9.95 else f"{round(percent)} % clipped"


def frame_tile(facts: FrameFacts, picture: object = None) -> FrameTile:
    """Describe a frame that was merged.

    Args:
        picture: (h, 2 h, 3) uint8 or None. SRGB.
    """
    return tile_of(facts.ev, facts.shutter_s, facts.clipped_share, picture)


def tile_of(
    ev: float, shutter_s: float, clipped: float | None, picture: object = None, arrived: float = 1.0
) -> FrameTile:
    """Describe an exposure; `clipped` is None where it is not known yet."""
    words = (
        ev_words(ev),
        shutter_words(shutter_s),
        "" if clipped is None else _clip_words(clipped),
    )
    return FrameTile(
        *words,
        picture=picture,  # type: ignore[arg-type]
        arrived=arrived,
        spoken=", ".join(part for part in words if part),
    )


def frames_note(place: Place, today: datetime) -> str:
    """Say how the frames were taken: "ISO 100, f/2, taken 14:05"."""
    capture = place.capture
    if capture is None or not capture.frames:
        return ""
    isos = {frame.iso for frame in capture.frames}
    apertures = {frame.aperture for frame in capture.frames}
    parts = [f"ISO {iso:g}" for iso in isos if len(isos) == 1 and iso > 0]
    parts += [f"f/{stop:g}" for stop in apertures if len(apertures) == 1 and stop > 0]
    if place.measured_at is not None and capture.plan in _TITLES:
        parts.append(f"taken {time_words(place.measured_at, today).rpartition(' ')[2]}")
    return ", ".join(parts)


# -- plans ---------------------------------------------------------------------------------------


def plan_parts(camera: CameraSeen | None, metered: Exposure | None) -> tuple[PlanPart, ...]:
    """Say how many frames and seconds each plan takes."""
    model = camera.found.model if camera is not None else ""
    parts = []
    for kind in ("paper", "full"):
        # How many the light asks for is known once it is metered; before, how many at most.
        unsure = metered is None and kind == "full"
        made = [
            one
            for light in (_LIKELY if unsure else (metered or _USUAL,))
            if (one := _estimate(model, light, kind)) is not None
        ]
        words = ""
        if made:
            count = max(len(one.shots) for one in made)
            seconds = round(max(one.expected_s for one in made))
            words = f"{'up to ' if unsure else ''}{count} frames, {seconds} s"
        parts.append(PlanPart(kind, _TITLES[kind], words))
    return tuple(parts)


@lru_cache(maxsize=32)
def _estimate(model: str, metered: Exposure, kind: Literal["paper", "full"]) -> Plan | None:
    profile = profile_for(Info(model))
    try:
        return plan(
            metered,
            profile.fallback,
            kind,
            profile.max_shots,
            overhead_s=profile.overhead_s,
        )
    except ProbeError:
        return None


def metered_of(capture: CaptureFacts | None) -> Exposure | None:
    """Return what was metered at a place, from its frames; None where they do not tell."""
    for frame in () if capture is None else capture.frames:
        if abs(frame.ev) < 0.1 and frame.iso > 0 and frame.aperture > 0 and frame.shutter_s > 0:
            return Exposure(frame.shutter_s, frame.iso, frame.aperture)
    return None


# -- camera --------------------------------------------------------------------------------------


def is_loopback(host: str) -> bool:
    """Whether an address is this computer's own."""
    return host.startswith(_LOOPBACK)


def camera_second(camera: CameraSeen) -> str:
    """Say how the camera is: "Wi-Fi, battery 82 %, 1.9 GB free"."""
    # Every such camera speaks over Wi-Fi, its own or somebody's; a simulated one does not.
    parts = ["Local" if is_loopback(camera.found.endpoint.host) else "Wi-Fi"]
    if camera.battery is not None:
        parts.append(f"battery {round(100 * camera.battery)} %")
    # The space is the last of what the head line says as well.
    said = camera_words(camera).split(", ")
    parts += [part for part in said if part.endswith("free")]
    return ", ".join(parts)


# -- advice --------------------------------------------------------------------------------------


def advice_notice(
    place: Place | None, findings: Findings | None, full: PlanPart | None, camera: CameraBlock
) -> Notice | None:
    """Say what could be better about a capture, and offer what is possible."""
    capture = None if place is None else place.capture
    if capture is None or findings is None:
        return None
    if findings.clipped_lamps and capture.frames:
        return _clipped_notice(capture, findings.clipped_lamps[0], full, camera)
    if capture.warnings:
        return Notice("advice", capture.warnings[0], _some(capture.warnings[1:]))
    return None


def _clipped_notice(
    capture: CaptureFacts, lamp: Lamp, full: PlanPart | None, camera: CameraBlock
) -> Notice:
    where = ev_words(min(frame.ev for frame in capture.frames))
    if lamp.kind == "sun":
        put_back = next((note for note in capture.notes if "sun" in note.lower()), "")
        return Notice(
            "note",
            "No camera holds the sun: it is clipped in every frame.",
            put_back or "Shadows may be deeper than the pictures show.",
        )
    share = f"{share_words(lamp.share, lamp.clipped)} of the light here"
    share = "most of the light here" if lamp.share >= _MOST else share
    harmless = any(line.startswith(_NO_DOUBT) for line in capture.advice)
    verdict = (
        "but no style's turn depends on it."
        if harmless
        else "so turns may be a few degrees off."
        if lamp.share >= 0.05
        else "and may be brighter than it looks."
    )
    # Number and unit stay on one line.
    where = where.replace(" ", "\N{NO-BREAK SPACE}")
    title = f"The {lamp.kind} ({lamp.letter}) is still clipped at {where}."
    body = f"It gives {share}, {verdict}"
    if capture.plan != "paper" or full is None:
        return Notice("note" if harmless else "advice", title, body)
    mends = f"The full range ({full.second}) mends that. Keep the camera where it is."
    if camera.missing:
        return Notice("advice", title, f"{body} {mends}")
    button = (("capture-full", "Capture the full range"),)
    return Notice("advice", title, f"{body} {mends}", button)


def _some(sentences: Sequence[str]) -> str:
    kept = list(sentences[:2])
    more = len(sentences) - len(kept)
    return " ".join([*kept, *([f"{more} more in the messages."] if more > 0 else [])])
