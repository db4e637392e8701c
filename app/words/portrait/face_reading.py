"""Sentences about reading the direction of the light from a face."""

from __future__ import annotations

from typing import Final

from app.core.faces.light_from_face import Unread
from app.core.text import tr

UNREAD: Final = {
    Unread.PROFILE: tr("The face is in profile."),
    Unread.HIDDEN: tr("Too little of the face is visible."),
    Unread.FLAT: tr("The light is flat: neither side of the face is brighter."),
    Unread.MIXED: tr("Part of the face is hidden, or several lamps light it."),
}
"""Reasons why the direction of the light could not be read."""
