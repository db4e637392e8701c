"""Small pieces of HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def degrees(value: float) -> str:
    """Format an angle: ``1.90°``."""
    return f"{value:.2f}°".replace("-", "−")


def percent(share: float, digits: int = 2) -> str:
    """Format a share as a percentage: ``0.25 %``."""
    return f"{100 * share:.{digits}f} %".replace("-", "−")


def paragraph(words: str) -> str:
    """Make a paragraph of plain text."""
    return f"<p>{_kept(words)}</p>"


def _kept(words: str) -> str:
    """Escape text, and keep numbers, signs and units on one line."""
    together = words.replace(" %", "\u00a0%").replace(" × ", "\u00a0×\u00a0")
    return escape(together, quote=False)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, first: int = 1) -> str:
    """Make a table of plain text; the first columns are text, the others numbers.

    Args:
        first: Number of text columns.
    """

    def cells(row: Sequence[str], tag: str) -> str:
        parts = []
        for k, words in enumerate(row):
            kind = "" if k < first else ' class="n"'
            parts.append(f"<{tag}{kind}>{escape(words, quote=False)}</{tag}>")
        return "".join(parts)

    lines = [f"<tr>{cells(row, 'td')}</tr>" for row in rows]
    return (
        f"<table><thead><tr>{cells(head, 'th')}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
    )


def figure(drawing: str, words: str) -> str:
    """Put a caption under a drawing."""
    return f"<figure>{drawing}<figcaption>{_kept(words)}</figcaption></figure>"
