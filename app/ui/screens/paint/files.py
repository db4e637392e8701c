"""File actions for the painted style: save, rename, duplicate, delete, export and import."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, Protocol, TypeAlias

from app.core.base.errors import CoreError
from app.core.painting.canvas import Advice, Canvas, is_style
from app.core.painting.draft_file import find_draft
from app.core.painting.user_style import UserStyle, suggested_side
from app.core.painting.user_styles import EXPORT_ENDING, save_user_style, update_user_style
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.presenters.undo_stack import Undoable
from app.ui.presenters.window_model import Step
from app.ui.screens.paint.document import PaintDocument, named_style
from app.ui.screens.paint.drafts import DraftKeeper
from app.ui.screens.styles.files import plain_name
from app.words.painting import advice_words

_ABOUT: Final = "style"  # subject of the messages that a save clears
NOT_SAVED: Final = tr("not saved yet")
CHANGED: Final = tr("changes not saved yet")
ALL_SAVED: Final = tr("Everything is saved")

NameWish: TypeAlias = Literal["save", "save-as", "rename"]
"""The purpose for which a name is requested."""

FileWish: TypeAlias = Literal["export", "import_style"]
"""The purpose for which a file is requested."""


@dataclass(frozen=True, slots=True)
class SaveState:
    """The title and the save button.

    Attributes:
        status: "not saved yet" or "saved", or an empty string while no painting is open.
        words: Label of the save button.
        why: The reason why the painting cannot be saved now, or an empty string if it can be saved.
        busy: Whether a save is running.
    """

    title: str = ""
    status: str = ""
    words: str = tr("Save as my style")
    why: str = ""
    busy: bool = False


class FilesView(Protocol):
    """A view that asks for names and files."""

    def ask_name(self, wish: NameWish, title: str) -> None:
        """Ask for a name, and pass it to the presenter's `files.named`."""

    def show_trouble(self, sentence: str) -> None:
        """Show why the name is invalid, or close the name field if the sentence is empty."""

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file, and pass it to the method of `PaintFiles` named by `what`."""


def save_why(advice: Advice | None, document: PaintDocument) -> str:
    """Return the reason why the painting cannot be saved now, or "" if it can be saved."""
    if not document.unsaved:
        return advice_words(Advice.NOTHING_PAINTED) if document.style is None else ALL_SAVED
    # A saved style that is cleared back to its start differs from its file, so it can be saved.
    restored = advice is Advice.NOTHING_PAINTED and document.style is not None
    return "" if restored else advice_words(advice)


def _status(document: PaintDocument) -> str:
    if document.unsaved:
        return NOT_SAVED if document.style is None else CHANGED
    return tr("saved") if document.style is not None else tr("nothing painted yet")


class PaintFiles:
    """Saves, renames, duplicates, deletes, exports and imports the painted style."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        keeper: DraftKeeper,
        changed: Callable[[], None],
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._own_styles = place_controller.own_styles
        self._keeper = keeper
        self._changed = changed
        self._view: FilesView | None = None
        self._document: PaintDocument | None = None
        self.saving = False

    def attach(self, view: FilesView | None) -> None:
        """Start asking `view` for names and files, or stop asking if it is None."""
        self._view = view

    def take(self, document: PaintDocument) -> None:
        """Switch to this painting."""
        self._document = document

    def resolve(self, document: PaintDocument, advice: Advice | None) -> SaveState:
        """Return the state of the title and the save button."""
        new = document.style is None
        return SaveState(
            title=document.title,
            status=_status(document),
            words=tr("Save as my style") if new else tr("Save changes"),
            why=save_why(advice, document),
            busy=self.saving,
        )

    def actions(self) -> Sequence[Action]:
        """Return the entries of the menu beside the main button."""
        own, open_, painted = self._is_own, self._is_open, self._is_painted
        return (
            Action("save-style-as", tr("Save as a new style…"), self.ask_save_as, "save",
                   "Ctrl+Shift+S", painted),
            Action("rename-painting", tr("Rename…"), self.ask_rename, "edit", "F2", open_),
            Action("duplicate-painting", tr("Duplicate"), self.duplicate, "duplicate", "", own),
            Action("delete-painting", tr("Delete"), self.delete, "trash", "", own),
            Action("export-painting", tr("Export…"), self.ask_export, "export", "", painted),
            Action("import-painting", tr("Import…"), self.ask_import, "import"),
        )  # fmt: skip

    # -- saving --------------------------------------------------------------------------------

    def ask_save(self) -> None:
        """Save changes to the user's own style at once, or ask for a name for a new style."""
        document = self._document
        if document is None or self.saving:
            return
        if document.style is not None:
            self._save_changes(document, document.style)
        elif self._view is not None:
            self._view.ask_name("save", document.title)

    def ask_save_as(self) -> None:
        """Ask for a name for a new style."""
        if self._document is not None and self._view is not None:
            self._view.ask_name("save-as", self._document.title)

    def ask_rename(self) -> None:
        """Ask for a new name for the style."""
        if self._document is not None and self._view is not None:
            self._view.ask_name("rename", self._document.title)

    def named(self, wish: NameWish, title: str) -> None:
        """Save the style under the typed name, or rename it."""
        document = self._document
        if document is None or self.saving:
            return
        if not title.strip():
            self._say_trouble(tr("Enter a name for the style."))
        elif wish == "rename":
            self._rename(document, title)
        else:
            self._save_new(document, title)

    def _save_new(self, document: PaintDocument, title: str) -> None:
        folder, canvas = self._services.folders.styles, document.session.canvas
        facts = self._facts(document, canvas)
        self._write(
            document,
            lambda: save_user_style(folder, canvas, title, **facts),  # type: ignore[arg-type]
            lambda style: self._saved(document, style),
        )

    def _save_changes(self, document: PaintDocument, style: UserStyle) -> None:
        folder, canvas, head = self._services.folders.styles, document.session.canvas, document.head
        others: list[UserStyle] = []

        def done(changed: UserStyle) -> None:
            self._saved(document, changed)
            for other in others:
                self._services.notify.tell(
                    tr(
                        "{title} was also changed in another window. That version is "
                        "saved as {other}.",
                        title=changed.title,
                        other=other.title,
                    ),
                    kind="warning",
                )

        def work() -> UserStyle:
            same = is_style(canvas, head.pack, head.transport, style.origin)
            return update_user_style(folder, style, canvas, others.append, untouched=same)

        self._write(document, work, done)

    def _write(
        self,
        document: PaintDocument,
        work: Callable[[], UserStyle],
        done: Callable[[UserStyle], None],
    ) -> None:
        """Save a style in a job. The canvas stays open, even after an error."""
        document.session.abort()
        self.saving = True
        self._changed()

        def ended(then: Callable[[], None]) -> None:
            self.saving = False
            then()
            self._changed()

        self._place_controller.file_work.submit(
            lambda token, report: work(),
            done=lambda style: ended(lambda: done(style)),
            failed=lambda error: ended(
                lambda: self._failed(error, lambda: self._write(document, work, done))
            ),
            cancelled=lambda: ended(lambda: None),
        )

    def _saved(self, document: PaintDocument, style: UserStyle) -> None:
        before = document.path
        path, _, _ = find_draft(self._services.folders.drafts, style.name)
        document.saved_as(style, before if document.key == style.name else path)
        if document.path != before:
            self._keeper.keep(before, None)
        # Strokes painted during the save form a new draft.
        self._keeper.keep(document.path, document.draft())
        self._say_trouble("")
        is_away = self._services.model.painting is None
        # The user may have left the screen meanwhile, so stay on the current screen.
        self._own_styles.add(style, painting=None if is_away else style.name)
        self._place_controller.refresh_user_styles()
        self._services.notify.tell(
            tr("{title} saved to your styles.", title=style.title),
            kind="done",
            about=_ABOUT,
        )

    def _failed(self, error: Exception, again: Callable[[], None] | None = None) -> None:
        if isinstance(error, CoreError) and self._view is not None:
            self._say_trouble(str(error))
        actions = [] if again is None else [(tr("Try again"), again)]
        self._services.notify.tell_error(error, actions=actions, about=_ABOUT)

    def _facts(self, document: PaintDocument, canvas: Canvas) -> dict[str, str]:
        """Return the painted style's side, place, head and original style."""
        head = document.head
        built_in, mine = named_style(head, self._services.model.user_styles, document.start)
        origin = mine.style if mine is not None else built_in
        side, place = suggested_side(canvas, head.transport, document.session.weights, origin)
        start = document.start
        if mine is not None and not canvas.touched:
            start = mine.copy_of or start
        return {"side": side, "place": place, "head": head.name, "origin": start}

    # -- names and copies ----------------------------------------------------------------------

    def _rename(self, document: PaintDocument, title: str) -> None:
        new_title = " ".join(title.split())
        style, before = document.style, document.title
        if style is not None and new_title != style.title:
            done = lambda: self._say_trouble("")  # noqa: E731
            self._own_styles.rename(style, title, done, self._say_trouble)
            return

        def call(text: str) -> None:
            document.title = text
            self._keeper.keep(document.path, document.draft())
            self._changed()

        self._say_trouble("")
        if new_title[:80] != before:
            call(new_title[:80])
            self._services.undo.push(
                Undoable(
                    tr("rename {title}", title=before),
                    lambda: call(before),
                    lambda: call(new_title[:80]),
                )
            )

    def duplicate(self) -> None:
        """Duplicate the user's style as it was last saved."""
        style = self._own()
        if style is None:
            return
        self._own_styles.duplicate(
            style, lambda copy: self._offer(copy, tr("{title} created.", title=copy.title))
        )

    # -- delete --------------------------------------------------------------------------------

    def delete(self) -> None:
        """Delete the user's style and its draft. Undo can restore both."""
        style = self._own()
        if style is not None:
            self._own_styles.delete(style)

    # -- export and import ---------------------------------------------------------------------

    def ask_export(self) -> None:
        """Ask for the file to which to export the canvas."""
        if self._document is not None and self._view is not None:
            self._view.ask_file("export", f"{plain_name(self._document.title)}{EXPORT_ENDING}")

    def export(self, path: Path) -> None:
        """Export the canvas to a single file, whether or not it is saved."""
        document = self._document
        if document is None:
            return
        canvas = document.session.canvas
        facts = self._facts(document, canvas)
        weights, ignore = canvas.weights, canvas.ignore
        layers = {"weights": weights, "ignore": ignore, "untouched": not canvas.touched}
        style = UserStyle("painted", document.title, note="", **layers, **facts)  # type: ignore[arg-type]
        self._own_styles.export(style, path)

    def ask_import(self) -> None:
        """Ask for a style file to import."""
        if self._view is not None:
            self._view.ask_file("import_style", "")

    def import_style(self, path: Path) -> None:
        """Import an exported style."""
        self._own_styles.take_in(
            path, lambda style: self._offer(style, tr("{title} imported.", title=style.title))
        )

    # -- user's styles -------------------------------------------------------------------------

    def _offer(self, style: UserStyle, message: str) -> None:
        """Add a style to the user's own styles, and offer to paint on it."""
        model = self._services.model
        self._own_styles.add(style, choose=False)
        go = lambda: model.update(step=Step.STYLES, painting=style.name)  # noqa: E731
        self._services.notify.tell(message, kind="done", actions=((tr("Paint on it"), go),))

    def _own(self) -> UserStyle | None:
        return None if self._document is None else self._document.style

    def _is_own(self) -> bool:
        return self._own() is not None

    def _is_open(self) -> bool:
        return self._document is not None

    def _is_painted(self) -> bool:
        document = self._document
        return document is not None and (
            document.style is not None or document.session.canvas.touched
        )

    def _say_trouble(self, sentence: str) -> None:
        if self._view is not None:
            self._view.show_trouble(sentence)
