"""Errors of cameras and networks: one clear sentence, what to do next, and a code.

They are a family of their own, apart from `CoreError`: the command line ends with 3 for these. None
derives from `RuntimeError` or `OSError`, so that no job runner and no library can mistake one for
its own failure.
"""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Final, TypeVar

from app.core.text import tr

DISK: Final = frozenset({"disk", "disk-full"})
"""Codes of errors that are this computer's own: its disk takes no more."""

_NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class DeviceError(Exception):
    """A camera or the way to it fails, and what to do about it.

    * `hint`: what to do next, as a second sentence.
    * `code`: stable word for programs: the camera's own error code where it gave one
      ("disabledCommand"), else ours ("timeout", "not-a-camera").

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
        """Return the message, followed by the hint where there is one."""
        return f"{self.message} {self.hint}" if self.hint else self.message


class Unreachable(DeviceError):
    """Nothing answers in time, or the connection broke: trying again later may help."""

    default_code = "unreachable"


class NotACamera(DeviceError):
    """Something answers, but it is no camera of this kind: a router, a web page."""

    default_code = "not-a-camera"


class PasswordNeeded(DeviceError):
    """The camera wants a user name and password, or refuses the ones it was given."""

    default_code = "password"


class CameraRefused(DeviceError):
    """The camera answered with an error.

    `message`, `hint`, `code`: as in `DeviceError`; `code` is the camera's.
    """

    default_code = "refused"

    def __init__(self, message: str, hint: str = "", code: str = "", status: int = 0) -> None:
        super().__init__(message, hint, code)
        self.status = status


class BadReply(DeviceError):
    """The camera's response is invalid, too large, or never ends."""

    default_code = "bad-reply"


class CameraNotReady(DeviceError):
    """The camera cannot shoot as it is: battery, storage, heat, plug-in, firmware."""

    default_code = "not-ready"


class CaptureFailed(DeviceError):
    """A bracket could not be taken or is not what was asked for; what there is was kept."""

    default_code = "capture-failed"


class DownloadFailed(DeviceError):
    """A file could not be brought over whole; what came was kept and can be continued."""

    default_code = "download-failed"


_Failed = TypeVar("_Failed", bound=DeviceError)

LOSSES: Final = (Unreachable, BadReply, NotACamera, PasswordNeeded)
"""Errors after which the camera may be there all the same, once it has answered."""


def not_written(kind: type[_Failed], folder: Path, error: OSError) -> _Failed:
    """Say why a folder takes no file, in the same words whatever was to be written there."""
    reason = (error.strerror or str(error) or type(error).__name__).rstrip(".").lower()
    hint = tr("Check the folder and its disk, then try again.")
    if error.errno in _NO_ROOM:
        hint = tr("Make room on the disk, then try again.")
    return kind(
        tr("Cannot write into {folder}: {reason}.", folder=folder, reason=reason), hint, "disk"
    )
