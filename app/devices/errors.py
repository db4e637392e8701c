"""Errors from cameras and networks, each with a message, a hint and a code.

They are not subclasses of `CoreError`, and commands that raise them end with exit code 3. None of
them derives from `RuntimeError` or `OSError`, since a job runner or library might then mistake them
for failures of its own.
"""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Final, TypeVar

from app.core.text import tr

DISK: Final = frozenset({"disk", "disk-full"})
"""Error codes used when this computer's disk cannot be written to."""

_NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class DeviceError(Exception):
    """A failure of a camera or of the connection to it.

    Args:
        hint: Advice on what to do next, as a second sentence.
        code: A stable word for programs to test: either the camera's own error code
            ("disabledCommand") or one of Turnlight's ("timeout", "not-a-camera").

    Examples:
        >>> print(DeviceError("The camera does not answer.", "Switch its Wi-Fi on."))
        The camera does not answer. Switch its Wi-Fi on.
    """

    default_code = "device"

    def __init__(self, message: str, hint: str = "", code: str = "") -> None:
        super().__init__(message, hint, code)
        self.message = message
        self.hint = hint
        self.code = code or self.default_code

    def __str__(self) -> str:
        """Return the message, followed by the hint if there is one."""
        return f"{self.message} {self.hint}" if self.hint else self.message


class Unreachable(DeviceError):
    """Nothing answered in time, or the connection broke. A later attempt may succeed."""

    default_code = "unreachable"


class NotACamera(DeviceError):
    """The device that answers is not a supported camera but, for example, a router."""

    default_code = "not-a-camera"


class PasswordNeeded(DeviceError):
    """The camera requires a user name and password, or rejects those that were given."""

    default_code = "password"


class CameraRefused(DeviceError):
    """The camera answered with an error.

    Args:
        message, hint, code: As in `DeviceError`, with the camera's own code.
        status: HTTP status of the reply.
    """

    default_code = "refused"

    def __init__(self, message: str, hint: str = "", code: str = "", status: int = 0) -> None:
        super().__init__(message, hint, code)
        self.status = status


class BadReply(DeviceError):
    """The camera's reply is invalid, too large or endless."""

    default_code = "bad-reply"


class CameraNotReady(DeviceError):
    """The camera cannot shoot because of its battery, storage, heat, plug-in or firmware."""

    default_code = "not-ready"


class CaptureFailed(DeviceError):
    """A bracket failed or differs from the plan. Its files stay on disk."""

    default_code = "capture-failed"


class DownloadFailed(DeviceError):
    """A file could not be downloaded completely. The partial download can be resumed."""

    default_code = "download-failed"


_Failed = TypeVar("_Failed", bound=DeviceError)

LOSSES: Final = (Unreachable, BadReply, NotACamera, PasswordNeeded)
"""Errors that may be temporary once the camera has answered."""


def not_written(kind: type[_Failed], folder: Path, error: OSError) -> _Failed:
    """Return the error for a folder that cannot be written to, always with the same wording."""
    reason = (error.strerror or str(error) or type(error).__name__).rstrip(".").lower()
    hint = tr("Check the folder and its disk, then try again.")
    if error.errno in _NO_ROOM:
        hint = tr("Free some disk space, then try again.")
    return kind(
        tr("Cannot write to {folder}: {reason}.", folder=folder, reason=reason), hint, "disk"
    )
