"""The list of places that were kept: open, rename, delete, bring back."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.places import (
    PlaceSummary,
    TrashedPlace,
    delete_place,
    list_places,
    list_trash,
    rename_place,
    restore_place,
)
from app.ui.presenters.frame import time_words

if TYPE_CHECKING:
    from app.ui.presenters.desk import Desk
    from app.ui.presenters.services import Services

__all__ = ["DeletedRow", "ShelfPresenter", "ShelfRow", "ShelfState", "ShelfView"]

_MOST_BYTES: Final = 4 << 20
_MOST_PICTURES: Final = 500

_Looked: TypeAlias = tuple[
    tuple[PlaceSummary, ...], dict[Path, NDArray[np.uint8]], tuple[TrashedPlace, ...]
]


@dataclass(frozen=True, slots=True)
class ShelfRow:
    """One place in the list.

    Attributes
    ----------
    folder : Path
        Of the place.
    name, time : str
        As it is shown.
    detail : str
        What is wrong with the place; may be empty.
    trouble : bool
        Whether something is wrong with it.
    thumbnail : NDArray[np.uint8], (h, w, 3), or None
        Small picture, sRGB.
    current : bool
        Whether it is the open one.
    """

    folder: Path
    name: str
    time: str
    detail: str
    trouble: bool
    thumbnail: NDArray[np.uint8] | None = field(compare=False, repr=False)
    current: bool


@dataclass(frozen=True, slots=True)
class DeletedRow:
    """A deleted place that can be brought back.

    Attributes
    ----------
    folder : Path
        In the trash.
    name : str
        As it is shown.
    detail : str
        Until when it is kept.
    """

    folder: Path
    name: str
    detail: str


@dataclass(frozen=True, slots=True)
class ShelfState:
    """What the list shows.

    Attributes
    ----------
    rows : tuple of ShelfRow
        The newest first.
    deleted : tuple of DeletedRow
        The last deleted first.
    busy : bool
        Whether the folder is still being read.
    """

    rows: tuple[ShelfRow, ...] = field(default=())
    deleted: tuple[DeletedRow, ...] = field(default=())
    busy: bool = False


class ShelfView(Protocol):
    """Shows a `ShelfState`."""

    def show_state(self, state: ShelfState) -> None:
        """Show it."""


class ShelfPresenter:
    """Reads the folder of places and acts on them.

    Parameters
    ----------
    services : Services
        The window's.
    desk : Desk
        Opens places.
    """

    def __init__(self, services: Services, desk: Desk) -> None:
        self._services = services
        self._desk = desk
        self._view: ShelfView | None = None
        self._found: tuple[PlaceSummary, ...] | None = None
        self._pictures: dict[Path, NDArray[np.uint8]] = {}
        self._trash: tuple[TrashedPlace, ...] = ()

    def attach(self, view: ShelfView) -> None:
        """Show the list in `view` from now on, and read the folder anew."""
        self._view = view
        self._show()
        self.refresh()

    def detach(self) -> None:
        """Show nothing any more."""
        self._view = None

    def refresh(self) -> None:
        """Read the folder anew."""
        folder = self._services.folders.places
        self._services.runner.submit("places", lambda token, report: _look(folder), done=self._read)

    def resolve(self) -> ShelfState:
        """Work out what the list shows now."""
        if self._found is None:
            return ShelfState(busy=True)
        today = self._services.today()
        current = self._services.model.place_folder
        return ShelfState(
            tuple(
                ShelfRow(
                    folder=one.folder,
                    name=self._name_of(one),
                    time=time_words(one.made_at, today),
                    detail=one.trouble or "",
                    trouble=one.trouble is not None,
                    thumbnail=self._pictures.get(one.folder),
                    current=one.folder == current,
                )
                for one in self._found
            ),
            tuple(
                DeletedRow(one.folder, one.name, f"Deleted {time_words(one.deleted_at, today)}")
                for one in self._trash
            ),
        )

    def open(self, folder: Path) -> None:
        """Open a place."""
        self._desk.open_place(folder)

    def rename(self, folder: Path, name: str) -> None:
        """Give a place another name."""
        if folder == self._services.model.place_folder:
            self._desk.rename(name)
            self.refresh()
            return
        self._desk.file_work.submit(
            lambda token, report: rename_place(folder, name),
            done=lambda _: self.refresh(),
        )

    def delete(self, folder: Path) -> None:
        """Put a place into the trash; the message that tells so can bring it back."""
        name = next((row.name for row in self.resolve().rows if row.folder == folder), "Place")
        if folder == self._services.model.place_folder:
            self._desk.close()

        def deleted(trashed: Path) -> None:
            self._services.notify.tell(
                f"{name} deleted", kind="done", actions=[("Undo", lambda: self.restore(trashed))]
            )
            self.refresh()

        self._desk.file_work.submit(lambda token, report: delete_place(folder), done=deleted)

    def restore(self, trashed: Path) -> None:
        """Bring a place back from the trash."""
        self._desk.file_work.submit(
            lambda token, report: restore_place(trashed),
            done=lambda _: self.refresh(),
        )

    def _name_of(self, one: PlaceSummary) -> str:
        """Name of a place; that of the open one may be newer than the disk's."""
        model = self._services.model
        here = model.place is not None and one.folder == model.place_folder
        return model.place.name if here and model.place is not None else one.name

    def _read(self, looked: _Looked) -> None:
        self._found, self._pictures, self._trash = looked
        self._show()

    def _show(self) -> None:
        if self._view is not None:
            self._view.show_state(self.resolve())


def _look(folder: Path) -> _Looked:
    """List the places of a folder, read their small pictures, and list what was deleted."""
    found = list_places(folder)
    pictures = {}
    for one in found[:_MOST_PICTURES]:
        picture = _thumbnail(one.thumbnail)
        if picture is not None:
            pictures[one.folder] = picture
    return found, pictures, list_trash(folder)


def _thumbnail(path: Path | None) -> NDArray[np.uint8] | None:
    try:
        if path is None or path.stat().st_size > _MOST_BYTES:
            return None
        read = cv2.imread(str(path), cv2.IMREAD_COLOR)
    except (OSError, cv2.error):
        # The place may have been deleted since it was listed.
        return None
    return None if read is None else np.asarray(cv2.cvtColor(read, cv2.COLOR_BGR2RGB), np.uint8)
