"""What the Probe screen says: lamps, frames, plans, advice, and what went wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from functools import lru_cache
from typing import Final, Literal

from app.core.base.angles import wrap
from app.core.base.atomic_files import is_full
from app.core.base.errors import CoreError, ProbeError
from app.core.base.phrases import percent, shutter_words
from app.core.measure.finish.findings import Findings, LampFinding
from app.core.measure.finish.remarks import ClippingSafe, RoughTurns, SunRestored
from app.core.measure.plan.planner import Plan, plan
from app.core.measure.read.frame import Exposure
from app.core.places.place import CaptureFacts, Place
from app.core.places.resume import UnfinishedPlace
from app.core.text import tr, tr_plural
from app.devices.capture.status import Stage, Status
from app.devices.client_profiles import profile_for
from app.devices.errors import DISK, DeviceError, DownloadFailed, Unreachable
from app.devices.theta.messages import Info
from app.ui.presenters.model import CameraSeen
from app.ui.screens.probe.state import (
    CameraBlock,
    ChoiceRow,
    DistantSign,
    FrameTile,
    LampRow,
    Notice,
    Tone,
)
from app.words.lights import NAMES, STILL_CLIPPED, share_words
from app.words.phrases.directions import direction_words, elevation_words
from app.words.phrases.quantities import ev_words
from app.words.phrases.turns import signed
from app.words.progress import progress_words
from app.words.remarks import remark_words, sentences

_LOST_CODES: Final = frozenset({"interrupted", "bad-answers"})
_ORDINALS: Final = (
    *(tr("first"), tr("second"), tr("third"), tr("fourth")),
    *(tr("fifth"), tr("sixth"), tr("seventh"), tr("eighth")),
)
_NUMBERS: Final = (
    *(tr("no"), tr("one"), tr("two"), tr("three"), tr("four")),
    *(tr("five"), tr("six"), tr("seven"), tr("eight"), tr("nine")),
)
# Keyed by whether only one frame is here, and whether only one is missing.
_RECONNECT: Final = {
    (True, True): tr("Reconnect and take the {ordinal}."),
    (True, False): tr("Reconnect and take the rest."),
    (False, True): tr("Reconnect and take the {ordinal}, or merge these {number}."),
    (False, False): tr("Reconnect and take the rest, or merge these {number}."),
}
_COUNT_ALOUD: Final = 3  # the last seconds are counted down aloud
_RESUME: Final = ("resume", tr("Resume"))
_AGAIN: Final = ("again", tr("Try again"))


_KNEEL: Final = tr("Kneel now")
_MOVE: Final = tr("You may move")
_BEFORE: Final = (Stage.IDLE, Stage.CONNECTING)
_SHOOTING: Final = (Stage.METERING, Stage.EXPOSING)


def sign_of(status: Status, count: int, delay_s: int) -> DistantSign:
    """Say what is seen from three metres; `count`: seconds that the self-timer has still to go."""
    message, early = _timed(progress_words(status.message), status), status.stage in _BEFORE
    if not early and (status.may_move or status.stage not in _SHOOTING):
        return DistantSign("move", _MOVE, message, spoken=_MOVE)
    if status.seeking:
        return DistantSign(big=tr("Stay there"), caption=message)
    if early:
        return DistantSign(caption=message)
    if count:
        # The seconds stand in large type already.
        spoken = _NUMBERS[count] if count <= _COUNT_ALOUD else _KNEEL
        return DistantSign("act", str(count), _KNEEL, spoken=spoken)
    if status.shot:
        frame = tr("Frame {shot} of {shots}", shot=status.shot, shots=status.shots)
        stay = _timed(tr("Stay down"), status)
        return DistantSign("act", frame, stay, (status.shot - 1) / status.shots, frame)
    if delay_s:
        return DistantSign(caption=message)
    return DistantSign("act", _KNEEL, message, spoken=_KNEEL)


def _timed(message: str, status: Status) -> str:
    remaining = status.left_words
    return tr("{message}: {left}", message=message, left=remaining) if remaining else message


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
        isinstance(error, DownloadFailed) and error.code in _LOST_CODES
    ):
        return _lost_notice(error, far)
    buttons = (_RESUME, _AGAIN) if far.resumable and far.total else (_AGAIN,)
    if isinstance(error, (DeviceError, CoreError)):
        return Notice("error", error.message, error.hint, buttons)
    return Notice(
        "error", tr("Something unexpected went wrong: {error}.", error=error), "", buttons
    )


def offer_notice(offer: UnfinishedPlace, when: str) -> Notice:
    """Offer to finish a place that was interrupted."""
    here, total = offer.here, offer.total
    whole = bool(offer.files) or (total > 0 and here == total)
    frames = tr("It had only just begun.")
    if whole:
        frames = tr("All frames are here and only have to be merged.")
    elif total:
        frames = tr("{here} of {total} frames are here.", here=here, total=total)
    buttons = [("resume-offer", tr("Merge them") if whole else tr("Resume"))]
    if 2 <= here < total:
        buttons.append(("merge-offer", tr("Merge these {number}", number=_number(here))))
    return Notice(
        "offer",
        tr("“{name}” of {when} is not finished.", name=offer.name, when=when),
        frames,
        (*buttons, ("leave-offer", tr("Not now"))),
    )


def _disk(far: HowFar) -> Notice:
    body = tr("Make room, then resume.")
    if far.total and far.here < far.total:
        rest_words = tr_plural(
            "Frame {last} is still on the camera.",
            "Frames {first} to {last} are still on the camera.",
            far.total - far.here,
            first=far.here + 1,
            last=far.total,
        )
        body = f"{rest_words} {body}"
    return Notice(
        "error", tr("No space left on this disk."), body, (_RESUME if far.resumable else _AGAIN,)
    )


def _lost_notice(error: Exception, far: HowFar) -> Notice:
    here, total = far.here, far.total
    if here and here < total:
        title = tr("Camera disconnected after frame {here} of {total}.", here=here, total=total)
        values = {"number": _number(here), "ordinal": _ordinal(here + 1)}
        kept_words = {1: tr("That frame is kept."), 2: tr("Both frames are kept.")}
        body = " ".join(
            (
                kept_words.get(here) or tr("The first {number} frames are kept.", **values),
                _RECONNECT[here == 1, here + 1 == total].format(**values),
            )
        )
        merge = (("merge", tr("Merge these {number}", **values)),) if here > 1 else ()
        return Notice("error", title, body, (_RESUME, *merge))
    if far.exposing and far.resumable:
        return Notice(
            "error",
            tr("Camera disconnected while taking the frames."),
            tr("What it took is on the camera. Reconnect, then resume."),
            (_RESUME,),
        )
    return Notice(
        "error",
        getattr(error, "message", str(error)),
        getattr(error, "hint", ""),
        (_AGAIN, ("search", tr("Search again"))),
    )


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _ordinal(number: int) -> str:
    return _ORDINALS[number - 1] if number <= len(_ORDINALS) else tr("{number}th", number=number)


_USUAL: Final = Exposure(1.0 / 60.0, 100.0, 2.0)
"""Of a bright room: what is planned with before anything was metered."""

_LIKELY: Final = tuple(Exposure(1.0 / part, 100.0, 2.0) for part in (1000, 250, 60, 15, 4))
"""From a place in the sun to a dim room."""

_MOST: Final = 0.5
_TITLES: Final[dict[str, str]] = {"paper": tr("Quick"), "full": tr("Full range")}
_LOOPBACK: Final = ("127.", "localhost", "::1")


def lamp_rows(findings: Findings, front_deg: float, *, rough: bool = False) -> tuple[LampRow, ...]:
    """Write the table of lamps; at a `rough` place what is clipped is a guess."""
    return tuple(_lamp_row(lamp, front_deg, rough) for lamp in findings.lamps)


def _lamp_row(lamp: LampFinding, front_deg: float, rough: bool) -> LampRow:
    azimuth = wrap(lamp.azimuth_deg - front_deg)
    share = share_words(lamp.share, lamp.clipped and not rough)
    words = {
        "letter": lamp.letter,
        "name": NAMES[lamp.kind],
        "where": direction_words(azimuth, lamp.elevation_deg, of_sitter=True),
        "azimuth": signed(azimuth),
        "elevation": elevation_words(lamp.elevation_deg),
        "share": tr("perhaps {share}", share=share) if rough and lamp.clipped else share,
    }
    spoken = tr(
        "{letter}, {name}, {where}, azimuth {azimuth}, elevation {elevation}, share {share}",
        **words,
    )
    return LampRow(
        **words,
        clipped=lamp.clipped,
        azimuth_deg=lamp.azimuth_deg,
        elevation_deg=lamp.elevation_deg,
        spoken=tr("{spoken}, clipped", spoken=spoken) if lamp.clipped else spoken,
    )


# -- frames --------------------------------------------------------------------------------------


def _clip_words(share: float) -> tuple[str, str]:
    """Say how much of a frame is clipped, in full and as a narrow tile has room for."""
    if share <= 0.0:
        return tr("nothing clipped"), tr("nothing")
    of_hundred = 100.0 * share
    number = f"{of_hundred:.1f} %" if of_hundred < 9.95 else f"{round(of_hundred)} %"
    brief = tr("under 0.1 %") if of_hundred < 0.1 else number
    return tr("{share} clipped", share=brief), brief


def tile_of(
    ev: float, shutter_s: float, clipped: float | None, picture: object = None, arrived: float = 1.0
) -> FrameTile:
    """Describe an exposure; `clipped` is None where it is not known yet."""
    words = ev_words(ev), shutter_words(shutter_s) if shutter_s else ""
    clip, brief = ("", "") if clipped is None else _clip_words(clipped)
    return FrameTile(
        *words,
        clipped=clip,
        clipped_brief=brief,
        picture=picture,  # type: ignore[arg-type]
        arrived=arrived,
        spoken=", ".join(part for part in (*words, clip) if part),
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
        moment = place.measured_at.astimezone(today.tzinfo)
        parts.append(tr("taken {time}", time=f"{moment:%H:%M}"))
    return ", ".join(parts)


# -- plans ---------------------------------------------------------------------------------------


def plan_parts(camera: CameraSeen | None, auto_exposure: Exposure | None) -> tuple[ChoiceRow, ...]:
    """Say how many frames and seconds each plan takes."""
    model = camera.device.model if camera is not None else ""
    parts = []
    for kind in ("paper", "full"):
        # How many the light asks for is known once it is metered; before, how many at most.
        unsure = auto_exposure is None and kind == "full"
        plans = [
            one
            for light in (_LIKELY if unsure else (auto_exposure or _USUAL,))
            if (one := _estimate(model, light, kind)) is not None
        ]
        words = ""
        if plans:
            count = max(len(one.shots) for one in plans)
            values = {"count": count, "seconds": round(max(one.expected_s for one in plans))}
            words = (
                tr("up to {count} frames, {seconds} s", **values)
                if unsure
                else tr("{count} frames, {seconds} s", **values)
            )
        parts.append(ChoiceRow(kind, _TITLES[kind], words))
    return tuple(parts)


@lru_cache(maxsize=32)
def _estimate(model: str, auto_exposure: Exposure, kind: Literal["paper", "full"]) -> Plan | None:
    profile = profile_for(Info(model))
    try:
        return plan(
            auto_exposure,
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


def camera_second(camera: CameraSeen, *, short: bool = False) -> str:
    """Say how the camera is: "Wi-Fi, battery 82 %, 1.9 GB free", or "82 %, 1.9 GB free"."""
    parts = []
    if not short:
        # Every such camera speaks over Wi-Fi, its own or somebody's; a simulated one does not.
        parts.append(tr("Local") if is_loopback(camera.device.endpoint.host) else tr("Wi-Fi"))
    if camera.battery is not None:
        charge = percent(camera.battery)
        parts.append(charge if short else tr("battery {charge}", charge=charge))
    if camera.free_bytes is not None:
        parts.append(tr("{size} GB free", size=f"{camera.free_bytes / 1e9:.1f}"))
    return ", ".join(parts)


# -- advice --------------------------------------------------------------------------------------


def advice_notice(
    place: Place | None, findings: Findings | None, full: ChoiceRow | None, camera: CameraBlock
) -> Notice | None:
    """Say what could be better about a capture, and offer what is possible."""
    capture = None if place is None else place.capture
    if capture is None or findings is None:
        return None
    if capture.plan == "rough":
        advice = [each for each in capture.advice if not isinstance(each, RoughTurns)]
        title, *body = sentences(advice) or (tr("A rough answer: one photograph."),)
        if capture.doubtful:
            body.append(tr("The cards of the styles say which turns depend on that."))
        return Notice("advice", title, " ".join((*sentences(capture.warnings), *body)))
    # How finely a ball resolves, and what it does not show.
    notes = capture.notes if capture.plan == "ball" else ()
    if findings.clipped_lamps and capture.frames:
        notice = _clipped_notice(capture, findings.clipped_lamps[0], full, camera)
        # What was done to the sun is in it already.
        more = sentences(note for note in notes if not isinstance(note, SunRestored))
        return replace(notice, body=" ".join((notice.body, *more)))
    words = sentences((*capture.warnings, *notes))
    if words and (capture.doubtful or capture.doubtful_unseen):
        words = (*words, tr("The style cards show which answers depend on that."))
    tone: Tone = "advice" if capture.warnings else "note"
    return Notice(tone, words[0], " ".join(words[1:])) if words else None


def _clipped_notice(
    capture: CaptureFacts, lamp: LampFinding, full: ChoiceRow | None, camera: CameraBlock
) -> Notice:
    where = ev_words(min(frame.ev for frame in capture.frames))
    if lamp.kind == "sun":
        restored = next((note for note in capture.notes if isinstance(note, SunRestored)), None)
        return Notice(
            "note",
            tr("No camera holds the sun: it is clipped in every frame."),
            tr("Shadows may be deeper than the pictures show.")
            if restored is None
            else remark_words(restored),
        )
    share = tr("most") if lamp.share >= _MOST else share_words(lamp.share, lamp.clipped)
    harmless = any(isinstance(each, ClippingSafe) and each.every for each in capture.advice)
    body = (
        tr("It gives {share} of the light here, but no style's turn depends on it.", share=share)
        if harmless
        else tr(
            "It gives {share} of the light here, so turns may be a few degrees off.", share=share
        )
        if lamp.share >= 0.05
        else tr(
            "It gives {share} of the light here, and may be brighter than it looks.", share=share
        )
    )
    # Number and unit stay on one line.
    where = where.replace(" ", "\N{NO-BREAK SPACE}")
    title = STILL_CLIPPED[lamp.kind].format(letter=lamp.letter, where=where)
    if capture.plan != "paper" or full is None:
        return Notice("note" if harmless else "advice", title, body)
    fix = tr(
        "The full range ({second}) fixes this. Keep the camera where it is.", second=full.second
    )
    if camera.missing:
        return Notice("advice", title, f"{body} {fix}")
    button = (("capture-full", tr("Capture the full range")),)
    return Notice("advice", title, f"{body} {fix}", button)
