"""Telling the user things: toasts now, a list of them for later, and errors in their own words."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.core.text import tr
from app.devices.errors import DeviceError
from app.ui.presenters.model import Event
from app.ui.presenters.services import Action, Kind

if TYPE_CHECKING:
    from app.ui.widgets.messages import Toasts

_MOST_KEPT: Final = 200
_OURS: Final = tr(
    "Something went wrong inside Turnlight. What you measured and painted is "
    "kept. Try again, or restart Turnlight."
)
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """Something that was told.

    Attributes:
        actions: tuple of (str, callable). What can be done about it.
    """

    moment: datetime
    text: str
    kind: Kind
    actions: tuple[Action, ...] = ()
    about: str = ""


class Notify:
    """The window's `app.ui.presenters.services.Notifier`."""

    def __init__(self, today: Callable[[], datetime]) -> None:
        self.changed = Event()
        self._today = today
        self._toasts: Toasts | None = None
        self._kept: deque[Message] = deque(maxlen=_MOST_KEPT)
        self._standing: list[Message] = []
        self._unread: list[Message] = []
        self._waiting: list[Message] = []

    @property
    def messages(self) -> tuple[Message, ...]:
        """What was told since the start, the newest last."""
        return tuple(self._kept)

    @property
    def unread(self) -> int:
        """How many were told since the list was last looked at; confirmations do not count."""
        return len(self._unread)

    def attach(self, toasts: Toasts | None) -> None:
        """Show messages there from now on; what stands, and what was told before, is shown first.

        Args:
            toasts: None while the window is rebuilt.
        """
        self._toasts = toasts
        if toasts is not None:
            waiting = [one for one in self._waiting if one not in self._standing]
            self._waiting.clear()
            for message in (*self._standing, *waiting):
                self._show(message)

    def tell(
        self,
        message: str,
        *,
        kind: Kind = "info",
        actions: Sequence[Action] = (),
        about: str = "",
        stay: bool = False,
    ) -> None:
        """Show one sentence; see `app.ui.presenters.services.Notifier.tell`."""
        if about:
            self.mended(about)
        one = Message(self._today(), message, kind, tuple(actions), about)
        self._kept.append(one)
        if kind != "done":
            self._unread = [*self._unread, one][-_MOST_KEPT:]
        if stay or kind == "error":
            # Said again, it takes the place of what stands already.
            self._standing = [each for each in self._standing if each.text != message]
            self._standing.append(one)
        self._show(one)
        self.changed.emit()

    def tell_error(
        self, error: Exception, *, actions: Sequence[Action] = (), about: str = ""
    ) -> None:
        """Show an error; see `app.ui.presenters.services.Notifier.tell_error`."""
        if isinstance(error, (CoreError, DeviceError)):
            words = str(error)
        elif isinstance(error, OSError):
            words = _file_words(error)
        else:
            _log.error("unexpected", exc_info=error)
            words = _OURS
        self.tell(words, kind="error", actions=actions, about=about)

    def mended(self, about: str) -> None:
        """Take off the screen what speaks of this: it is over."""
        for message in [each for each in self._standing if each.about == about]:
            self._seen(message)
            if self._toasts is not None:
                self._toasts.drop(message.text)

    def read(self) -> None:
        """Count all messages as read; what stands stays."""
        self._unread.clear()
        self.changed.emit()

    def dismiss(self) -> None:
        """Take every message off the screen."""
        self._standing.clear()
        if self._toasts is not None:
            self._toasts.clear()

    def _show(self, message: Message) -> None:
        if self._toasts is None:
            self._waiting.append(message)
            return
        self._toasts.tell(
            message.text,
            kind=message.kind,
            actions=message.actions,
            stay=message in self._standing,
            closed=lambda: self._seen(message),
        )

    def _seen(self, message: Message) -> None:
        """Forget what was closed by hand, or is mended."""
        self._standing = [each for each in self._standing if each is not message]
        self._unread = [each for each in self._unread if each is not message]
        self.changed.emit()


def _file_words(error: OSError) -> str:
    reason = (error.strerror or str(error) or type(error).__name__).rstrip(".")
    if not error.filename:
        return tr("{reason}. Nothing was overwritten.", reason=reason)
    return tr("{file}: {reason}. Nothing was overwritten.", file=error.filename, reason=reason)
