"""Downloading a file over an unreliable connection.

The file is written to ``NAME.part``, and the download is resumed there after an interruption. Once
the file is complete, it is checked, flushed to disk and renamed. A file that has its final name is
never written again.
"""

from __future__ import annotations

import math
import os
import re
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final, Protocol, TypeAlias

from app.core.base.atomic_files import file_opener, flush_folder
from app.core.base.progress import Token
from app.core.text import tr
from app.devices.capture.file_integrity import jpeg_end, sha256_of, whole_picture
from app.devices.clock import Clock, wait
from app.devices.errors import (
    LOSSES,
    BadReply,
    CameraRefused,
    DeviceError,
    DownloadFailed,
    Unreachable,
    not_written,
)
from app.devices.theta.messages import FileEntry
from app.devices.theta.reply import Incoming

ATTEMPTS: Final = 5
"""Number of consecutive failures without new data after which a download is abandoned."""

MAX_FILE_BYTES: Final = 64 << 20
"""Size limit for a file, in bytes."""

_MOST_ATTEMPTS: Final = 30
_SLACK_BYTES: Final = 1 << 20
_CHUNK: Final = 1 << 16
_RESERVE_BYTES: Final = 32 << 20
_PAUSES_S: Final = (0.5, 1.0, 2.0, 4.0)
_REPORT_S: Final = 0.1
_RANGE_REFUSED: Final = 416
_PASSING_STATUS: Final = (0, 408, 429, 500, 502, 503, 504, _RANGE_REFUSED)
_PASSING_CODES: Final = ("serviceUnavailable", "unexpected", "disabledCommand")
# A connection that transfers fewer bytes than this in this many seconds counts as lost.
_DRIP_S: Final = 20.0
_DRIP_BYTES: Final = 100_000
_CONTENT_RANGE: Final = re.compile(r"bytes (\d{1,12})-(\d{1,12})/(\d{1,12}|\*)")
_HINT: Final = tr("The partial download is saved. Stay near the camera and resume.")

Progress: TypeAlias = "Callable[[int, int, float], None]"


class FileSource(Protocol):
    """The part of an OSC client needed for downloads."""

    def open_file(self, url: str, *, start: int = 0) -> AbstractContextManager[Incoming]:
        """Open a file on the camera at byte offset `start`."""

    def thumbnail(self, url: str) -> bytes:
        """Return the thumbnail of a file."""


def fetch_file(
    client: FileSource,
    entry: FileEntry,
    target: Path,
    clock: Clock,
    token: Token,
    report: Progress = lambda _received, _size, _rate: None,
    *,
    check: Callable[[Path], bool] | None = None,
) -> Path:
    """Download a photo.

    Args:
        report: Function called about ten times a second with the number of bytes received, the size
            of the file in bytes, and the rate in bytes per second since the first byte of this
            attempt (0 before that byte).
        check: Function that returns whether a file is complete, or None to find out by decoding the
            file. The structure and the size of the JPEG are checked first.

    Raises:
        DownloadFailed: After several attempts, with one of these codes: "interrupted" for a lost
            connection; "bad-answers" for invalid replies; "damaged", "damaged-on-camera" or
            "too-long" for a bad file; "disk-full", "disk" or "other-file" if the file cannot be
            saved.
        CameraRefused: If a retry would be pointless.
        Cancelled: If the token is cancelled.
    """
    token.check()
    whole = check or (lambda path: whole_picture(path, token))
    if target.exists():
        if whole(target):
            return target
        message = tr("A different file named {name} already exists.", name=target.name)
        raise DownloadFailed(message, tr("Use a new folder."), "other-file")
    transfer = _Transfer(client, entry, target, clock, token, report, whole)
    try:
        transfer.run()
    except OSError as error:
        raise not_written(DownloadFailed, target.parent, error) from error
    return target


class _NotWhole(Exception):
    """Raised when the download ends before the file is complete."""


