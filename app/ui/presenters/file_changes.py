"""Undoable changes to the user's files, which run in order and are never skipped.

All screens use this module to copy, rename, delete, export and import the user's own styles.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar, Unpack

from app.core.base.errors import CoreError
from app.core.base.progress import Handlers, PhraseReport, Token
from app.core.painting.draft_file import bring_draft_back, put_draft_away
from app.core.painting.user_style import UserStyle, read_user_style, text_path
from app.core.painting.user_styles import (
    EXPORT_ENDING,
    delete,
    duplicate,
    export_style,
    import_style,
    rename,
    restore,
)
from app.core.storage.item_library import TrashedItem
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.presenters.undo_stack import Undoable
from app.ui.presenters.window_model import Event

T = TypeVar("T")
K = TypeVar("K")


class SerialQueue:
    """Runs changes to files one after another.

    The job runner cancels an older job with the same key and drops its result. That is right for
    computed answers, but if two styles are deleted in quick succession, both deletions must run.
    """

    def __init__(self, services: Services, key: str) -> None:
        self.services = services
        self._key = key
        self._waiting: deque[Callable[[], None]] = deque()
        self._busy = False

    def submit(self, work: Callable[[Token, PhraseReport], T], **how: Unpack[Handlers[T]]) -> None:
        """Run a task after every task that is already in the queue (see `Runner.submit`)."""
        done, cancelled = how.get("done"), how.get("cancelled")
        on_error = how.get("failed") or self.services.notify.tell_error

        def begin() -> None:
            self.services.runner.submit(
                self._key,
                work,
                title=how.get("title", ""),
                done=lambda answer: self._ended(done, answer),
                failed=lambda error: self._ended(on_error, error),
                cancelled=lambda: self._ended(cancelled),
            )

        self._waiting.append(begin)
        self._next()

    def _next(self) -> None:
        if self._waiting and not self._busy:
            self._busy = True
            self._waiting.popleft()()

    def _ended(self, call: Callable[..., None] | None, *answer: object) -> None:
        self._busy = False
        try:
            if call is not None:
                call(*answer)
        finally:
            self._next()


class FileChange(Generic[T]):
    """An undoable change to the user's files.

    The change and its undo both wait their turn in the queue. The change is on the undo stack as
    soon as it is requested. An immediate undo therefore applies to this change and not to an
    earlier step. If an error has no handler, it is shown to the user.
    """

    def __init__(
        self,
        files: SerialQueue,
        words: str,
        make: Callable[[], T],
        back: Callable[[T], Any],
        *,
        on_apply: Callable[[T], None],
        undone: Callable[[Any], None],
        failed: Callable[[Exception], None] | None = None,
        before: Callable[[], None] = lambda: None,
    ) -> None:
        self._stack, self._files = files.services.undo, files
        self._make, self._back = make, back
        self._on_apply, self._undone = on_apply, undone
        self._failed = failed or files.services.notify.tell_error
        self._before = before
        self._result: T | None = None
        self.step = Undoable(words, self._take_back, self._again, result=lambda: self._result)

    def begin(self) -> None:
        """Make the change for the first time, and add it to the undo stack."""
        self._before()
        self._stack.push(self.step)
        self._submit(self._make, self._is_made, lambda: self._stack.drop(self.step))

    def take_back(self) -> None:
        """Undo the change, even if others have been made since."""
        self._stack.take_back(self.step)

    def _again(self) -> None:
        self._before()
        self._submit(
            self._make, self._is_made, lambda: self._stack.failed(self.step, undoing=False)
        )

    def _take_back(self) -> None:
        def work() -> Any:
            return None if self._result is None else self._back(self._result)

        def done(answer: Any) -> None:
            if self._result is not None:
                self._result = None
                self._undone(answer)

        self._submit(work, done, lambda: self._stack.failed(self.step, undoing=True))

    def _is_made(self, result: T) -> None:
        self._result = result
        self._on_apply(result)

    def _submit(
        self, work: Callable[[], Any], done: Callable[[Any], None], undo_list: Callable[[], None]
    ) -> None:
        def failed(error: Exception) -> None:
            undo_list()
            self._failed(error)

        self._files.submit(lambda *_: work(), done=done, failed=failed, cancelled=undo_list)


def delete_with_undo(
    files: SerialQueue,
    title: str,
    put_away: Callable[[], T],
    bring_back: Callable[[T], K],
    *,
    message: Callable[[T], str],
    returned: Callable[[K], str],
    before: Callable[[], None] = lambda: None,
) -> None:
    """Delete an item, which the user can restore with Undo or with the button in the message.

    Args:
        files: Queue for the file changes.
        title: Title of the item, used to name the undo step.
        put_away: Moves the item to the trash.
        bring_back: Restores the item from the trash.
        message: Called after the deletion to get the title of the message.
        returned: Called after the restoration to get the title of the message.
        before: Called before the deletion.
    """
    tell = files.services.notify.tell

    def on_apply(trashed: T) -> None:
        words = tr("{title} deleted.", title=message(trashed))
        tell(words, kind="done", actions=[(tr("Undo"), change.take_back)])

    def undone(result: K) -> None:
        tell(tr("{title} has been restored.", title=returned(result)), kind="done")

    what = tr("delete {title}", title=title)
    change = FileChange(
        files, what, put_away, bring_back, on_apply=on_apply, undone=undone, before=before
    )
    change.begin()


def told_beside(services: Services, say: Callable[[str], None]) -> Callable[[Exception], None]:
    """Return an error handler that shows user errors beside the field and others as messages."""

    def failed(error: Exception) -> None:
        if isinstance(error, CoreError):
            say(str(error))
        else:
            services.notify.tell_error(error)

    return failed


class OwnStyles:
    """Changes the files of the user's own styles, and updates the model to match.

    `PlaceController` owns an instance. Files are changed one after another (see `SerialQueue`). A
    screen passes its own steps as callables, and events inform all other screens.

    Attributes:
        leaving: Emits the name of a style before the style is deleted, which allows unsaved work to
            be written.
    """

    def __init__(self, services: Services, files: SerialQueue) -> None:
        self._services = services
        self._files = files
        self.leaving, self.gone, self.back, self.renamed = Event(), Event(), Event(), Event()

    def rename(
        self, style: UserStyle, title: str, done: Callable[[], None], trouble: Callable[[str], None]
    ) -> None:
        """Rename a style. The user can undo this."""
        folder = self._services.folders.styles

        def call(text: str) -> UserStyle:
            # Read the file again, because the weights may have changed since.
            return rename(folder, read_user_style(text_path(folder, style.name)), text)

        def renamed(other: UserStyle) -> None:
            self._put([other if one.name == other.name else one for one in self._styles()])
            self.renamed.emit(other)
            done()

        FileChange(
            self._files,
            tr("rename {title}", title=style.title),
            lambda: call(title),
            lambda _: call(style.title),
            on_apply=renamed,
            undone=renamed,
            failed=told_beside(self._services, trouble),
        ).begin()

    def duplicate(self, style: UserStyle, done: Callable[[UserStyle], None]) -> None:
        """Copy a style, then call `done` with the copy."""
        folder = self._services.folders.styles
        self._files.submit(lambda *_: duplicate(folder, style), done=done)

    def delete(self, style: UserStyle) -> None:
        """Delete a style together with its draft. Undo or the message's button restores both."""
        folders, model = self._services.folders, self._services.model
        # The needle and the goal belong to this style only.
        front = ("chosen", "needle_deg", "goal_deg")
        was = {key: getattr(model, key) for key in front} if style.name == model.chosen else {}
        name = style.name

        def put_away() -> TrashedItem:
            trashed = delete(folders.styles, read_user_style(text_path(folders.styles, name)))
            put_draft_away(folders.drafts, name, trashed.folder)
            return trashed

        def bring_back(trashed: TrashedItem) -> UserStyle:
            restored = restore(folders.styles, trashed)
            bring_draft_back(folders.drafts, restored.name, trashed.folder)
            return restored

        def message(trashed: TrashedItem) -> str:
            others = [one for one in self._styles() if one.name != trashed.name]
            self._put(others, **(dict.fromkeys(front) if trashed.name == model.chosen else {}))
            self.gone.emit(trashed.name)
            return trashed.title

        def returned(restored: UserStyle) -> str:
            nonlocal name
            former, name = name, restored.name
            self._put(self._among(restored), **({**was, "chosen": restored.name} if was else {}))
            self.back.emit(former, restored)
            return restored.title

        delete_with_undo(
            self._files,
            style.title,
            put_away,
            bring_back,
            message=message,
            returned=returned,
            before=lambda: self.leaving.emit(name),
        )

    def export(self, style: UserStyle, path: Path) -> None:
        """Export a style to a file."""
        target = path if path.suffix == EXPORT_ENDING else path.with_name(path.name + EXPORT_ENDING)

        def work() -> str:
            # After adding the suffix, the name may belong to another file, which must not be
            # replaced.
            export_style(style, target, replace=target == path)
            return target.name

        self._files.submit(
            lambda *_: work(),
            done=lambda name: self._services.notify.tell(
                tr("{name} saved.", name=name), kind="done"
            ),
        )

    def take_in(self, path: Path, done: Callable[[UserStyle], None]) -> None:
        """Import a style file, leaving the original unchanged."""
        folder = self._services.folders.styles
        self._files.submit(lambda *_: import_style(folder, path), done=done)

    def add(self, style: UserStyle, *, choose: bool = True, **changes: Any) -> None:
        """Add a style to the model, replacing any style with the same name."""
        if choose:
            changes |= {"chosen": style.name, "needle_deg": None, "goal_deg": None}
        self._put(self._among(style), **changes)

    def _among(self, style: UserStyle) -> list[UserStyle]:
        others = [one for one in self._styles() if one.name != style.name]
        return sorted([*others, style], key=lambda one: one.name)

    def _styles(self) -> tuple[UserStyle, ...]:
        return self._services.model.user_styles

    def _put(self, styles: list[UserStyle], **changes: Any) -> None:
        self._services.model.update(user_styles=tuple(styles), **changes)
