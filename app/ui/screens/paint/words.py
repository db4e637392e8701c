"""Words around the easel: what can be started from, what is saved, what cannot be saved yet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.core.painting.canvas import NOTHING_PAINTED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.painting.user_style import UserStyle
    from app.ui.presenters.model import Head
    from app.ui.screens.paint.document import PaintDocument

ALL_SAVED: Final = "Everything is saved"
NOTHING: Final = ("", "Nothing", "an empty face")


def starts_of(head: Head, own: Sequence[UserStyle]) -> tuple[tuple[str, str, str], ...]:
    """List what painting can start from.

    Returns
    -------
    tuple of (str, str, str)
        Key, title and side: nothing first, then the user's own, then the built-in styles.
    """
    mine = tuple((one.name, one.title, one.side_words or "painted by you") for one in own)
    names = {one.name for one in own}
    rest = [one for one in head.pack.styles if one.name not in names]
    return (NOTHING, *mine, *((one.name, one.title, one.side_words) for one in rest))


def status_of(easel: PaintDocument) -> str:
    """Say whether what is painted is saved."""
    if easel.unsaved:
        return "not saved yet" if easel.style is None else "changes not saved yet"
    return "saved" if easel.style is not None else "nothing painted yet"


def save_words(easel: PaintDocument) -> str:
    """Words on the main button."""
    return "Save as my style" if easel.style is None else "Save changes"


def save_why(advice: str | None, easel: PaintDocument) -> str:
    """Say why what is painted cannot be saved now; empty when it can."""
    if not easel.unsaved:
        return ALL_SAVED if easel.style is not None else NOTHING_PAINTED
    # Restored to what it began from, yet another than what was saved: that can be saved as well.
    return "" if advice == NOTHING_PAINTED and easel.style is not None else advice or ""
