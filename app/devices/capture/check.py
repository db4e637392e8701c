"""Whether the files are the bracket that was planned, by their own EXIF.

Cameras do not always do what they were told, and say nothing: some take three equal exposures,
some ignore ISO outside the manual program. What `app.core.hdr` says of a bracket by itself
(lenses that were exposed differently, copies) is not said here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from app.core.base.errors import ProbeError
from app.core.hdr.frame import listed
from app.core.hdr.metadata import Header, read_header
from app.devices.errors import CaptureFailed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.core.hdr.frame import Exposure
    from app.core.hdr.planner import Plan

_EQUAL_STOPS: Final = 0.05
_SAME_STOPS: Final = 1.0 / 6.0
_NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def check_frames(paths: Sequence[Path], plan: Plan) -> tuple[str, ...]:
    """Compare the frames with the plan.

    Returns
    -------
    tuple[str, ...]
        Sentences for the user about frames that were taken differently; their true values count.

    Raises
    ------
    CaptureFailed
        When they are no bracket: equal exposures, or compressed in the camera. The files stay.
    """
    headers = [_header(path) for path in dict.fromkeys(paths)]
    _check_tone(headers)
    _check_different(headers)
    return tuple(_differences(headers, plan))


def planned_times(paths: Sequence[Path], plan: Plan) -> tuple[float, ...] | None:
    """Exposure times of the plan, where files state none and each shot has its file.

    Returns
    -------
    tuple[float, ...] or None
        In seconds, in the order of `paths`; None where EXIF is to be used.
    """
    headers = [_header(path) for path in paths]
    silent = all(header.shutter_s is None for header in headers)
    if not silent or len(headers) != len(plan.shots):
        return None
    return tuple(shot.exposure.shutter_s for shot in plan.shots)


def _header(path: Path) -> Header:
    try:
        return read_header(path)
    except ProbeError as error:
        raise CaptureFailed(error.message, error.hint, "bad-frame") from error


def _check_tone(headers: Sequence[Header]) -> None:
    mapped = [header.frame.path.name for header in headers if header.frame.tone_mapped]
    if mapped:
        verb = "was" if len(mapped) == 1 else "were"
        raise CaptureFailed(
            f"{listed(mapped)} {verb} taken with HDR rendering or range compensation on, which"
            " changes every pixel in its own way.",
            "Switch the filter off on the camera and shoot again. The files were kept.",
            "tone-mapped",
        )


def _check_different(headers: Sequence[Header]) -> None:
    stops = [header.frame.exposure.ev for header in headers if header.frame.exposure]
    if len(stops) < 2 or max(stops) - min(stops) > _EQUAL_STOPS:
        return
    number = _NUMBERS[len(stops)] if len(stops) < len(_NUMBERS) else str(len(stops))
    raise CaptureFailed(
        f"The camera took {number} equal exposures instead of a bracket.",
        "Switch it off and on, close other apps that use it, and shoot again. The files were kept.",
        "equal-exposures",
    )


def _differences(headers: Sequence[Header], plan: Plan) -> list[str]:
    """Name frames that match no shot of the plan."""
    left = [shot.exposure for shot in plan.shots]
    strange: list[Header] = []
    for header in headers:
        taken = header.frame.exposure
        match = next((each for each in left if taken and _same(taken, each)), None)
        if match is not None:
            left.remove(match)
        else:
            strange.append(header)
    sentences = []
    for number, header in enumerate(strange):
        taken, name = header.frame.exposure, header.frame.path.name
        if taken is None:
            sentences.append(f"{name} does not state its exposure.")
        elif number < len(left):
            sentences.append(
                f"{name} was taken with {_words(taken)} instead of {_words(left[number])};"
                " its true values are used."
            )
        else:
            sentences.append(f"{name} ({_words(taken)}) was not asked for; it is used as it is.")
    return sentences


def _same(taken: Exposure, planned: Exposure) -> bool:
    pairs = [(taken.shutter_s, planned.shutter_s)]
    if taken.known:
        pairs += [(taken.iso, planned.iso), (taken.aperture**2, planned.aperture**2)]
    return all(abs(math.log2(one / other)) <= _SAME_STOPS for one, other in pairs)


def _words(exposure: Exposure) -> str:
    time = exposure.shutter_s
    shutter = f"{time:.3g} s" if time > 0.3 else f"1/{1.0 / time:.0f} s"
    return f"{shutter}, ISO {exposure.iso:g}, f/{exposure.aperture:g}"
