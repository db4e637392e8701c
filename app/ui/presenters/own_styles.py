"""The user's own styles: copied, renamed, put away, handed on and taken in, from any screen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from app.core.errors import CoreError
from app.core.painting import (
    EXPORT_ENDING,
    delete,
    duplicate,
    export_style,
    import_style,
    rename,
    restore,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from app.core.painting import Trashed, UserStyle
    from app.ui.presenters.desk import Desk
    from app.ui.presenters.services import Services

__all__ = ["OwnStyles"]


class OwnStyles:
    """Changes the files of the user's styles, and the model with them.

    Files are changed one after the other, see `Desk.file_work`; what a screen does beyond that
    it does in the callables that it gives.

    Parameters
    ----------
    services : Services
        The window's.
    desk : Desk
        In whose turn files are changed.
    """

    def __init__(self, services: Services, desk: Desk) -> None:
        self._services = services
        self._desk = desk

    def rename(
        self,
        style: UserStyle,
        title: str,
        done: Callable[[UserStyle], None],
        trouble: Callable[[str], None],
    ) -> None:
        """Give a style another title.

        Parameters
        ----------
        style : UserStyle
            As it is kept.
        title : str
            Any text.
        done : callable
            Called with the renamed style once the model has it.
        trouble : callable
            Called with a sentence when the title cannot be taken.
        """
        folder = self._services.folders.styles

        def renamed(other: UserStyle) -> None:
            self._put([other if one.name == other.name else one for one in self._known()])
            done(other)

        def failed(error: Exception) -> None:
            if isinstance(error, CoreError):
                trouble(str(error))
            else:
                self._services.notify.tell_error(error)

        self._desk.file_work.submit(
            lambda token, report: rename(folder, style, title), done=renamed, failed=failed
        )

    def duplicate(self, style: UserStyle, done: Callable[[UserStyle], None]) -> None:
        """Keep a copy of a style; `done` is called with it."""
        folder = self._services.folders.styles
        self._desk.file_work.submit(lambda token, report: duplicate(folder, style), done=done)

    def delete(
        self,
        style: UserStyle,
        done: Callable[[], None],
        back: Callable[[UserStyle], None],
    ) -> None:
        """Put a style away; the message that tells so can bring it back.

        Parameters
        ----------
        style : UserStyle
            As it is kept.
        done : callable
            Called once it is away and no longer in the model.
        back : callable
            Called with the style when it has been brought back.
        """
        folder = self._services.folders.styles

        def bring_back(trashed: Trashed) -> None:
            self._desk.file_work.submit(lambda token, report: restore(folder, trashed), done=back)

        def deleted(trashed: Trashed) -> None:
            gone = style.name == self._services.model.chosen
            # Another style's needle and goal are none of the next one's.
            changes = dict.fromkeys(("chosen", "needle_deg", "goal_deg")) if gone else {}
            self._put([one for one in self._known() if one.name != style.name], **changes)
            done()
            self._services.notify.tell(
                f"{style.title} deleted",
                kind="done",
                actions=(("Undo", lambda: bring_back(trashed)),),
            )

        self._desk.file_work.submit(lambda token, report: delete(folder, style), done=deleted)

    def export(self, style: UserStyle, path: Path) -> None:
        """Write a style to one file.

        Parameters
        ----------
        style : UserStyle
            Kept or not.
        path : Path
            The user has agreed that it is replaced.
        """
        target = path if path.suffix == EXPORT_ENDING else path.with_name(path.name + EXPORT_ENDING)

        def work() -> str:
            # A name that the ending was added to is another file, which nobody agreed to replace.
            export_style(style, target, replace=target == path)
            return target.name

        self._desk.file_work.submit(
            lambda token, report: work(),
            done=lambda name: self._services.notify.tell(f"{name} saved.", kind="done"),
        )

    def take_in(self, path: Path, done: Callable[[UserStyle], None]) -> None:
        """Take in a style that somebody exported; its file is left as it is."""
        folder = self._services.folders.styles
        self._desk.file_work.submit(lambda token, report: import_style(folder, path), done=done)

    def add(self, style: UserStyle, *, chosen: bool = True, **changes: Any) -> None:
        """Put a style among those of the model, in the place of one of the same name.

        Parameters
        ----------
        style : UserStyle
            As it is kept.
        chosen : bool, optional
            Whether it comes to the front.
        **changes : Any
            Of the model, made at the same time.
        """
        others = [one for one in self._known() if one.name != style.name]
        if chosen:
            changes |= {"chosen": style.name, "needle_deg": None, "goal_deg": None}
        self._put(sorted([*others, style], key=lambda one: one.name), **changes)

    def _known(self) -> tuple[UserStyle, ...]:
        return self._services.model.user_styles

    def _put(self, styles: list[UserStyle], **changes: Any) -> None:
        self._services.model.update(user_styles=tuple(styles), **changes)
