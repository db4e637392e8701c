"""The meaning of each number on screen, in one table for the window, its help and the manual."""

from __future__ import annotations

from typing import Final

from app.core.base.catalogue import tr

# fmt: off
EXPLANATIONS: Final = {
    "turn": (tr("Turn"), tr(
        "How far you and the sitter rotate. Clockwise means as seen from above: you walk to "
        "your left around the sitter.")),
    "clock": (tr("Clock position"), tr(
        "The turn on a clock face lying on the floor: 12 is straight ahead of the sitter "
        "before the turn, 3 is to their right.")),
    "good_from": (tr("Good from … to"), tr(
        "Any of these turns looks about as good, so choose the nicer background.")),
    "match": (tr("Match"), tr(
        "How closely the face, from brows to chin, resembles the style’s studio picture. "
        "100 is identical; the tick on the bar is the minimum for the style.")),
    "contrast": (tr("Contrast"), tr(
        "How deep the shadows are compared with the studio picture: 100% is just as deep.")),
    "grade": (tr("Grade"), tr(
        "Yes: the style is seen at a glance. Soft: it is the same light, but shallower or softer "
        "than in the studio. No: the place lacks something; the card says what.")),
    "ratio": (tr("Lighting ratio"), tr(
        "How much brighter the lit side of the face is than the other: key and fill "
        "together against fill alone. One stop is twice as bright.")),
    "quality": (tr("Quality C"), tr(
        "The paper’s own score for a turn. It has no maximum, so compare it only within "
        "one place.")),
    "confidence": (tr("Confidence"), tr(
        "How likely it is that the live camera points where the number says: certain, "
        "likely or doubtful.")),
    "side": (tr("Sitter’s left"), tr(
        "The sitter’s own left, which is on the right of the picture. A style is named "
        "after the side of its key light.")),
    "card": (tr("How to read a card"), tr(
        "The left picture shows the style in the studio; the right one shows this place at the "
        "best turn, in amber. Yes: seen at a glance. Soft: softer than in the studio.")),
}
"""Title and explanation of each number, by its key."""
# fmt: on
