"""Retries, reconnection and recovery of a bracket after a connection loss.

A *loss* is a request without a usable reply: a timeout, a broken connection, garbage, and, once the
camera has answered, a router's page, a redirect or a 401.

============================= ============================= ======================================
error                         while                         response
============================= ============================= ======================================
a loss                        first contact                 retried: a page, a password or a
                                                            refused connection three times, cut or
                                                            garbled replies for 20 s, silence for a
                                                            minute
a loss                        querying (info, state,        reconnect, searching for the camera
                              options, status, list),       for up to three minutes, then retry the
                              changing options, deleting    request, up to seven times
a loss                        the same, on a camera that    `Contact.forgotten` is incremented, and
                              lost its settings (SC2 whose  the caller starts again with the setup
                              options differ; S and SC
                              back at API 2.0; any that
                              was switched off and on)
a loss                        starting an exposure          never simply repeated, as the camera
                                                            may have received it. State and file
                                                            list decide; restarted only if nothing
                                                            happened, at most four times
a loss                        downloading a file            `download` resumes it; after that,
                                                            reconnect and resume twice more
a loss                        restoring settings            retried for 20 s; after that, they stay
                                                            in the journal and a message says so
`CameraRefused`: busy         anything                      retried after growing pauses, for 30 s
(serviceUnavailable, 503,
unexpected)
`CameraRefused`:              options, starting             retried for 8 s, as a preview may be
disabledCommand                                             closing; after that, a bracket becomes
                                                            single photos
`CameraRefused`:              options                       the option is omitted if possible; a
invalidParameter*                                           bracket is tried without white balance
                                                            (X), then as single photos
`CameraRefused`: unknown id   status                        the state is polled instead
or file
`CameraRefused`:              status                        `CaptureFailed`: stopped at the camera
canceledShooting
`CameraRefused`: unknown      anything, on S and SC         switched to API 2.1 if necessary, and
command or parameter                                        the request repeated at most twice
`CameraRefused`:              switching an S or SC to       retried while the camera shoots, for at
disabledCommand               API 2.1                       most ten minutes, or one minute at the
                                                            end of a capture
`CameraRefused`: others       anything                      never retried
`PasswordNeeded`              three greetings in a row      ends the capture
`CameraNotReady`, `CoreError` anything                      never retried
`Cancelled`                   anything                      never retried; shooting is stopped,
                                                            settings are restored, files stay
============================= ============================= ======================================

Together, all waits for a lost camera last at most `PATIENCE_S`. A capture therefore always ends.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from itertools import takewhile
from typing import Any, Final, Protocol, TypeVar

from app.core.base.progress import Token
from app.core.text import tr
from app.devices.clock import Clock, wait
from app.devices.errors import (
    LOSSES,
    CameraNotReady,
    CameraRefused,
    PasswordNeeded,
    Unreachable,
)
from app.devices.theta.client import OscClient
from app.devices.theta.first_contact import PAUSES_S, FirstContact
from app.devices.theta.messages import FileEntry, Info

BUSY: Final = frozenset({"serviceUnavailable", "unexpected", "serverError"})
"""Error codes sent by a busy camera."""

NOT_NOW: Final = frozenset({"disabledCommand"})
"""Error codes sent by a camera that cannot execute the command at the moment."""

RECONNECTED: Final = tr("Reconnected to the camera")
REJOIN_S: Final = 180.0
"""Time limit for reconnecting, in seconds."""

PATIENCE_S: Final = 420.0
"""Time limit for all reconnections in one capture together, in seconds."""

_OLD_API: Final = frozenset({"unknownCommand", "missingParameter", "invalidParameterName"})
_FIRST_S: Final = 60.0
_SILENCES: Final = 1000  # Timeouts are limited by the total time instead.
_TRIES: Final = 8
_LONGEST_PAUSE_S: Final = 2.0  # The request before the pause has already waited.
_SWITCHES: Final = 2
_BUSY_S: Final = 30.0
_NOT_NOW_S: Final = 8.0
_UNSAID_S: Final = 4.0
_RESTARTED_S: Final = 5.0
_SPARE: Final = 12
_MOST_LISTED: Final = 100
_SHOOTING_S: Final = 600.0
_LAST_SHOOTING_S: Final = 60.0
# Every capture sets these options and nothing else changes them, so a difference reveals lost
# settings.
_MARKS: Final = ("captureMode", "exposureProgram", "whiteBalance", "_filter", "sleepDelay")
_JPEG: Final = (".jpg", ".jpeg")
_REJOIN: Final = tr(
    "Join the camera’s Wi-Fi again and stay near it; restart the camera if it does "
    "not answer. Its photos are safe: open this session again to continue."
)

_SEEKING: Final = tr("The camera is out of reach; reconnecting")
_T = TypeVar("_T")


class Say(Protocol):
    """Function that shows a message and the seconds left, with `seeking` set while reconnecting."""

    def __call__(self, message: str, left_s: float | None, /, *, seeking: bool = False) -> None:
        """Show the message."""


class Contact:
    """A camera that may be busy or unreachable for a while.

    Args:
        say: Function that receives the progress of reconnecting and the seconds left.
        rejoin_s: Time limit for reconnecting, in seconds.
    """

    def __init__(
        self,
        client: OscClient,
        clock: Clock,
        token: Token | None,
        say: Say,
        rejoin_s: float = REJOIN_S,
    ) -> None:
        self.client, self.clock, self.token, self.say = client, clock, token, say
        self.losses = 0
        self.serial = ""
        self.forgets = False
        self.changed_at = -1e9
        self._settings: dict[str, Any] = {}
        self._has_met = False
        self._started_s = -1e9
        self._switches_api = False
        self._rejoin_s = rejoin_s
        self._patience_s = PATIENCE_S
        self._shooting_s = _SHOOTING_S

    def unstoppable(self, rejoin_s: float) -> Contact:
        """Return a contact for the final steps, which cannot be cancelled and have less time."""
        other = copy(self)
        other.token, other._rejoin_s, other._patience_s = None, rejoin_s, PATIENCE_S
        other._shooting_s = _LAST_SHOOTING_S
        return other

    def pause(self, seconds: float) -> None:
        """Wait for the given number of seconds.

        Raises:
            Cancelled: If the token is cancelled.
        """
        wait(self.clock, seconds, self.token)

    def ask(self, call: Callable[[], _T], passing: Collection[str] = ()) -> _T:
        """Repeat a call until it succeeds. The call must be safe to repeat.

        Args:
            passing: Codes of temporary refusals, in addition to those of a busy camera.

        Raises:
            DeviceError: If the camera refuses, or does not answer after all retries.
            Cancelled: If the token is cancelled.
        """
        failures = 0
        while True:
            try:
                return self.once(call, passing)
            except LOSSES:
                failures += 1
                if failures >= _TRIES:
                    raise
                self.reconnect()
                if failures > 1:
                    self.pause(
                        min(PAUSES_S[min(failures - 2, len(PAUSES_S) - 1)], _LONGEST_PAUSE_S)
                    )

    def once(self, call: Callable[[], _T], passing: Collection[str] = ()) -> _T:
        """Make a call, repeating it while the camera is busy but never after a connection loss.

        Raises:
            DeviceError: Any error of the call that is not temporary.
            Cancelled: If the token is cancelled.
        """
        began, number, switches = self.clock.now(), 0, 0
        while True:
            if self.token is not None:
                self.token.check()
            try:
                return call()
            except CameraRefused as error:
                if switches < _SWITCHES and self._fell_back(error):
                    switches += 1
                    continue
                patience = _patience(error, passing)
                pause = PAUSES_S[min(number, len(PAUSES_S) - 1)]
                if self.clock.now() + pause - began > patience:
                    raise
            number += 1
            self.pause(pause)

    def meet(self, longest_s: float = _FIRST_S) -> Info:
        """Make the first contact, with a short time limit in case the device is not a camera."""
        return self._greet(longest_s)

    def reconnect(self) -> None:
        """Retry until the camera answers, and switch it to API 2.1.

        Raises:
            Unreachable: If the camera does not answer in time.
            CameraNotReady: If another camera answers.
            PasswordNeeded: If the camera keeps requiring a password.
            Cancelled: If the token is cancelled.
        """
        if not self._has_met:
            self.meet()
            return
        began, patience = self.clock.now(), self._patience_s
        self._patience_s = 0.0  # Do not wait a second time after waiting in vain.
        self._greet(min(self._rejoin_s, patience))
        self._patience_s = max(patience - (self.clock.now() - began), 0.0)
        self.losses += self.forgets and self._lost_settings()

    def hello(self) -> Info:
        """Identify the camera and switch it to API 2.1.

        Raises:
            DeviceError: If nothing answers, or a different camera answers.
        """
        info = self.client.info()
        if self.serial and info.serial_number != self.serial:
            raise CameraNotReady(
                tr(
                    "A different camera is answering ({model}, {serial}).",
                    model=info.model,
                    serial=info.serial_number,
                ),
                tr("Join the Wi-Fi of the camera that captured this place, or use a new folder."),
                "other-camera",
            )
        if info.uptime_s is not None:
            boot_s = self.clock.now() - info.uptime_s
            self.losses += self._has_met and boot_s > self._started_s + _RESTARTED_S
            self._started_s = max(boot_s, self._started_s)
        self._has_met = True
        self._switches_api = 1 in info.api_level
        self._leave_old_api()
        return info

    def _greet(self, longest_s: float) -> Info:
        """Repeat `hello` until the camera answers. After a few seconds, report the time left."""
        began = self.clock.now()
        until = began + longest_s
        first = FirstContact(self.clock, silences=_SILENCES)
        while True:
            try:
                info = self.hello()
                break
            except LOSSES as error:
                final = isinstance(error, PasswordNeeded) or not self._has_met
                if first.hopeless(error) and final:
                    raise
            except CameraRefused as error:
                if _patience(error, NOT_NOW) <= 0.0:
                    raise
            pause = first.pause_s()
            if self.clock.now() + pause > until:
                raise Unreachable(tr("The connection to the camera was lost."), _REJOIN, "lost")
            self._count_down(pause, until, silent=self.clock.now() - began < _UNSAID_S)
        if self.clock.now() - began >= _UNSAID_S:
            self.say(RECONNECTED, None)
        return info

    def _count_down(self, seconds: float, until: float, *, silent: bool) -> None:
        end = self.clock.now() + seconds
        while (remaining_s := end - self.clock.now()) > 0.0:
            if not silent:
                self.say(_SEEKING, until - self.clock.now(), seeking=True)
            self.pause(min(remaining_s, 1.0))

    def note_settings(self, options: Mapping[str, Any]) -> None:
        """Record the options that the camera has accepted."""
        marks = {name: options[name] for name in _MARKS if name in options}
        self._settings = self._settings | marks

    def _lost_settings(self) -> bool:
        """Return whether the camera's options differ from those that were set.

        A camera that forgets its settings does so when a new connection is made, not when a reply
        is lost.
        """
        settings, self._settings = self._settings, {}
        if not settings:
            return True
        for pause in (*PAUSES_S, 0.0):
            try:
                values = self.client.get_options(tuple(settings))
            except LOSSES:
                self.pause(pause)
                continue
            except CameraRefused:
                break
            if any(values.get(name) != value for name, value in settings.items()):
                break
            self._settings = settings
            return False
        return True

    def _leave_old_api(self) -> bool:
        """Switch an S or SC back to API 2.1, and return whether it had reverted to API 2.0."""
        if not self._switches_api or self.client.state().api_version != 1:
            return False
        self.losses += self._has_met
        self._switch_api()
        return True

    def _switch_api(self) -> None:
        """Switch the API, and keep trying while the camera refuses because it is shooting."""
        until, idle = self.clock.now() + self._shooting_s, 0
        while True:
            try:
                self.client.use_api_2()
            except CameraRefused as error:
                idle = idle + 1 if self.client.state().idle else 0
                late = idle > _NOT_NOW_S or self.clock.now() > until
                if error.code not in NOT_NOW or late:
                    raise
            else:
                return
            self.say(tr("Waiting until the camera has finished shooting"), None)
            self.pause(1.0)

    def _fell_back(self, error: CameraRefused) -> bool:
        """Return whether an S or SC had reconnected with API 2.0 and was switched back."""
        return error.code in _OLD_API and self._leave_old_api()


def _patience(error: CameraRefused, passing: Collection[str]) -> float:
    """Return how long to retry after a refusal, in seconds."""
    if error.code in passing:
        return _NOT_NOW_S
    return _BUSY_S if error.code in BUSY or error.status == 503 else 0.0


def find_frames(
    contact: Contact,
    frame_count: int,
    *,
    urls: Sequence[str] = (),
    group_id: str = "",
    previous: str = "",
) -> tuple[FileEntry, ...]:
    """Find the frames of a bracket among the camera's files.

    The frames are identified by `urls` if the camera has named them, by the `group_id` of their
    entries, or by being newer than `previous`, the newest file before the bracket. At most
    `frame_count` entries are returned, in shooting order.
    """
    count = min(frame_count + _SPARE, _MOST_LISTED)
    entries = contact.ask(lambda: contact.client.list_files(count))
    pictures = {_path(entry.url): entry for entry in entries if entry.name.lower().endswith(_JPEG)}
    named_files = [pictures[path] for path in dict.fromkeys(map(_path, urls)) if path in pictures]
    if len(named_files) >= frame_count:
        return shooting_order(named_files)[:frame_count]
    newer = _newer(tuple(pictures.values()), previous)
    files = _group(newer, group_id) or _one_folder(newer, frame_count)
    best = named_files if len(named_files) > len(files) else files
    return shooting_order(best)[:frame_count]


def newest_address(entries: Sequence[FileEntry], stated_url: str) -> str:
    """Return the URL of the newest file, or "" if there is none.

    Args:
        entries: Files, newest first.
        stated_url: URL of the newest file in the camera's state. That file may already have been
            deleted.
    """
    if any(_path(entry.url) == _path(stated_url) for entry in entries):
        return stated_url
    likely = shooting_order(_one_folder(entries, 1))
    return likely[-1].url if likely else ""


def _newer(entries: Sequence[FileEntry], previous: str) -> list[FileEntry]:
    """Return the entries newer than `previous`, or with higher URLs if that file was deleted."""
    path = _path(previous)
    if not any(_path(entry.url) == path for entry in entries):
        return [entry for entry in entries if _place(entry.url) > _place(previous)]
    return list(takewhile(lambda entry: _path(entry.url) != path, entries))


def _one_folder(entries: Sequence[FileEntry], count: int) -> list[FileEntry]:
    """Return the entries in the most common folder, or all entries if it has fewer than `count`."""
    folders = Counter(_place(entry.url)[0] for entry in entries)
    if not folders:
        return []
    folder, number = folders.most_common(1)[0]
    if number < count:
        return list(entries)
    return [entry for entry in entries if _place(entry.url)[0] == folder]


def _place(url: str) -> tuple[str, str]:
    folder, _, name = _path(url).rpartition("/")
    return folder, name


def _path(url: str) -> str:
    """Return only the path of a URL, since the host changes with the network."""
    _, absolute, rest = url.partition("://")
    return f"/{rest.partition('/')[2]}" if absolute else url


def shooting_order(entries: Sequence[FileEntry]) -> tuple[FileEntry, ...]:
    """Sort by URL, since cameras number files upwards and then start a new folder."""
    return tuple(sorted(entries, key=lambda entry: _place(entry.url)))


def _group(entries: Sequence[FileEntry], group_id: str) -> list[FileEntry]:
    """Return the entries in a group, or in the newest group if `group_id` is empty."""
    group_name = group_id or next((entry.group_id for entry in entries if entry.group_id), "")
    return [entry for entry in entries if group_name and entry.group_id == group_name]
