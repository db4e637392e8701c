"""The list of saved places, which can be opened, renamed, deleted and restored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.core.base.imaging.image_input import read_picture
from app.core.places.place import LONGEST_NOTES, Place, clean_name, clean_notes, clean_tags
from app.core.places.place_folder import PlaceSummary, change_place
from app.core.places.place_list import (
    TrashedPlace,
    delete_place,
    empty_trash,
    list_places,
    list_trash,
    restore_place,
    trash_size,
)
from app.core.places.place_verdict import verdict_of
from app.core.places.resume import UnfinishedPlace, find_unfinished
from app.core.text import tr, tr_plural
from app.ui.presenters.file_changes import FileChange, delete_with_undo
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services, View
from app.words.phrases.place_verdict import place_verdict_words
from app.words.phrases.quantities import day_words, time_words
from app.words.places import trouble_words

T = TypeVar("T")

NO_FRAMES: Final = tr("Unfinished: no frames yet")
_MOST_BYTES: Final = 4 << 20
_MOST_PIXELS: Final = 1 << 20
_MOST_PICTURES: Final = 500
MOST_SPOTS: Final = 6
"""Maximum number of places that can be compared at once."""

_Reading: TypeAlias = tuple[
    tuple[PlaceSummary, ...],
    dict[Path, NDArray[np.uint8]],
    dict[Path, UnfinishedPlace],
    tuple[TrashedPlace, ...],
    tuple[int, int],
]


@dataclass(frozen=True, slots=True)
class PlacesListRow:
    """A place in the list.

    Attributes:
        detail: Problem of the place, or else the verdict about it, or "" if there is none.
        day: Heading of the day on which the place was measured.
        thumbnail: (h, w, 3) uint8 sRGB, or None if there is no thumbnail.
    """

    folder: Path
    name: str
    time: str
    detail: str
    trouble: bool
    unfinished: UnfinishedPlace | None
    thumbnail: NDArray[np.uint8] | None = field(compare=False, repr=False)
    current: bool
    day: str = ""
    hour: str = ""
    tags: tuple[str, ...] = ()
    notes: str = ""
    can_compare: bool = False

    def has(self, words: str) -> bool:
        """Return whether the text of the place contains all the given words, ignoring case."""
        texts = (self.name, self.time, self.detail, *self.tags, self.notes)
        text = " ".join(texts).casefold()
        return all(word in text for word in words.casefold().split())


@dataclass(frozen=True, slots=True)
class DeletedRow:
    """A deleted place that can be restored."""

    folder: Path
    name: str
    detail: str


@dataclass(frozen=True, slots=True)
class PlacesListState:
    """The contents of the list."""

    rows: tuple[PlacesListRow, ...] = field(default=())
    deleted: tuple[DeletedRow, ...] = field(default=())
    trash: str = ""  # "3 places, 184 MB", or "" if nothing was deleted
    busy: bool = False
    picks: tuple[Path, ...] = field(default=())
    can_pick: bool = True

    @property
    def days(self) -> tuple[tuple[str, tuple[PlacesListRow, ...]], ...]:
        """The places grouped by day, newest day first, with each day's heading."""
        return tuple((day, tuple(rows)) for day, rows in groupby(self.rows, lambda row: row.day))


