"""A library of the user's items in a folder, with titles, names and a trash folder.

Nothing is overwritten or lost, because names are always new and changed or deleted items are moved
to the subfolder ``trash``. An item is valid once its text file exists, so that file is written
last.
"""

from __future__ import annotations

import contextlib
import os
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import make_folder, os_errors_as, words_of
from app.core.base.errors import CoreError
from app.core.text import tr

_MOST: Final = 10_000
_LONGEST_NAME: Final = 28
_RESERVED: Final = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(-.*)?")  # on Windows


def title_key(title: str) -> str:
    """Return the key by which titles are compared. Titles with equal keys look alike."""
    return unicodedata.normalize("NFKC", title).casefold()


def titles_like(title: str, longest: int) -> Iterator[str]:
    """Yield a title and then numbered variants of it, from which the caller picks a free one.

    Examples:
        >>> from itertools import islice
        >>> list(islice(titles_like("My Rembrandt", 80), 3))
        ['My Rembrandt', 'My Rembrandt 2', 'My Rembrandt 3']
    """
    yield title
    base = re.sub(r" \d{1,4}$", "", title)
    for count in range(2, _MOST):
        yield f"{base[: longest - 5]} {count}"


def names_like(title: str, otherwise: str, reserved: Collection[str]) -> Iterator[str]:
    """Yield names for commands and files, derived from a title, from which the caller picks one.

    Examples:
        >>> next(names_like("Café de l'Été", "lamp", ()))
        'cafe-de-l-ete'
    """
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode().lower()
    base = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:_LONGEST_NAME].strip("-") or otherwise
    if _RESERVED.fullmatch(base) or base in reserved:
        base = f"my-{base}"
    yield base
    for count in range(2, _MOST):
        yield f"{base}-{count}"


_TRASH: Final = "trash"
_MOST_IN_TRASH: Final = 100_000


@dataclass(frozen=True, slots=True)
class DamagedItem:
    """An unreadable item in a library. Its files are left unchanged."""

    path: Path
    error: CoreError

    @property
    def reason(self) -> str:
        """The error's sentence and its hint."""
        return str(self.error)


@dataclass(frozen=True, slots=True)
class TrashedItem:
    """An item in the trash."""

    folder: Path
    name: str
    title: str


@dataclass(frozen=True, slots=True)
class Library:
    """A library of one kind of item, with the names for that kind in sentences and on disk."""

    noun: str
    error: type[CoreError]
    not_put_away: Callable[[OSError], CoreError]
    longest: int  # maximum length of a title, in characters
    reserved: Collection[str]  # names that are not allowed in the library
    names: Callable[[Path], Iterable[str]]
    title_of: Callable[[Path, str], str]
    is_taken: Callable[[Path, str], bool]  # whether a name has files already

    def clean_title(self, title: str) -> str:
        """Clean a title, or raise the library's error if it is empty or too long."""
        value = one_line(title)
        if not value:
            raise self.error(tr("A name is missing."), tr("Enter one."))
        if len(value) > self.longest:
            raise self.error(
                tr("This name is longer than {longest} characters.", longest=self.longest),
                tr("Shorten it."),
            )
        return value

    def titles(self, folder: Path, without: str = "") -> dict[str, str]:
        """Return the names of all items, keyed by `title_key`."""
        titles = {}
        for name in self.names(folder):
            # An unreadable title cannot conflict with another.
            with contextlib.suppress(CoreError):
                if name != without:
                    titles[title_key(self.title_of(folder, name))] = name
        return titles

    def new_title(self, folder: Path, name: str, title: str) -> str:
        """Clean an item's new title, or raise the library's error if the title is taken."""
        new_title = self.clean_title(title)
        if title_key(new_title) in self.titles(folder, without=name):
            raise self.error(
                tr("The name “{title}” is already taken.", title=new_title),
                tr("Choose another name."),
            )
        return new_title

    def free_title(self, folder: Path, title: str) -> str:
        """Return the given title, with a number added if the title is already taken."""
        titles = self.titles(folder)
        likes = titles_like(title, self.longest)
        return self._first(each for each in likes if title_key(each) not in titles)

    def free_name(self, folder: Path, title: str) -> str:
        """Return a free name for commands and files, derived from a title."""
        likes = names_like(title, self.noun, self.reserved)
        return self._first(each for each in likes if not self.is_taken(folder, each))

    def names_for(self, folder: Path, title: str, name: str = "") -> tuple[str, str]:
        """Return a free name and a free title. If `name` is free, it is kept."""
        free = self.free_title(folder, title)
        if name and not self.is_taken(folder, name):
            return name, free
        return self.free_name(folder, free), free

    def trash_folder(self, folder: Path, name: str) -> Path:
        """Create an empty folder in the trash, or raise the library's error if this fails."""
        trash = folder / _TRASH
        try:
            make_folder(trash)
            for number in range(1, _MOST_IN_TRASH):
                away = trash / (name if number == 1 else f"{name}-{number}")
                if not away.exists():
                    make_folder(away)
                    return away
        except OSError as error:
            raise self.not_put_away(error) from error
        raise self.error(tr("The trash is full."), tr("Empty {trash}.", trash=trash))

    def put_away(self, folder: Path, name: str, title: str, files: Iterable[Path]) -> TrashedItem:
        """Move an item's files to the trash, starting with the text file, which makes it valid."""
        away = self.trash_folder(folder, name)
        with os_errors_as(self.error, tr("“{title}” was not deleted: {reason}."), title=title):
            for file in files:
                os.replace(file, away / file.name)
        return TrashedItem(away, name, title)

    def _first(self, free: Iterator[str]) -> str:
        free_name = next(free, None)
        if free_name is None:
            raise self.error(
                tr("Too many items already have this name."),
                tr("Choose another name."),
            )
        return free_name


def one_line(text: str) -> str:
    """Convert text to a single line of visible characters."""
    visible = "".join(letter if letter.isprintable() else " " for letter in text)
    return " ".join(visible.split())


def files_in(folder: Path, ending: str) -> list[Path]:
    """List the files in a folder that have the given ending, sorted by name.

    A missing folder contains no files.

    Raises:
        OSError: If the folder cannot be read. In this case, `Path.glob` would return nothing.
    """
    try:
        names = os.listdir(folder)
    except FileNotFoundError:
        return []
    files = (folder / name for name in names if name.endswith(ending))
    return sorted(files, key=lambda file: file.stem)


def unreadable_folder(folder: Path, error: OSError) -> DamagedItem:
    """Return an item to report that the folder of a library cannot be read."""
    return DamagedItem(
        folder, CoreError(tr("The folder cannot be read: {reason}.", reason=words_of(error)))
    )
