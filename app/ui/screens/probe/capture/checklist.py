"""The checklist for a capture, and the row type shared by its items, the plans and the cameras."""

from __future__ import annotations

from dataclasses import dataclass

from app.core.text import tr


@dataclass(frozen=True, slots=True)
class ChoiceRow:
    """A row for a checklist item, a camera or a plan (such as "Quick", "3 frames, 9 s")."""

    key: str
    title: str
    second: str = ""


CHECKS = (
    ChoiceRow("head-height", tr("Camera where the head will be")),
    ChoiceRow("front-lens", tr("Front lens towards you")),
    ChoiceRow("kneel", tr("Kneel under the camera")),
    ChoiceRow("no-obstacle", tr("Nothing in front of the lights")),
)
"""The checklist to complete before a capture."""
