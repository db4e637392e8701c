"""A folder watched for new photos from a camera.

Any camera is supported if its files arrive in a folder, whether by cable, Wi-Fi or memory card. The
folder is listed repeatedly, and nothing in it is changed. A file counts once it has not changed for
a few seconds and is a complete photo with an exposure time.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from app.core.base.atomic_files import os_errors_as
from app.core.base.progress import Token
from app.core.text import tr, tr_plural
from app.devices.clock import Clock, wait
from app.devices.errors import CaptureFailed, Unreachable
from app.devices.watched_folder.arrival import Arrival, is_wanted, passed_over, read_arrival
from app.devices.watched_folder.incoming_bracket import Grouping, IncomingBracket

MAX_FILES: Final = 5000
"""Maximum number of entries in a watched folder."""

LINK: Final = tr("{name} is a link, and links are not followed.")
_POLL_S: Final = 0.5
_GONE_S: Final = 30.0
_MAX_NOTES: Final = 200
_HOLD_S: Final = 10.0


class _Stamp(NamedTuple):
    """The change stamp of a file."""

    inode: int
    size: int
    modified_ns: int
    changed_ns: int  # also updated by a change of permissions


@dataclass(slots=True)
class _FileState:
    """A file in the folder, and the time at which it was last seen to change."""

    stamp: _Stamp
    since_s: float
    settled: bool = False
    refused: bool = False

    def differs(self, stamp: _Stamp) -> bool:
        """Return whether the file has changed, or an unreadable one may have become readable."""
        return self.stamp[:3] != stamp[:3] or (self.refused and self.stamp != stamp)


class WatchedFolder:
    """A folder watched for new photos.

    Files present at the start are ignored, as are subfolders, links, and hidden or temporary files.

    Args:
        quiet_s: Seconds without new arrivals after which a bracket is complete.
        still_s: Seconds without a change in size or modification time after which a file is read.

    Raises:
        Unreachable: With the code "no-folder" if the folder does not exist or cannot be read.
    """

    def __init__(
        self,
        folder: Path | str,
        clock: Clock,
        quiet_s: float = 20.0,
        still_s: float = 2.0,
        *,
        say: Callable[[str], None] | None = None,
    ) -> None:
        self.folder = Path(folder)
        self._clock = clock
        self._still_s = still_s
        self._say = say
        self._grouping = Grouping(quiet_s)
        self._files: dict[str, _FileState] = {}
        self._notes: dict[str, None] = {}
        self._reached_s = clock.now()
        self._waiting: list[Arrival] = []
        self._held_since_s = clock.now()
        for name, stamp in self._list_files().items():
            self._files[name] = _FileState(stamp, clock.now(), settled=True)
        if self._files:
            count = len(self._files)
            self._note(
                tr_plural(
                    "{count} file was already in the folder and is ignored.",
                    "{count} files were already in the folder and are ignored.",
                    count,
                )
            )

    def poll(self) -> tuple[Arrival, ...]:
        """List the folder once.

        Returns:
            The photos completed since the last call, in shooting order. A file that changes
            afterwards is returned again.

        Raises:
            Unreachable: With the code "no-folder" if the folder cannot be read for half a minute.
            CaptureFailed: With the code "too-many-files" if the folder has more than `MAX_FILES`
                entries.
        """
        now = self._clock.now()
        try:
            stamps = self._list_files()
        except Unreachable:
            if now - self._reached_s > _GONE_S:
                raise
            return ()
        self._reached_s = now
        for name in self._files.keys() - stamps.keys():
            del self._files[name]
            self._forget(name)
        arrivals = [
            arrival
            for name, stamp in stamps.items()
            if (arrival := self._look(name, stamp, now)) is not None
        ]
        return tuple(sorted(arrivals, key=lambda arrival: arrival.order))

    def brackets(self, token: Token | None = None) -> Iterator[IncomingBracket]:
        """Yield brackets of two or more exposures as they are completed, indefinitely.

        Raises:
            Cancelled: If the token is cancelled.
            DeviceError: As in `poll`.
        """
        token = token or Token()
        while True:
            token.check()
            arrivals = self.poll()
            now = self._clock.now()
            self._take(arrivals, now)
            for bracket in self._grouping.complete(now):
                self._note_groups()
                yield bracket
            self._note_groups()
            wait(self._clock, _POLL_S, token)

    def _take(self, arrivals: tuple[Arrival, ...], now: float) -> None:
        """Group arrivals in shooting order, once no earlier file is still being copied."""
        if not self._waiting:
            self._held_since_s = now
        self._waiting += arrivals
        if self._restless:
            self._grouping.touch(now)
            if now - self._held_since_s < _HOLD_S:
                return
        waiting, self._waiting = sorted(self._waiting, key=lambda arrival: arrival.order), []
        for arrival in waiting:
            self._grouping.add(arrival, now)

    @property
    def _restless(self) -> bool:
        """Whether a file is still being copied."""
        return any(not state.settled for state in self._files.values())

    def _look(self, name: str, stamp: _Stamp, now: float) -> Arrival | None:
        """Return a photo whose file has just become complete, or None for any other file."""
        state = self._files.get(name)
        if state is None or state.differs(stamp):
            self._forget(name)
            self._files[name] = _FileState(stamp, now)
            return None
        if state.settled or now - state.since_s < self._still_s:
            return None
        state.settled = True
        arrival = read_arrival(self.folder / name, stamp.size, stamp.modified_ns / 1e9)
        if isinstance(arrival, str):
            state.refused = True
            self._note(arrival)
            return None
        return arrival

    def _list_files(self) -> dict[str, _Stamp]:
        """Return the change stamps of all files that could be photos, keyed by name."""
        stamps: dict[str, _Stamp] = {}
        sentence = tr("The folder {folder} cannot be read: {reason}.")
        hint = tr("Check its name, and the cable or card.")
        kind = partial(Unreachable, code="no-folder")
        missing = os_errors_as(kind, sentence, hint, folder=self.folder)
        with missing, os.scandir(self.folder) as entries:
            for count, entry in enumerate(entries, 1):
                if count > MAX_FILES:
                    raise CaptureFailed(
                        tr(
                            "The folder {folder} contains more than {most} files.",
                            folder=self.folder,
                            most=MAX_FILES,
                        ),
                        tr("Use an empty folder."),
                        "too-many-files",
                    )
                stamp = self._stamp(entry)
                if stamp is not None:
                    stamps[entry.name] = stamp
        return stamps

    def _stamp(self, entry: os.DirEntry[str]) -> _Stamp | None:
        """Return the change stamp of a file, or None if the file is skipped."""
        if not is_wanted(entry.name):
            self._note(passed_over(entry.name))
            return None
        try:
            facts = entry.stat(follow_symlinks=False)
        except OSError:
            return None  # The file has just been removed.
        if stat.S_ISLNK(facts.st_mode):
            self._note(LINK.format(name=entry.name))
        if not stat.S_ISREG(facts.st_mode):
            return None
        return _Stamp(facts.st_ino, facts.st_size, facts.st_mtime_ns, facts.st_ctime_ns)

    def _forget(self, name: str) -> None:
        path = self.folder / name
        self._waiting = [arrival for arrival in self._waiting if arrival.path != path]
        self._grouping.forget(path)

    def _note_groups(self) -> None:
        for sentence in self._grouping.take_notes():
            self._note(sentence)

    def _note(self, sentence: str) -> None:
        if sentence and sentence not in self._notes and len(self._notes) < _MAX_NOTES:
            self._notes[sentence] = None
            if self._say is not None:
                self._say(sentence)
