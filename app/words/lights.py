"""Names of light sources, and wording for their shares of the light."""

from __future__ import annotations

from typing import Final

from app.core.base.catalogue import tr
from app.core.base.phrases import percent
from app.core.measure.finish.lamp_detection import Source

NAMES: Final[dict[Source, str]] = {
    "sun": tr("Sun"),
    "lamp": tr("Lamp"),
    "window": tr("Window"),
    "wall": tr("Bright wall"),
    "ground": tr("Bright ground"),
    "sky": tr("Bright sky"),
    "above": tr("Sky or ceiling"),
    "area": tr("Bright area"),
}
"""Names of light sources in lists."""

MIRRORED: Final[dict[Source, str]] = {
    "sun": tr("the sun"),
    "lamp": tr("a lamp"),
    "window": tr("a window"),
    "wall": tr("a bright wall"),
    "ground": tr("the bright ground"),
    "sky": tr("the sky"),
    "above": tr("the sky or ceiling"),
    "area": tr("a bright area"),
}
"""Names of light sources when reflected in an eye."""

CLIPPED: Final[dict[Source, str]] = {
    "sun": tr("The sun {where} ({id}) is clipped."),
    "lamp": tr("The lamp {where} ({id}) is clipped."),
    "window": tr("The window {where} ({id}) is clipped."),
    "wall": tr("The bright wall {where} ({id}) is clipped."),
    "ground": tr("The bright ground {where} ({id}) is clipped."),
    "sky": tr("The sky {where} ({id}) is clipped."),
    "above": tr("The sky or ceiling {where} ({id}) is clipped."),
    "area": tr("The bright area {where} ({id}) is clipped."),
}
STILL_CLIPPED: Final[dict[Source, str]] = {
    "sun": tr("The sun ({letter}) is still clipped at {where}."),
    "lamp": tr("The lamp ({letter}) is still clipped at {where}."),
    "window": tr("The window ({letter}) is still clipped at {where}."),
    "wall": tr("The bright wall ({letter}) is still clipped at {where}."),
    "ground": tr("The bright ground ({letter}) is still clipped at {where}."),
    "sky": tr("The sky ({letter}) is still clipped at {where}."),
    "above": tr("The sky or ceiling ({letter}) is still clipped at {where}."),
    "area": tr("The bright area ({letter}) is still clipped at {where}."),
}


def share_words(share: float, clipped: bool = False) -> str:
    """Format a lamp's share of the light.

    Examples:
        >>> share_words(0.64), share_words(0.004), share_words(0.648, clipped=True)
        ('64%', '0.4%', 'at least 64%')
    """
    of_hundred = 100.0 * share
    if not clipped:
        return percent(share) if of_hundred >= 0.95 else f"{max(of_hundred, 0.1):.1f}%"
    # A lower bound is never rounded up.
    number = int(of_hundred + 1e-9) if of_hundred >= 1.0 else int(10.0 * of_hundred) / 10.0
    return tr("at least {share}", share=f"{number:g}%")
