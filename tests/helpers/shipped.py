"""The generic head that ships, read once for a file of tests and freed after it."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from app.core.portrait.head_views import load_views_of
from app.core.solver.transport import load_named
from app.core.styles.style_pack_file import load_named_pack

if TYPE_CHECKING:
    from app.core.portrait.head_views import HeadViews
    from app.core.solver.transport import Transport
    from app.core.styles.style_pack import StylePack


@cache
def generic_pack() -> StylePack:
    """Read the style pack."""
    return load_named_pack("generic")


@cache
def generic_transport() -> Transport:
    """Read the transport, seen from the front."""
    return load_named("generic")


@cache
def generic_views() -> HeadViews:
    """Read the views from aside."""
    return load_views_of(generic_pack(), "generic")
