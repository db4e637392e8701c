"""File actions for the current style: the set sheet, the numbers and the user's own styles."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Final, Literal, Protocol, TypeAlias

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError
from app.core.base.progress import Token
from app.core.painting.user_style import UserStyle
from app.core.painting.user_styles import EXPORT_ENDING
from app.core.places.place import Place
from app.core.places.place_verdict import place_verdict
from app.core.portrait.age import Kind, light_age
from app.core.solver.place_light import Facing, picture_at
from app.core.solver.turn_choice import LIMITS
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.screens.styles.cards import doubt_note
from app.ui.screens.styles.detail import DetailState, numbers_text
from app.ui.screens.styles.gallery import Snapshot
from app.words.phrases.directions import place_words
from app.words.phrases.place_verdict import place_verdict_words
from app.words.phrases.quantities import time_words
from app.words.portrait.age import age_words
from app.words.portrait.heads import head_title

FileWish: TypeAlias = Literal["save_sheet", "export", "import_style"]
"""The purpose for which a file is requested."""

Front: TypeAlias = Callable[[], tuple[Snapshot | None, DetailState]]

_ENDINGS = (".pdf", ".png")

LIKE_PHOTO: Final = tr("A new style like a photo…")


class StyleFilesView(Protocol):
    """A view that asks for names, files and photos, shows folders and copies text."""

    def ask_name(self, title: str) -> None:
        """Ask for a new name for the chosen style, and pass it to `files.rename`."""

    def show_trouble(self, sentence: str) -> None:
        """Show, beside the name, why it is invalid."""

    def ask_photo(self) -> None:
        """Ask for a photo whose light is to become a style."""

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file, and pass it to the method of `files` named by `what`."""

    def show_folder(self, folder: Path) -> None:
        """Open a folder in the system's file manager."""

    def copy(self, text: str) -> None:
        """Copy text to the clipboard."""


def plain_name(text: str) -> str:
    """Convert text to a file name that is valid on any computer.

    Examples:
        >>> plain_name("North/South: 5 pm?")
        'North South 5 pm'
    """
    words = re.sub(r'[\\/:*?"<>|\x00-\x1f]+', " ", text)
    return " ".join(words.split()).strip(" .") or tr("style")


def sheet_name(state: DetailState, place: str) -> str:
    """Return a suggested file name, such as "Rembrandt left, North studio.pdf"."""
    sides = {"left": tr("{title} left"), "right": tr("{title} right")}
    title = sides.get(state.key.partition("-")[0], "{title}").format(title=state.title)
    name = ", ".join(part for part in (title, place) if part)
    return f"{plain_name(name)}.pdf"


def save_sheet(
    path: Path,
    snapshot: Snapshot,
    state: DetailState,
    place: Place | None,
    now: datetime,
    token: Token,
) -> Path:
    """Create a set sheet and save it.

    Raises:
        CoreError: If an existing file would be replaced without the user's consent, or if the sheet
            cannot be written.
    """
    from app.export.set_page import write_pdf, write_png
    from app.export.set_sheet import assemble

    target = path if path.suffix.lower() in _ENDINGS else path.with_name(f"{path.name}.pdf")
    if target != path and target.exists():
        raise CoreError(
            tr("A file named {file} already exists.", file=target.name), tr("Choose another name.")
        )
    question, light = snapshot.question, snapshot.question.light
    assert light is not None, "a sheet needs a place"
    result = snapshot.results[state.key]
    style, lit_style = snapshot.styles[state.key], snapshot.lit_style(state.key)
    measured = (place.measured_at or place.made_at) if place is not None else None
    head, view_head = question.head, snapshot.head_for(state.key)
    nose = wrap(wrap(state.needle + question.front_deg) - view_head.yaw_deg)
    facing = Facing(light, nose, style.expose)
    target_picture = snapshot.target(state.key)
    doubt = doubt_note(snapshot, state.key) if snapshot.hazards(state.key) else ""

    findings = question.findings()
    verdict = place_verdict(question.results, light.searched, question.front_deg)
    seen_in_eyes = view_head.catchlights(facing, findings)

    def draw(here: FloatImage, size: tuple[int, int]) -> tuple[Bytes, Bytes]:
        picture = (
            picture_at(view_head.transport, light, facing.turn_deg) if view_head.yaw_deg else here
        )
        return view_head.portrait(target_picture, size, lit_style), view_head.portrait(
            picture, size, facing
        )

    sheet = assemble(
        result,
        head.transport,
        light.environment.radiance,
        place=place.name if place is not None else light.name,
        light=place_words("none", style.place),
        front_deg=question.front_deg,
        turn_deg=None if state.at_best else state.needle,
        sun=question.sun,
        limit=LIMITS.match,
        made_text=time_words(measured, now) if measured is not None else "",
        age=_age_words(place, now),
        head=head_title(head.name),
        face_picture=facing(),
        draw=draw,
        notes=" ".join(filter(None, (doubt, place.notes if place is not None else ""))),
        verdict="" if verdict is None else place_verdict_words(verdict, question.results),
        findings=findings,
        catchlights=seen_in_eyes,
    )
    token.check()
    (write_png if target.suffix.lower() == ".png" else write_pdf)(target, sheet)
    return target


ROUGHLY: Final = {
    "rough": tr("A rough answer from a single photo."),
    "film": tr("Light from a film of a face."),
}


def _age_words(place: Place | None, now: datetime) -> str:
    """Describe the age of the light and, if the result is only rough, how it was measured."""
    if place is None or place.capture is None:
        return ""
    how, where = ROUGHLY.get(place.capture.plan, ""), place.location
    if place.measured_at is None:
        return how
    kind: Kind = "sun" if where.sun else "sky" if where.kind == "outdoor" else "unknown"
    age = age_words(light_age(place.measured_at, now, kind, where.sun_elevation_deg))
    return " ".join(words for words in (how, age) if words)


