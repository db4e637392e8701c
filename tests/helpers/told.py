"""A notifier that keeps what it is told, for presenters without a window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Told"]


@dataclass
class Told:
    """Keeps messages, errors, and the buttons of the newest message."""

    messages: list[str] = field(default_factory=list)
    buttons: dict[str, Callable[[], None]] = field(default_factory=dict)
    errors: list[Exception] = field(default_factory=list)

    def tell(
        self,
        message: str,
        *,
        kind: str = "info",
        actions: Sequence[Any] = (),
        about: str = "",
        stay: bool = False,
    ) -> None:
        """Keep a message."""
        del kind, about, stay
        self.messages.append(message)
        self.buttons = dict(actions)

    def mended(self, about: str) -> None:
        """Nothing is on a screen here."""

    def tell_error(self, error: Exception, *, actions: Sequence[Any] = (), about: str = "") -> None:
        """Keep an error, and its words as a message."""
        self.errors.append(error)
        self.tell(str(error), actions=actions, about=about)
