"""Remarks that earlier versions saved as sentences."""

from __future__ import annotations

import re
from typing import Final

from app.core.base.remarks import PlainRemark, Remark
from app.core.measure.finish.remarks import ClippingSafe, RoughTurns, SunRestored

_SAFE: Final = "No style's turn depends on what is clipped"
_TURNS: Final = re.compile(r"The turn depends on what is clipped: ([a-z, -]+)\.")
_SUN: Final = re.compile(
    r"The sun \(lamp (\w), (-?\d+)° high\) is clipped in every frame\. It was given the "
    r"([\d.]+) klx that it has at that height under (a clear sky|haze|thin cloud) "
    r"\(IES RP-21\); ([\d.]+) to ([\d.]+) klx are likely\."
)
_SKIES: Final = {"a clear sky": "clear", "haze": "hazy", "thin cloud": "thin cloud"}


def remark_of(sentence: str) -> Remark:
    """Parse a sentence from an earlier file, returning a plain remark if its kind is irrelevant."""
    if sentence.startswith(_SAFE):
        return ClippingSafe(0, every=True)
    if turns := _TURNS.fullmatch(sentence):
        return RoughTurns(tuple(turns[1].split(", ")))
    if sun := _SUN.fullmatch(sentence):
        lux, low, high = (1000.0 * float(sun[group]) for group in (3, 5, 6))
        sky = _SKIES[sun[4]]
        return SunRestored(sun[1], float(sun[2]), sky, lux, low, high)  # type: ignore[arg-type]
    return PlainRemark(sentence)
