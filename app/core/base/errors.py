"""Errors that the user can act on, each with one clear sentence and perhaps a hint.

None of them derives from `RuntimeError`, since a job runner could mistake one for its own failure.
The user never sees a traceback, since `app.cli` prints the sentence instead.
"""

from __future__ import annotations

from app.core.base.catalogue import tr


class CoreError(Exception):
    """An error that the user can act on, with one sentence and perhaps a hint.

    Args:
        hint: Advice to the user, as a second sentence, or "" if there is none.

    Examples:
        >>> print(CoreError("The file is empty.", "Copy it again."))
        The file is empty. Copy it again.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        """Return the message, followed by the hint if there is one."""
        return f"{self.message} {self.hint}" if self.hint else self.message


class EnvironmentFileError(CoreError):
    """A panorama cannot be read or is not an environment (wrong shape, black or damaged)."""


class TransportError(CoreError):
    """A light transport or style pack is missing, damaged, too new or unsuitable."""


class StyleError(CoreError):
    """A style is unknown, or its file is invalid."""


class HeadError(CoreError):
    """A head or its eyes cannot be read or are not usable meshes."""


class BakeError(CoreError):
    """A light transport cannot be computed."""


class Cancelled(CoreError):
    """The user cancelled a task."""

    def __init__(self, message: str = "", hint: str = "") -> None:
        super().__init__(message or tr("Cancelled."), hint)


class ProbeError(CoreError):
    """A bracket of exposures cannot be read or merged."""
