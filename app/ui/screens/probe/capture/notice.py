"""The notice in the right-hand column about errors, advice or captures that can be resumed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

from app.core.base.atomic_files import is_full
from app.core.base.errors import CoreError
from app.core.measure.finish.findings import Findings, LampFinding
from app.core.measure.finish.remarks import ClippingSafe, RoughTurns, SunRestored
from app.core.places.place import CaptureFacts, Place
from app.core.places.resume import UnfinishedPlace
from app.core.text import tr, tr_plural
from app.devices.errors import DISK, DeviceError, DownloadFailed, Unreachable
from app.ui.screens.probe.capture.camera import CameraBlock
from app.ui.screens.probe.capture.checklist import ChoiceRow
from app.words.lights import STILL_CLIPPED, share_words
from app.words.measure.doubts import notice_lines
from app.words.phrases.quantities import ev_words
from app.words.remarks import remark_words, sentences

Tone: TypeAlias = Literal["advice", "error", "offer", "note"]


@dataclass(frozen=True, slots=True)
class Notice:
    """A message in the right-hand column, with buttons.

    Attributes:
        buttons: For each button, the key to pass to `ProbePresenter.press` and the label.
    """

    tone: Tone
    title: str
    body: str = ""
    buttons: tuple[tuple[str, str], ...] = ()


CARDS_SHOW_TURNS: Final = tr("The style cards show which turns are affected.")
CARDS_SHOW_ANSWERS: Final = tr("The style cards show which answers are affected.")
DISK_FULL: Final = tr("No space left on this disk.")
DISCONNECTED: Final = tr("Camera disconnected after frame {here} of {total}.")
FRAMES_SAVED: Final = {1: tr("That frame is saved."), 2: tr("Both frames are saved.")}
_LOST_CODES: Final = frozenset({"interrupted", "bad-answers"})

_ORDINALS: Final = (
    *(tr("first"), tr("second"), tr("third"), tr("fourth")),
    *(tr("fifth"), tr("sixth"), tr("seventh"), tr("eighth")),
)

NUMBERS: Final = (
    *(tr("no"), tr("one"), tr("two"), tr("three"), tr("four")),
    *(tr("five"), tr("six"), tr("seven"), tr("eight"), tr("nine")),
)

# Keys: whether only one frame was taken, and whether only one is missing.
_RECONNECT: Final = {
    (True, True): tr("Reconnect and take the {ordinal}."),
    (True, False): tr("Reconnect and take the rest."),
    (False, True): tr("Reconnect and take the {ordinal}, or merge these {number}."),
    (False, False): tr("Reconnect and take the rest, or merge these {number}."),
}

_RESUME: Final = ("resume", tr("Resume"))

_AGAIN: Final = ("again", tr("Try again"))


@dataclass(frozen=True, slots=True)
class HowFar:
    """The progress made by a failed capture."""

    here: int = 0
    total: int = 0
    exposing: bool = False
    resumable: bool = False


def trouble_notice(error: Exception, far: HowFar) -> Notice:
    """Build the notice for a failed capture."""
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
    """Build the notice that offers to finish measuring a place after an interrupted capture."""
    here, total = offer.here, offer.total
    whole = bool(offer.files) or (total > 0 and here == total)
    frames = tr("The capture stopped before the first frame.")
    if whole:
        frames = tr("All frames are saved and only need to be merged.")
    elif total:
        frames = tr("{here} of {total} frames are saved.", here=here, total=total)
    buttons = [("resume-offer", tr("Merge them") if whole else tr("Resume"))]
    if 2 <= here < total:
        buttons.append(("merge-offer", tr("Merge these {number}", number=_number(here))))
    return Notice(
        "offer",
        tr("“{name}” from {when} is not finished.", name=offer.name, when=when),
        frames,
        (*buttons, ("leave-offer", tr("Not now"))),
    )


def _disk(far: HowFar) -> Notice:
    body = tr("Free some space, then resume.")
    if far.total and far.here < far.total:
        rest_words = tr_plural(
            "Frame {last} is still on the camera.",
            "Frames {first} to {last} are still on the camera.",
            far.total - far.here,
            first=far.here + 1,
            last=far.total,
        )
        body = f"{rest_words} {body}"
    return Notice("error", DISK_FULL, body, (_RESUME if far.resumable else _AGAIN,))


def _lost_notice(error: Exception, far: HowFar) -> Notice:
    here, total = far.here, far.total
    if here and here < total:
        title = DISCONNECTED.format(here=here, total=total)
        values = {"number": _number(here), "ordinal": _ordinal(here + 1)}
        body = " ".join(
            (
                FRAMES_SAVED.get(here) or tr("The first {number} frames are saved.", **values),
                _RECONNECT[here == 1, here + 1 == total].format(**values),
            )
        )
        merge = (("merge", tr("Merge these {number}", **values)),) if here > 1 else ()
        return Notice("error", title, body, (_RESUME, *merge))
    if far.exposing and far.resumable:
        return Notice(
            "error",
            tr("Camera disconnected while taking the frames."),
            tr("The frames are on the camera. Reconnect, then resume."),
            (_RESUME,),
        )
    return Notice(
        "error",
        getattr(error, "message", str(error)),
        getattr(error, "hint", ""),
        (_AGAIN, ("search", tr("Search again"))),
    )


def _number(count: int) -> str:
    return NUMBERS[count] if count < len(NUMBERS) else str(count)


def _ordinal(number: int) -> str:
    return _ORDINALS[number - 1] if number <= len(_ORDINALS) else tr("{number}th", number=number)


_MOST: Final = 0.5


def advice_notice(
    place: Place | None, findings: Findings | None, full: ChoiceRow | None, camera: CameraBlock
) -> Notice | None:
    """Build the notice with advice about a capture, or return None if there is no advice."""
    capture = None if place is None else place.capture
    if capture is None or findings is None:
        return None
    if capture.plan == "rough":
        advice = [each for each in capture.advice if not isinstance(each, RoughTurns)]
        title, *body = sentences(advice) or (tr("A rough answer from a single photo."),)
        body += notice_lines(capture.cautions)
        if any(each.styles != () for each in capture.cautions):
            body.append(CARDS_SHOW_TURNS)
        return Notice("advice", title, " ".join((*sentences(capture.warnings), *body)))
    # the resolution of a mirror ball, and the directions it does not cover
    notes = capture.notes if capture.plan == "ball" else ()
    cautions = notice_lines(capture.cautions)
    if findings.clipped_lamps and capture.frames:
        notice = _clipped_notice(capture, findings.clipped_lamps[0], full, camera)
        # The notice about clipping already covers the sun.
        more = (*sentences(note for note in notes if not isinstance(note, SunRestored)), *cautions)
        return replace(notice, body=" ".join((notice.body, *more)))
    words = (*cautions, *sentences((*capture.warnings, *notes)))
    if words and any(each.styles != () for each in capture.cautions):
        words = (*words, CARDS_SHOW_ANSWERS)
    tone: Tone = "advice" if capture.warnings or cautions else "note"
    return Notice(tone, words[0], " ".join(words[1:])) if words else None


def _clipped_notice(
    capture: CaptureFacts, lamp: LampFinding, full: ChoiceRow | None, camera: CameraBlock
) -> Notice:
    where = ev_words(min(frame.ev for frame in capture.frames))
    if lamp.kind == "sun":
        restored = next((note for note in capture.notes if isinstance(note, SunRestored)), None)
        return Notice(
            "note",
            tr("The sun is too bright for any camera: it is clipped in every frame."),
            tr("Shadows may be deeper than the pictures show.")
            if restored is None
            else remark_words(restored),
        )
    share = tr("most") if lamp.share >= _MOST else share_words(lamp.share, lamp.clipped)
    harmless = any(isinstance(each, ClippingSafe) and each.every for each in capture.advice)
    body = (
        tr("It provides {share} of the light here, but no style's turn depends on it.", share=share)
        if harmless
        else tr(
            "It provides {share} of the light here, so turns may be a few degrees off.",
            share=share,
        )
        if lamp.share >= 0.05
        else tr(
            "It provides {share} of the light here and may be brighter than it looks.", share=share
        )
    )
    # Keep the number and its unit on the same line.
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
