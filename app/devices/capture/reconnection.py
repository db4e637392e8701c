"""Retries, reconnecting, and how a bracket is found after a connection loss.

A *loss* is a request without a usable reply: a timeout, a broken connection, garbage, and, once the
camera has answered, a router's page, a redirect or a 401 instead.

============================= ============================= ======================================
error                         while                         what is done
============================= ============================= ======================================
a loss                        first contact                 again: a page, a password or a refused
                                                            connection three times, cut or garbled
                                                            replies for 20 s, silence for a minute
a loss                        asking (info, state, options, the camera greets again, is sought for
                              status, list), changing       three minutes if need be, and this one
                              options, deleting             question is put again, up to seven times
a loss                        the same, on a camera that    `Contact.forgotten` counts it: the
                              forgot (SC2 whose options     caller sets up everything from the
                              differ from what was set; S   start
                              and SC that are back at API
                              2.0; any that was switched
                              off and on)
a loss                        starting an exposure          never simply repeated: the camera may
                                                            have heard it. State and file list tell;
                                                            only if nothing happened, start again,
                                                            four times at most
a loss                        fetching a file               `download` continues it by itself; then
                                                            the connection is sought and it is
                                                            continued twice more
a loss                        putting settings back         for 20 s; else the journal keeps them
                                                            and the message says so
`CameraRefused`: busy         anything                      again after pauses that grow, 30 s long
(serviceUnavailable, 503,
unexpected)
`CameraRefused`:              options, starting             again for 8 s: a preview may be closing;
disabledCommand                                             then a bracket becomes single pictures
`CameraRefused`:              options                       the option is left out if it can be; of
invalidParameter*                                           a bracket: without white balance (X),
                                                            then single pictures
`CameraRefused`: id or file   status                        the state is watched instead
not known
`CameraRefused`:              status                        `CaptureFailed`: stopped at the camera
canceledShooting
`CameraRefused`: unknown      anything, on S and SC         API 2.1 is switched on again, if it is
command or parameter                                        off, and the question put once more,
                                                            twice at most
`CameraRefused`:              switching an S or SC to       again as long as it shoots, ten minutes
disabledCommand               API 2.1                       at most, at the end of a capture one
`CameraRefused`: others       anything                      never
`PasswordNeeded`              three greetings in a row      ends the capture
`CameraNotReady`, `CoreError` anything                      never
`Cancelled`                   anything                      never; exposing is stopped, settings are
                                                            put back, files stay
============================= ============================= ======================================

All waits for a lost camera together last at most `PATIENCE_S`, so that a capture always ends.
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
"""Codes of a camera that is busy."""

NOT_NOW: Final = frozenset({"disabledCommand"})
"""Codes of a camera that cannot execute the command yet."""

REJOIN_S: Final = 180.0
"""How long to try to reconnect, in seconds."""

PATIENCE_S: Final = 420.0
"""How long to try to reconnect in one capture altogether, in seconds."""

_OLD_API: Final = frozenset({"unknownCommand", "missingParameter", "invalidParameterName"})
_FIRST_S: Final = 60.0
_SILENCES: Final = 1000  # Timeouts are limited by the total time.
_TRIES: Final = 8
_LONGEST_PAUSE_S: Final = 2.0  # The greeting before has waited, too.
_SWITCHES: Final = 2
_BUSY_S: Final = 30.0
_NOT_NOW_S: Final = 8.0
_UNSAID_S: Final = 4.0
_RESTARTED_S: Final = 5.0
_SPARE: Final = 12
_MOST_LISTED: Final = 100
_SHOOTING_S: Final = 600.0
_LAST_SHOOTING_S: Final = 60.0
# Every capture sets these and no other option changes them: they show a loss of settings.
_MARKS: Final = ("captureMode", "exposureProgram", "whiteBalance", "_filter", "sleepDelay")
_JPEG: Final = (".jpg", ".jpeg")
_REJOIN: Final = tr(
    "Join the camera's Wi-Fi again and stay near it; restart the camera if it does "
    "not answer. Its photos are safe: open this session again to continue."
)

_SEEKING: Final = tr("The camera is out of reach; reconnecting")
_T = TypeVar("_T")


class Say(Protocol):
    """Shows a message and the seconds left; `seeking` while it reconnects."""

    def __call__(self, message: str, left_s: float | None, /, *, seeking: bool = False) -> None:
        """Show it."""


class Contact:
    """A camera that may be busy or out of reach for a while.

    * `say`: receives the progress of reconnecting, with the seconds left.
    * `rejoin_s`: how long to try to reconnect, in seconds.
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
        """Return the same camera for the final steps: not cancellable, with shorter waits."""
        other = copy(self)
        other.token, other._rejoin_s, other._patience_s = None, rejoin_s, PATIENCE_S
        other._shooting_s = _LAST_SHOOTING_S
        return other

    def pause(self, seconds: float) -> None:
        """Wait. Raises `Cancelled` when the token is cancelled."""
        wait(self.clock, seconds, self.token)

    def ask(self, call: Callable[[], _T], passing: Collection[str] = ()) -> _T:
        """Make a call that may be repeated, until it succeeds.

        `passing`: codes of temporary refusals, besides those of a busy camera.

        Raises `DeviceError` if the camera refuses, or does not answer after all retries;
        `Cancelled` when the token is cancelled.
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
        """Make a call that must not be repeated after a loss, only while the camera is busy.

        Raises every `DeviceError` of the call that is not temporary; `Cancelled` when the token is
        cancelled.
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
        """Make the first contact, with a shorter wait: the device may not be a camera at all."""
        return self._greet(longest_s)

    def reconnect(self) -> None:
        """Try until the camera answers, and switch it to API 2.1.

        Raises `Unreachable` if it does not answer in time; `CameraNotReady` if another camera
        answers; `PasswordNeeded` if it insists on a password; `Cancelled` when the token is
        cancelled.
        """
        if not self._has_met:
            self.meet()
            return
        began, patience = self.clock.now(), self._patience_s
        self._patience_s = 0.0  # After a wait in vain there is no second wait.
        self._greet(min(self._rejoin_s, patience))
        self._patience_s = max(patience - (self.clock.now() - began), 0.0)
        self.losses += self.forgets and self._lost_settings()

    def hello(self) -> Info:
        """Identify the camera and switch it to API 2.1.

        Raises `DeviceError` if it does not answer, or is not the same camera as before.
        """
        info = self.client.info()
        if self.serial and info.serial_number != self.serial:
            raise CameraNotReady(
                tr(
                    "Another camera answers now ({model}, {serial}).",
                    model=info.model,
                    serial=info.serial_number,
                ),
                tr("Join the Wi-Fi of the camera that took this place, or use a new folder."),
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
        """Repeat `hello` until the camera answers; report the time left after some seconds."""
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
            self.say(tr("Reconnected to the camera"), None)
        return info

    def _count_down(self, seconds: float, until: float, *, silent: bool) -> None:
        end = self.clock.now() + seconds
        while (remaining_s := end - self.clock.now()) > 0.0:
            if not silent:
                self.say(_SEEKING, until - self.clock.now(), seeking=True)
            self.pause(min(remaining_s, 1.0))

    def note_settings(self, options: Mapping[str, Any]) -> None:
        """Record options that the camera has accepted."""
        marks = {name: options[name] for name in _MARKS if name in options}
        self._settings = self._settings | marks

    def _lost_settings(self) -> bool:
        """Whether the camera's options differ from those that were set.

        A lost reply does no harm to a forgetful camera; a new connection does.
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
        """Switch an S or SC to API 2.1 again; return whether it had fallen back to the old one."""
        if not self._switches_api or self.client.state().api_version != 1:
            return False
        self.losses += self._has_met
        self._switch_api()
        return True

    def _switch_api(self) -> None:
        """Switch the API, which is refused while the camera shoots."""
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
        """Whether an S or SC reconnected unnoticed with API 2.0; if so, switch it."""
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

    They are identified by `urls` if the camera has named them, by the `group_id` of their entries,
    or because they are newer than `previous`, the newest file before the bracket. Returns up to
    `frame_count` entries in the order of shooting.
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
    """Return the URL of the newest file, "" if there is none.

    `entries`: the newest first. `stated_url`: the newest file in the camera's state, which may be
    deleted already.
    """
    if any(_path(entry.url) == _path(stated_url) for entry in entries):
        return stated_url
    likely = shooting_order(_one_folder(entries, 1))
    return likely[-1].url if likely else ""


def _newer(entries: Sequence[FileEntry], previous: str) -> list[FileEntry]:
    """Return the entries newer than `previous`; if that is deleted, those with higher URLs."""
    path = _path(previous)
    if not any(_path(entry.url) == path for entry in entries):
        return [entry for entry in entries if _place(entry.url) > _place(previous)]
    return list(takewhile(lambda entry: _path(entry.url) != path, entries))


def _one_folder(entries: Sequence[FileEntry], count: int) -> list[FileEntry]:
    """Return the entries of the most common folder; all if it has fewer than `count`."""
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
    """Return the path of a URL: the host changes with the network."""
    _, absolute, rest = url.partition("://")
    return f"/{rest.partition('/')[2]}" if absolute else url


def shooting_order(entries: Sequence[FileEntry]) -> tuple[FileEntry, ...]:
    """Sort by URL: cameras count up, and start a new folder when the numbers are used up."""
    return tuple(sorted(entries, key=lambda entry: _place(entry.url)))


def _group(entries: Sequence[FileEntry], group_id: str) -> list[FileEntry]:
    """Return the entries of a group; of the newest group if `group_id` is empty."""
    group_name = group_id or next((entry.group_id for entry in entries if entry.group_id), "")
    return [entry for entry in entries if group_name and entry.group_id == group_name]
