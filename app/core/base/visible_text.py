"""Make names from files and cameras safe for display."""

from __future__ import annotations

from typing import Final

STEERING: Final = frozenset(
    (
        *(code for code in range(0x20) if chr(code) not in "\n\t"),
        *range(0x7F, 0xA0),
        0x061C,
        *(0x200E, 0x200F, *range(0x2028, 0x202F)),
        *range(0x2066, 0x206A),
        *range(0xD800, 0xE000),
    )
)
"""Control characters, direction marks, line marks, and surrogates for bytes that are not text."""

_MARKS: Final = frozenset((0x061C, 0x200E, 0x200F))
"""Invisible marks used in right-to-left scripts, which are removed without a replacement."""

_REPLACEMENTS: Final = {code: "" if code in _MARKS else "\ufffd" for code in STEERING}


def visible(text: str) -> str:
    r"""Replace control and direction characters with U+FFFD.

    Examples:
        >>> visible("photo\u202egpj.exe")
        'photo�gpj.exe'
    """
    if text.isascii() and text.isprintable():
        return text
    return text.translate(_REPLACEMENTS)
