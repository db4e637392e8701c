"""What each number on a screen means: one table for the window, its help, and the manual."""

from __future__ import annotations

from typing import Final

from app.core.base.catalogue import tr

# fmt: off
EXPLANATIONS: Final = {
    "turn": (tr("Turn"), tr(
        "How far the sitter, and you with them, rotate. Clockwise is as seen from above: you walk "
        "to your left around the sitter.")),
    "clock": (tr("Clock hour"), tr(
        "Where the turn leads, on a clock that lies on the floor: at 12 is what the sitter faced "
        "before, at 3 what was at their right hand.")),
    "good_from": (tr("Good from … to"), tr(
        "Within these turns hardly anything is lost: choose the nicer background.")),
    "match": (tr("Match"), tr(
        "How much the face at that turn looks like the style’s studio picture, from brow to chin. "
        "100 is that picture itself; the tick on a bar is the least that the style needs.")),
    "contrast": (tr("Contrast"), tr(
        "How deep the play of light and shadow is, as a share of the studio’s: 100 % is as deep "
        "as in the studio picture.")),
    "grade": (tr("Grade"), tr(
        "In reach: the face shows what the style is named for. Nearly: it shows it, but shallower "
        "or softer. Out of reach: the place lacks something, and the card says what.")),
    "ratio": (tr("Lighting ratio"), tr(
        "How much brighter the lit side of the face is than the other: key and fill together, "
        "over fill alone. One stop is twice as bright.")),
    "quality": (tr("Quality C"), tr(
        "The paper’s own score of a turn. It has no upper end: compare it within one place.")),
    "confidence": (tr("How sure it is"), tr(
        "The probability that the live camera looks where the number says: certain, likely or "
        "doubtful.")),
    "side": (tr("Sitter’s left"), tr(
        "The side of the sitter’s own left hand: on the right in the picture. A style is named "
        "after the side of its main light.")),
    "card": (tr("What a card says"), tr(
        "The left picture is the style in the studio, the right one this place at the best turn. "
        "Amber is that turn; the number and the bar are the match.")),
}
"""Title and words of each."""
# fmt: on
