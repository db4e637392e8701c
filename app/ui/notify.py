"""Telling the user things: toasts now, a list of them for later, and errors in their own words."""

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.errors import CoreError
from app.devices.errors import DeviceError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from datetime import datetime

    from app.ui.presenters.services import Action, Kind
    from app.ui.widgets.toasts import Toasts

__all__ = ["Message", "Notify"]

_MOST_KEPT: Final = 200
_OURS: Final = (
    "Something went wrong inside Turnlight. What you measured and painted is kept; "
    "try it again, or start Turnlight anew."
)
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Message:
    """Something that was told.

    Attributes
    ----------
    moment : datetime
        When.
    text : str
        What.
    kind : str
        ``info``, ``done``, ``warning`` or ``error``.
    """

    moment: datetime
    text: str
    kind: Kind


class Notify:
    """The window's `app.ui.presenters.services.Notifier`.

    Parameters
    ----------
    today : callable
        The time of day.
    """

    def __init__(self, today: Callable[[], datetime]) -> None:
        self._today = today
        self._toasts: Toasts | None = None
        self._kept: deque[Message] = deque(maxlen=_MOST_KEPT)
        self._waiting: list[tuple[str, Kind, Sequence[Action]]] = []

    @property
    def messages(self) -> tuple[Message, ...]:
        """What was told since the start, the newest last."""
        return tuple(self._kept)

    def attach(self, toasts: Toasts | None) -> None:
        """Show messages there from now on; what was told before is shown first.

        Parameters
        ----------
        toasts : Toasts or None
            None while the window is rebuilt.
        """
        self._toasts = toasts
        if toasts is not None:
            for text, kind, actions in self._waiting:
                toasts.tell(text, kind=kind, actions=actions)
            self._waiting.clear()

    def tell(self, message: str, *, kind: Kind = "info", actions: Sequence[Action] = ()) -> None:
        """Show one sentence; see `app.ui.presenters.services.Notifier.tell`."""
        self._kept.append(Message(self._today(), message, kind))
        if self._toasts is None:
            self._waiting.append((message, kind, actions))
        else:
            self._toasts.tell(message, kind=kind, actions=actions)

    def tell_error(self, error: Exception, *, actions: Sequence[Action] = ()) -> None:
        """Show an error; see `app.ui.presenters.services.Notifier.tell_error`."""
        if isinstance(error, (CoreError, DeviceError)):
            self.tell(str(error), kind="error", actions=actions)
        elif isinstance(error, OSError):
            self.tell(_file_words(error), kind="error", actions=actions)
        else:
            _log.error("unexpected", exc_info=error)
            self.tell(_OURS, kind="error", actions=actions)


def _file_words(error: OSError) -> str:
    reason = (error.strerror or str(error) or type(error).__name__).rstrip(".")
    name = f"{error.filename}: " if error.filename else ""
    return f"{name}{reason}. Nothing was overwritten."