class PlacesListPresenter(Presenter[View]):
    """Lists the saved places, and opens, changes and deletes them."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        most: int = _MOST_PICTURES,
        key: str = "places",
    ) -> None:
        super().__init__(services)
        self._place_controller = place_controller
        self._most, self._key = most, key
        self._unfinished: dict[Path, UnfinishedPlace] = {}
        self._summaries: tuple[PlaceSummary, ...] | None = None
        self._pictures: dict[Path, NDArray[np.uint8]] = {}
        self._trash: tuple[TrashedPlace, ...] = ()
        self._trash_size = (0, 0)
        self._picks: tuple[Path, ...] = ()

    def attach(self, view: View) -> None:
        """Show the list in `view` from now on, and reload the list."""
        super().attach(view)
        self._place_controller.places_changed.connect(self.refresh)
        self._services.model.changed.connect(self._model_changed)
        self.refresh()

    def detach(self) -> None:
        """Stop showing the list."""
        super().detach()
        self._place_controller.places_changed.disconnect(self.refresh)
        self._services.model.changed.disconnect(self._model_changed)

    def _model_changed(self, names: frozenset[str]) -> None:
        if "place" in names:
            self._refresh()

    def refresh(self) -> None:
        """Reload the list from the folder of places."""
        folder, most = self._services.folders.places, self._most
        self._services.runner.submit(self._key, lambda *_: _look(folder, most), done=self._read)

    def resolve(self) -> PlacesListState:
        """Return the state of the list."""
        if self._summaries is None:
            return PlacesListState(busy=True)
        today = self._services.today()
        current = self._services.model.place_folder
        return PlacesListState(
            tuple(
                PlacesListRow(
                    folder=one.folder,
                    name=self._said_of(one).name,
                    time=time_words(one.made_at, today),
                    detail=self._detail_of(one),
                    trouble=one.trouble is not None or self._left_of(one) is not None,
                    unfinished=self._left_of(one),
                    thumbnail=self._pictures.get(one.folder),
                    current=one.folder == current,
                    day=day_words(one.made_at, today),
                    hour=f"{one.made_at.astimezone(today.tzinfo):%H:%M}",
                    tags=self._said_of(one).tags,
                    notes=self._said_of(one).notes,
                    can_compare=one.has_light,
                )
                for one in self._summaries
            ),
            tuple(
                DeletedRow(
                    one.folder,
                    one.name,
                    tr("Deleted {time}", time=time_words(one.deleted_at, today)),
                )
                for one in self._trash
            ),
            trash=_size_words(*self._trash_size),
            picks=self._picks,
            can_pick=len(self._picks) < MOST_SPOTS,
        )

    def pick(self, *folders: Path) -> None:
        """Select or deselect one place for comparison, or select several places instead.

        At most `MOST_SPOTS` places can be selected. A call without folders clears the selection.
        """
        before = self._picks if len(folders) == 1 else ()
        after = tuple(one for one in before if one not in folders)
        new = tuple(one for one in folders if one not in before)
        self._picks = (*after, *new)[:MOST_SPOTS]
        self._refresh()

    def open(self, folder: Path) -> None:
        """Open a place, or finish it first if it is unfinished."""
        unfinished = self._unfinished.get(folder)
        if unfinished is not None and unfinished.can_finish:
            self._place_controller.finish(unfinished)
        else:
            self._place_controller.open_place(folder)

    def edit(self, folder: Path, name: str, tags: str, notes: str) -> None:
        """Change a place's name, comma-separated tags and notes. The user can undo this."""
        before = next((row for row in self.resolve().rows if row.folder == folder), None)
        if before is None:
            return
        changes: dict[str, Any] = {
            "name": clean_name(name) if name.strip() else before.name,
            "tags": clean_tags(tags.split(",")),
            "notes": clean_notes(notes)[:LONGEST_NOTES],
        }
        old = {key: getattr(before, key) for key in changes}
        words = tr("change {name}", name=before.name)
        if changes != old and before.current:
            self._place_controller.change(words, **changes)
        elif changes != old:
            self._change(
                words,
                lambda: change_place(folder, **changes),
                lambda _: change_place(folder, **old),
            )

    def delete(self, folder: Path) -> None:
        """Move a place to the trash. Undo or the message's button restores the place."""
        name, model, was_open = self._title(folder), self._services.model, False

        def close() -> None:
            nonlocal was_open
            was_open = folder == model.place_folder
            if was_open:
                self._place_controller.close()

        def message(_: Path) -> str:
            self._place_controller.places_changed.emit()
            return name

        def returned(back: Path) -> str:
            nonlocal folder
            folder = back
            self._place_controller.places_changed.emit()
            if was_open and model.place_folder is None:
                self._place_controller.open_place(folder)
            return name

        delete_with_undo(
            self._place_controller.file_work,
            name,
            lambda: delete_place(folder),
            restore_place,
            message=message,
            returned=returned,
            before=close,
        )

    def restore(self, trashed: Path) -> None:
        """Restore a place from the trash. The user can undo this.

        If the deletion can still be undone, undo it instead.
        """
        if not self._services.undo.take_back_what(trashed):
            name = next((one.name for one in self._trash if one.folder == trashed), tr("Place"))

            def away_again(folder: Path) -> None:
                nonlocal trashed
                trashed = delete_place(folder)

            self._change(
                tr("restore {name}", name=name), lambda: restore_place(trashed), away_again
            )

    def empty_trash(self) -> None:
        """Permanently delete the trashed places in a job that can be cancelled."""
        folder, notify = self._services.folders.places, self._services.notify

        def done(count: int) -> None:
            self.refresh()
            words = tr_plural("{count} place deleted.", "{count} places deleted.", count)
            notify.tell(words, kind="done")

        def failed(error: Exception) -> None:
            self.refresh()
            notify.tell_error(error)

        self._place_controller.file_work.submit(
            lambda token, report: empty_trash(folder, token, report),
            title=tr("Emptying the trash"),
            done=done,
            failed=failed,
            cancelled=self.refresh,
        )

    def _change(self, words: str, make: Callable[[], T], back: Callable[[T], Any]) -> None:
        def done(_: Any) -> None:
            self._place_controller.places_changed.emit()

        files = self._place_controller.file_work
        FileChange(files, words, make, back, on_apply=done, undone=done).begin()

    def _title(self, folder: Path) -> str:
        return next((row.name for row in self.resolve().rows if row.folder == folder), tr("Place"))

    def _left_of(self, one: PlaceSummary) -> UnfinishedPlace | None:
        # The light of the open place may not be on the disk yet.
        here = one.folder == self._services.model.place_folder
        return None if here else self._unfinished.get(one.folder)

    def _detail_of(self, one: PlaceSummary) -> str:
        unfinished = self._left_of(one)
        if unfinished is not None:
            return _unfinished_words(unfinished)
        if one.trouble:
            return trouble_words(one.trouble)
        verdict = verdict_of(one.answers, one.flow)
        return "" if verdict is None else place_verdict_words(verdict, one.answers)

    def _said_of(self, one: PlaceSummary) -> Place | PlaceSummary:
        """Return the object with the current name, tags and notes of a place.

        For the open place, these may be newer than the ones in the place's file.
        """
        place = self._services.model.place
        here = place is not None and one.folder == self._services.model.place_folder
        return place if here and place is not None else one

    def _read(self, reading: _Reading) -> None:
        self._summaries, self._pictures, self._unfinished, self._trash, self._trash_size = reading
        there = {one.folder for one in self._summaries if one.has_light}
        self._picks = tuple(one for one in self._picks if one in there)
        self._refresh()