_SHEET_JOB: Final = "set-sheet"


class StyleFiles:
    """Saves sheets, and renames, duplicates, deletes, exports and imports the user's styles."""

    def __init__(self, services: Services, place_controller: PlaceController, front: Front) -> None:
        self._services = services
        self._own = place_controller.own_styles
        self._front = front
        self._view: StyleFilesView | None = None

    def attach(self, view: StyleFilesView | None) -> None:
        """Start asking `view` for names and files, or stop asking if it is None."""
        self._view = view

    def actions(self) -> Sequence[Action]:
        """Return the entries of the menu beside the main button."""
        has_turn, own = self._has_turn, self._is_own
        return (
            Action("set-sheet", tr("Save set sheet…"), self.ask_sheet, "sheet", "Ctrl+S", has_turn),
            Action(
                "copy-numbers", tr("Copy numbers"), self.copy_numbers, "duplicate", "", has_turn
            ),
            Action("rename-style", tr("Rename style…"), self.ask_rename, "edit", "F2", own),
            Action("duplicate-style", tr("Duplicate style"), self.duplicate, "layers", "", own),
            Action("delete-style", tr("Delete style"), self.delete, "trash", "", own),
            Action("export-style", tr("Export style…"), self.ask_export, "export", "", own),
            Action("import-style", tr("Import style…"), self.ask_import, "import"),
            Action("like-photo", LIKE_PHOTO, self.ask_photo, "camera"),
        )

    # -- sheet and numbers ---------------------------------------------------------------------

    def ask_sheet(self) -> None:
        """Ask under what name to save the set sheet."""
        if self._view is not None and self._has_turn():
            _, state = self._front()
            self._view.ask_file("save_sheet", sheet_name(state, self._place_name()))

    def save_sheet(self, path: Path) -> None:
        """Save a set sheet for the style at the displayed turn."""
        snapshot, state = self._front()
        if snapshot is None or not self._has_turn():
            return
        place, now = self._services.model.place, self._services.today()
        self._services.runner.submit(
            _SHEET_JOB,
            lambda token, report: save_sheet(path, snapshot, state, place, now, token),
            title=tr("Saving the set sheet"),
            done=self._sheet_saved,
            failed=lambda error: self._services.notify.tell_error(
                error,
                actions=[
                    (tr("Save elsewhere…"), self.ask_sheet),
                    (tr("Try again"), lambda: self.save_sheet(path)),
                ],
                about=_SHEET_JOB,
            ),
        )

    def _sheet_saved(self, path: Path) -> None:
        def show() -> None:
            if self._view is not None:
                self._view.show_folder(path.parent)

        words = tr("{file} saved in {folder}.", file=path.name, folder=path.parent.name)
        actions = [(tr("Show"), show)]
        self._services.notify.tell(words, kind="done", actions=actions, about=_SHEET_JOB)

    def copy_numbers(self) -> None:
        """Copy the turn, the arc, the match, the contrast and the ratio to the clipboard."""
        if self._view is not None and self._has_turn():
            self._view.copy(numbers_text(self._front()[1], self._place_name()))
            self._services.notify.tell(tr("Numbers copied."), kind="done")

    # -- the user's own styles -----------------------------------------------------------------

    def ask_rename(self) -> None:
        """Ask for a new name for the current style."""
        style = self._own_style()
        if style is not None and self._view is not None:
            self._view.ask_name(style.title)

    def rename(self, title: str) -> None:
        """Rename the current style, which must be one of the user's own."""
        style = self._own_style()
        if style is None or " ".join(title.split()) == style.title:
            self._say_trouble("")
            return
        self._own.rename(style, title, lambda: self._say_trouble(""), self._say_trouble)

    def duplicate(self) -> None:
        """Duplicate the current style, and choose the copy."""
        style = self._own_style()
        if style is not None:
            self._own.duplicate(style, self._own.add)

    def delete(self) -> None:
        """Delete the current style. Undo can restore it."""
        style = self._own_style()
        if style is not None:
            self._own.delete(style)

    def ask_export(self) -> None:
        """Ask for the file to which the current style will be exported."""
        style = self._own_style()
        if style is not None and self._view is not None:
            self._view.ask_file("export", f"{plain_name(style.title)}{EXPORT_ENDING}")

    def export(self, path: Path) -> None:
        """Export the current style to a single file."""
        style = self._own_style()
        if style is not None:
            self._own.export(style, path)

    def ask_photo(self) -> None:
        """Ask for a photo whose light is to become a style."""
        if self._view is not None:
            self._view.ask_photo()

    def ask_import(self) -> None:
        """Ask for a style file to import."""
        if self._view is not None:
            self._view.ask_file("import_style", "")

    def import_style(self, path: Path) -> None:
        """Import an exported style and choose it."""

        def done(style: UserStyle) -> None:
            self._own.add(style)
            self._services.notify.tell(tr("{title} imported.", title=style.title), kind="done")

        self._own.take_in(path, done)

    # -- messages ------------------------------------------------------------------------------

    def _own_style(self) -> UserStyle | None:
        key = self._front()[1].key
        styles = self._services.model.user_styles
        return next((style for style in styles if style.name == key), None)

    def _is_own(self) -> bool:
        return self._own_style() is not None

    def _has_turn(self) -> bool:
        state = self._front()[1]
        return bool(state.turn) and not state.stale

    def _place_name(self) -> str:
        place = self._services.model.place
        return place.name if place is not None else ""

    def _say_trouble(self, sentence: str) -> None:
        if self._view is not None:
            self._view.show_trouble(sentence)