class _Transfer:
    """The download of one file."""

    def __init__(
        self,
        client: FileSource,
        entry: FileEntry,
        target: Path,
        clock: Clock,
        token: Token,
        report: Progress,
        whole: Callable[[Path], bool],
    ) -> None:
        self.client, self.entry, self.target = client, entry, target
        self.clock, self.token, self.report, self.whole = clock, token, report, whole
        self.part = target.with_name(target.name + ".part")
        self.size = max(entry.size, 0)
        self.most = self._received_bytes()
        self.clean_lengths: list[int] = []
        self.short_lengths: set[int] = set()
        self.spoiled: set[bytes] = set()
        # This partial file can never become complete; keep it until the next attempt replaces it.
        self.stale = False

    def run(self) -> None:
        """Download the file, retrying until it is complete."""
        if self.size > MAX_FILE_BYTES:
            raise DownloadFailed(
                tr(
                    "{name} is too large for a photo ({size} MB).",
                    name=self.entry.name,
                    size=self.size >> 20,
                ),
                tr("Check the files on the camera."),
                "too-long",
            )
        self._check_room()
        if self._settle(clean=False):
            return
        failures = 0
        for _ in range(_MOST_ATTEMPTS):
            before = self.most
            try:
                self._attempt()
            except (*LOSSES, _NotWhole) as error:
                last: Exception = error
            except CameraRefused as error:
                # Other refusals are permanent.
                if error.status not in _PASSING_STATUS and error.code not in _PASSING_CODES:
                    raise
                # The camera has no more data, although the file is incomplete.
                short = error.status == _RANGE_REFUSED
                self.stale |= short
                last = _NotWhole() if short else error
            else:
                return
            self.token.check()
            failures = 1 if self.most > before else failures + 1
            if failures >= ATTEMPTS:
                break
            wait(self.clock, _PAUSES_S[min(failures, len(_PAUSES_S)) - 1], self.token)
        raise self._given_up(last) from last

    def _attempt(self) -> None:
        """Download the rest, raising an error only if the file is incomplete afterwards."""
        try:
            self._receive()
        except LOSSES:
            # A wrong Content-Length also looks like a lost connection.
            if self._settle(clean=False):
                return
            raise
        if not self._settle(clean=True):
            raise _NotWhole

    def _receive(self) -> None:
        start = self._restart() if self.stale else self._received_bytes()
        with self.client.open_file(self.entry.url, start=start) as incoming:
            if start and not _continues(incoming, start, self.size):
                start = self._restart()
            if incoming.status != (206 if start else 200):
                raise BadReply(
                    tr(
                        "The camera sent HTTP status {status} instead of {name}.",
                        status=incoming.status,
                        name=self.entry.name,
                    )
                )
            self._write(incoming, start)

    def _write(self, incoming: Incoming, start: int) -> None:
        limit = min(MAX_FILE_BYTES, self.size + _SLACK_BYTES if self.size else MAX_FILE_BYTES)
        size = self.size or (start + incoming.length if incoming.length else 0)
        size_here, began, report_s = start, self.clock.now(), -math.inf
        watch = _Watch(self.clock)
        with open(self.part, "ab" if start else "wb", opener=file_opener) as stream:
            for chunk in incoming.chunks(_CHUNK):
                self.token.check()
                stream.write(chunk[: limit - size_here])
                size_here += len(chunk)
                watch.passed(len(chunk))
                now = self.clock.now()
                if now - report_s >= _REPORT_S:
                    report_s = now
                    self._tell(min(size_here, limit), size, (size_here - start, now - began))
                if size_here >= limit:
                    break
        self.most = max(self.most, min(size_here, limit))
        self._tell(min(size_here, limit), size, (size_here - start, self.clock.now() - began))

    def _tell(self, size_here: int, size: int, last_report: tuple[int, float]) -> None:
        rate = last_report[0] / last_report[1] if last_report[1] > 0.0 else 0.0
        self.report(size_here, size, rate)

    def _settle(self, *, clean: bool) -> bool:
        """Rename a partial file that is complete, or mark one that can never become complete."""
        size_here = self._received_bytes()
        self.most = max(self.most, size_here)
        end = jpeg_end(self.part.read_bytes()) if size_here else None
        if end is None:
            if (self.size and size_here >= self.size) or (clean and not self.size):
                self._spoil()
            elif clean:
                # Resuming at this length is worth trying only once.
                self.stale |= size_here in self.short_lengths
                self.short_lengths.add(size_here)
            return False
        if self.size and size_here > self.size >= end:
            os.truncate(self.part, self.size)
            size_here = self.size
        if self.size in (0, size_here) or self._insists(size_here, clean):
            if self.whole(self.part):
                self._finish()
                return True
            self._spoil()
        self.stale |= clean
        return False

    def _spoil(self) -> None:
        """Record a full-length but invalid download.

        Raises:
            DownloadFailed: If the same data has arrived twice.
        """
        self.stale = True
        digest = bytes.fromhex(sha256_of(self.part))
        if digest in self.spoiled:
            raise DownloadFailed(
                tr("The copy of {name} on the camera is damaged.", name=self.entry.name),
                tr("Take the picture again."),
                code="damaged-on-camera",
            )
        self.spoiled.add(digest)

    def _insists(self, size_here: int, clean: bool) -> bool:
        """Return whether the camera sent this length twice, although it lists a different one."""
        if not clean:
            return False
        self.clean_lengths.append(size_here)
        return self.clean_lengths.count(size_here) > 1

    def _finish(self) -> None:
        with self.part.open("rb+") as stream:
            os.fsync(stream.fileno())
        os.replace(self.part, self.target)
        flush_folder(self.target.parent)

    def _restart(self) -> int:
        self.part.unlink(missing_ok=True)
        self.stale = False
        return 0

    def _received_bytes(self) -> int:
        try:
            return self.part.stat().st_size
        except FileNotFoundError:
            return 0

    def _check_room(self) -> None:
        need_bytes = (self.size or 16 << 20) - self._received_bytes() + _RESERVE_BYTES
        free = shutil.disk_usage(self.target.parent).free
        if free < need_bytes:
            raise DownloadFailed(
                tr(
                    "The disk has {free} MB left; {name} and the merge need {size} MB.",
                    free=free >> 20,
                    name=self.entry.name,
                    size=-(-need_bytes >> 20),
                ),
                tr("Free some space, then resume this session; the photo is still on the camera."),
                code="disk-full",
            )

    def _given_up(self, last: Exception) -> DownloadFailed:
        if isinstance(last, DeviceError):
            code = "bad-answers" if isinstance(last, BadReply | CameraRefused) else "interrupted"
            message = tr(
                "{name} could not be downloaded. {message}",
                name=self.entry.name,
                message=last.message,
            )
            return DownloadFailed(message, _HINT, code)
        return DownloadFailed(
            tr(
                "{name} arrived damaged {attempts} times.",
                name=self.entry.name,
                attempts=ATTEMPTS,
            ),
            tr("The file on the camera may be damaged: check it there, or shoot again."),
            "damaged",
        )


def _continues(incoming: Incoming, start: int, size: int) -> bool:
    """Return whether a reply continues the file at byte offset `start`."""
    if incoming.status != 206:
        return False
    match = _CONTENT_RANGE.fullmatch(incoming.headers.get("content-range", "").strip())
    if match is None:
        return False
    first, last, total = match.groups()
    fits = total == "*" or not size or int(total) == size
    return int(first) == start <= int(last) and fits


class _Watch:
    """Aborts a connection that sends only a trickle and would never time out or end."""

    def __init__(self, clock: Clock) -> None:
        self.clock, self.since, self.bytes = clock, clock.now(), 0

    def passed(self, count: int) -> None:
        """Count the bytes received."""
        self.bytes += count
        now = self.clock.now()
        if now - self.since < _DRIP_S:
            return
        if self.bytes < _DRIP_BYTES:
            raise Unreachable(tr("The connection to the camera is too slow."), _HINT, "drip")
        self.since, self.bytes = now, 0
