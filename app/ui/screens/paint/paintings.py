"""The paintings in memory.

A painting is opened from a style or from its draft. It keeps its link to the style when the style
is renamed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final
from weakref import WeakValueDictionary

from app.core.painting.draft_file import find_draft
from app.core.painting.user_style import UserStyle
from app.ui.presenters.services import Services
from app.ui.screens.paint.document import OpenedCanvas, PaintDocument, open_canvas
from app.ui.screens.paint.drafts import DraftKeeper

_OPEN_JOB: Final = "paint-open"


class Paintings:
    """Keeps each painting as long as any of its strokes can be undone.

    Attributes:
        opening: Key of the style that is being opened, or None.
    """

    def __init__(self, services: Services, keeper: DraftKeeper) -> None:
        self._services = services
        self._keeper = keeper
        # The undo stack keeps the paintings alive.
        self._all: WeakValueDictionary[str, PaintDocument] = WeakValueDictionary()
        self.opening: str | None = None

    def add(self, document: PaintDocument) -> None:
        """Store a painting under its current key."""
        self._all[document.key] = document

    def find(self, key: str) -> PaintDocument | None:
        """Return the painting for a style, or None if it is not in memory."""
        document = self._all.get(key)
        # A painting that was saved as another style no longer belongs to this key.
        return document if document is not None and document.key == key else None

    def open(self, key: str, done: Callable[[PaintDocument, OpenedCanvas], None]) -> None:
        """Open a painting in a job. If another painting is requested meanwhile, skip `done`."""
        self.opening = key
        model, folder = self._services.model, self._services.folders.drafts
        head, own = model.head, model.user_styles
        assert head is not None

        def opened(canvas: OpenedCanvas) -> None:
            self.opening = None
            if model.painting != canvas.key or model.head is None:
                return
            self._keeper.opened(canvas.path, canvas.version)
            document = PaintDocument(canvas, model.head, None, model.settings, model.front_deg)
            done(document, canvas)

        self._services.runner.submit(
            _OPEN_JOB, lambda token, report: open_canvas(folder, key, head, own), done=opened
        )

    def restored(self, former: str, style: UserStyle) -> None:
        """Resume the painting for a deleted style that has been restored."""
        document = self._all.pop(former, None)
        if document is not None:
            path, _, _ = find_draft(self._services.folders.drafts, style.name)
            document.saved_as(style, path)
            self.add(document)

    def renamed(self, style: UserStyle) -> None:
        """Rename the painting for a style, or the style's draft if the painting is not open."""
        document = self._all.get(style.name)
        if document is not None:
            document.saved_as(style, document.path)
            # The draft contains the style's title as well.
            self._keeper.keep(document.path, document.draft())
            return
        self._keeper.flush()
        path, draft, _ = find_draft(self._services.folders.drafts, style.name)
        if draft is not None:
            self._keeper.keep(path, replace(draft, title=style.title))
