"""The user's own styles: copied, renamed, put away, handed on and taken in, from any screen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from app.core.base.errors import CoreError
from app.core.painting.library import (
    EXPORT_ENDING,
    delete,
    duplicate,
    export_style,
    import_style,
    rename,
    restore,
)
from app.core.painting.session import bring_draft_back, put_draft_away
from app.core.painting.user_style import UserStyle, read_user_style, text_path
from app.core.storage.library import Trashed
from app.core.text import tr
from app.ui.presenters.file_changes import FileChange, SerialQueue
from app.ui.presenters.model import Event
from app.ui.presenters.services import Services


class OwnStyles:
    """Changes the files of the user's styles, and the model with them; the desk has the only one.

    Files are changed one after the other, see `Desk.file_work`. What a screen does beyond that it
    does in the callables that it gives; what any screen has to know is told by the events.

    Attributes:
        leaving: Emits the name of a style that is about to be put away: what is unsaved is written
            now.
    """

    def __init__(self, services: Services, files: SerialQueue) -> None:
        self._services = services
        self._files = files
        self.leaving, self.gone, self.back, self.renamed = Event(), Event(), Event(), Event()

    def rename(
        self, style: UserStyle, title: str, done: Callable[[], None], trouble: Callable[[str], None]
    ) -> None:
        """Give a style another title; can be undone."""
        folder = self._services.folders.styles

        def call(text: str) -> UserStyle:
            # With its newest weights: it may have been painted on since.
            return rename(folder, read_user_style(text_path(folder, style.name)), text)

        def renamed(other: UserStyle) -> None:
            self._put([other if one.name == other.name else one for one in self._known()])
            self.renamed.emit(other)
            done()

        def failed(error: Exception) -> None:
            if isinstance(error, CoreError):
                trouble(str(error))
            else:
                self._services.notify.tell_error(error)

        FileChange(
            self._services.undo,
            self._files,
            tr("rename {title}", title=style.title),
            lambda: call(title),
            lambda _: call(style.title),
            made=renamed,
            undone=renamed,
            failed=failed,
        ).begin()

    def duplicate(self, style: UserStyle, done: Callable[[UserStyle], None]) -> None:
        """Keep a copy of a style; `done` is called with it."""
        folder = self._services.folders.styles
        self._files.submit(lambda token, report: duplicate(folder, style), done=done)

    def delete(self, style: UserStyle) -> None:
        """Put a style away with its draft; undo, or the message that tells so, brings both back."""
        folders, model = self._services.folders, self._services.model
        # Another style's needle and goal are none of the next one's.
        front = ("chosen", "needle_deg", "goal_deg")
        was = {key: getattr(model, key) for key in front} if style.name == model.chosen else {}
        name = style.name

        def put_away() -> Trashed:
            trashed = delete(folders.styles, read_user_style(text_path(folders.styles, name)))
            put_draft_away(folders.drafts, name, trashed.folder)
            return trashed

        def bring_back(trashed: Trashed) -> UserStyle:
            kept = restore(folders.styles, trashed)
            bring_draft_back(folders.drafts, kept.name, trashed.folder)
            return kept

        def gone(trashed: Trashed) -> None:
            others = [one for one in self._known() if one.name != trashed.name]
            self._put(others, **(dict.fromkeys(front) if trashed.name == model.chosen else {}))
            self.gone.emit(trashed.name)
            self._services.notify.tell(
                tr("{title} deleted", title=trashed.title),
                kind="done",
                actions=((tr("Undo"), change.take_back),),
            )

        def returned(kept: UserStyle) -> None:
            nonlocal name
            former, name = name, kept.name
            self._put(self._among(kept), **({**was, "chosen": kept.name} if was else {}))
            self.back.emit(former, kept)
            self._services.notify.tell(tr("{title} is back.", title=kept.title), kind="done")

        change = FileChange(
            self._services.undo,
            self._files,
            tr("delete {title}", title=style.title),
            put_away,
            bring_back,
            made=gone,
            undone=returned,
            failed=self._services.notify.tell_error,
            before=lambda: self.leaving.emit(name),
        )
        change.begin()

    def export(self, style: UserStyle, path: Path) -> None:
        """Write a style to one file."""
        target = path if path.suffix == EXPORT_ENDING else path.with_name(path.name + EXPORT_ENDING)

        def work() -> str:
            # A name that the ending was added to is another file, which nobody agreed to replace.
            export_style(style, target, replace=target == path)
            return target.name

        self._files.submit(
            lambda token, report: work(),
            done=lambda name: self._services.notify.tell(
                tr("{name} saved.", name=name), kind="done"
            ),
        )

    def take_in(self, path: Path, done: Callable[[UserStyle], None]) -> None:
        """Take in a style that somebody exported; its file is left as it is."""
        folder = self._services.folders.styles
        self._files.submit(lambda token, report: import_style(folder, path), done=done)

    def add(self, style: UserStyle, *, chosen: bool = True, **changes: Any) -> None:
        """Put a style among those of the model, in the place of one of the same name."""
        if chosen:
            changes |= {"chosen": style.name, "needle_deg": None, "goal_deg": None}
        self._put(self._among(style), **changes)

    def _among(self, style: UserStyle) -> list[UserStyle]:
        others = [one for one in self._known() if one.name != style.name]
        return sorted([*others, style], key=lambda one: one.name)

    def _known(self) -> tuple[UserStyle, ...]:
        return self._services.model.user_styles

    def _put(self, styles: list[UserStyle], **changes: Any) -> None:
        self._services.model.update(user_styles=tuple(styles), **changes)
