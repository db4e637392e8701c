"""Saving the set sheet of the style in front, with the very numbers that the screen shows."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from app.core.base.errors import CoreError
from app.ui.presenters.frame import time_words

if TYPE_CHECKING:
    from datetime import datetime
    from pathlib import Path

    from app.core.base.progress import Token
    from app.core.storage.places.place import Place
    from app.ui.screens.styles.gallery import Snapshot
    from app.ui.screens.styles.state import DetailState

_ENDINGS = (".pdf", ".png")


def plain_name(text: str) -> str:
    """Make a text fit for the name of a file on any computer.

    Examples
    --------
    >>> plain_name("North/South: 5 pm?")
    'North South 5 pm'
    """
    words = re.sub(r'[\\/:*?"<>|\x00-\x1f]+', " ", text)
    return " ".join(words.split()).strip(" .") or "style"


def sheet_name(state: DetailState, place: str) -> str:
    """Suggest the name of a file: "Rembrandt left, North studio.pdf"."""
    side = state.key.partition("-")[0]
    parts = [f"{state.title} {side}" if side in ("left", "right") else state.title, place]
    name = ", ".join(part for part in parts if part)
    return f"{plain_name(name)}.pdf"


def save_sheet(
    path: Path,
    snapshot: Snapshot,
    state: DetailState,
    place: Place | None,
    now: datetime,
    token: Token,
) -> Path:
    """Make a set sheet and write it.

    Raises
    ------
    CoreError
        If a file is there that nobody agreed to replace, or it cannot be written.
    """
    from app.export.set_page import write_pdf, write_png
    from app.export.set_sheet import assemble

    target = path if path.suffix.lower() in _ENDINGS else path.with_name(f"{path.name}.pdf")
    if target != path and target.exists():
        raise CoreError(f"There is already a file {target.name}.", "Choose another name.")
    question, light = snapshot.question, snapshot.question.light
    assert light is not None, "a sheet needs a place"
    result = snapshot.results[state.key]
    style = snapshot.styles[state.key]
    measured = (place.measured_at or place.made_at) if place is not None else None
    sheet = assemble(
        result,
        question.head.transport,
        light.environment.radiance,
        place=place.name if place is not None else light.name,
        target=snapshot.target(state.key),
        light=style.place,
        front_deg=question.front_deg,
        turn_deg=None if state.at_best else state.needle,
        sun=question.sun,
        limit=question.limits.match,
        made=time_words(measured, now) if measured is not None else "",
        head=question.head.title,
        notes=place.notes if place is not None else "",
    )
    token.check()
    (write_png if target.suffix.lower() == ".png" else write_pdf)(target, sheet)
    return target
