"""What to say when a capture goes wrong: what happened, what is safe, what to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.devices.errors import DISK, DeviceError, DownloadFailed, PasswordNeeded, Unreachable
from app.ui.presenters.disk_words import is_full
from app.ui.screens.probe.state import Notice

if TYPE_CHECKING:
    from app.ui.presenters.unfinished import Unfinished

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


def wants_password(error: Exception) -> bool:
    """Whether a user name and a password are what is missing."""
    return isinstance(error, PasswordNeeded)


def trouble_notice(error: Exception, far: HowFar) -> Notice:
    """Say what went wrong with a capture."""
    if _is_full(error):
        return _disk(far)
    if _is_lost(error):
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


def _is_full(error: Exception) -> bool:
    if getattr(error, "code", "") in DISK:
        return True
    return is_full(error)


def _is_lost(error: Exception) -> bool:
    if isinstance(error, DownloadFailed):
        return error.code in _LOST
    return isinstance(error, Unreachable)


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