def _look(folder: Path, most: int) -> _Reading:
    """Return the places in a folder with their thumbnails, and the places in the trash."""
    places = list_places(folder)
    unfinished = {one.folder: each for one in places if (each := find_unfinished(one)) is not None}
    pictures = {}
    for one in places[:most]:
        picture = _thumbnail(one.thumbnail)
        if picture is not None:
            pictures[one.folder] = picture
    return places, pictures, unfinished, list_trash(folder), trash_size(folder)


def _unfinished_words(unfinished: UnfinishedPlace) -> str:
    """Return the status of an unfinished place, such as "Unfinished: 3 of 7 frames"."""
    if unfinished.total:
        return tr(
            "Unfinished: {here} of {total} frames", here=unfinished.here, total=unfinished.total
        )
    if unfinished.files:
        return tr_plural(
            "Unfinished: {count} photo",
            "Unfinished: {count} photos",
            len(unfinished.files),
        )
    return NO_FRAMES


def _size_words(count: int, size: int) -> str:
    if not count:
        return ""
    megabytes = max(round(size / 1e6), 1)
    return tr_plural("{count} place, {size} MB", "{count} places, {size} MB", count, size=megabytes)


def _thumbnail(path: Path | None) -> NDArray[np.uint8] | None:
    # The place may have been deleted since it was listed.
    return None if path is None else read_picture(path, _MOST_BYTES, _MOST_PIXELS)
