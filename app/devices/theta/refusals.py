"""What a camera's error codes mean to a photographer, and what to do about each."""

from __future__ import annotations

import re
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from app.devices.errors import CameraRefused

if TYPE_CHECKING:
    from collections.abc import Mapping

BUSY: Final = "serviceUnavailable"
"""The one code after which the same request may simply be sent again."""

_UPDATE: Final = "Update the camera's firmware with Ricoh's app; if it is new, tell us the model."
_RESTART: Final = "Restart the camera, then try again."
_WAIT: Final = "Wait a few seconds, then try again."

REFUSALS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "unknownCommand": ("The camera does not know this command.", _UPDATE),
        "missingParameter": ("The camera misses something in the request.", _UPDATE),
        "invalidParameterName": ("The camera does not know one of the settings.", _UPDATE),
        "invalidParameterValue": (
            "The camera does not accept a value, or the file is no longer on it.",
            "Connect again, so that the camera's own lists are read anew.",
        ),
        "tooManyParameters": ("The camera was given too much at once.", _UPDATE),
        "disabledCommand": (
            "The camera cannot do this at the moment.",
            "Wait until it has finished, close plug-ins, set it to still pictures, then try again.",
        ),
        "corruptedFile": (
            "A file on the camera is damaged.",
            "Take the picture again; if it happens often, check the camera's storage.",
        ),
        "powerOffSequenceRunning": (
            "The camera is switching itself off.",
            "Switch it on again and charge it if needed.",
        ),
        "invalidFileFormat": (
            "The camera cannot store pictures in this format.",
            "Choose another picture size.",
        ),
        "canceledShooting": ("The shot was cancelled on the camera.", "Start it again."),
        "canceledConversion": ("The conversion was cancelled on the camera.", "Start it again."),
        BUSY: ("The camera is busy.", _WAIT),
        "unexpected": ("The camera reports a fault of its own.", _RESTART),
        "serverError": ("The camera reports a fault of its own.", _RESTART),
        "notFound": (
            "This is not on the camera.",
            "The file may have been deleted; look at the camera's pictures.",
        ),
        "invalidSessionId": ("The camera has ended the connection.", "Connect again."),
        "cameraInExclusiveUse": (
            "Another app is using the camera.",
            "Close it on the other device, or switch the camera's Wi-Fi off and on.",
        ),
        "unactivated": (
            "The camera is not activated yet.",
            "Activate it with its maker's app, then connect again.",
        ),
    }
)
"""Error code of the camera: a sentence, and what to do next."""

_UNKNOWN: Final = ("The camera refused.", _WAIT)
_CODE: Final = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,59}")
_BY_STATUS: Final = MappingProxyType({404: "notFound", 416: "invalidParameterValue", 503: BUSY})


def refusal(code: str, status: int, said: str = "") -> CameraRefused:
    """Make the error for what a camera answered.

    Parameters
    ----------
    code : str
        The camera's; one that does not look like a code is taken as "unexpected".
    said : str, optional
        The camera's own sentence, shown only for a code that `REFUSALS` does not know.

    Returns
    -------
    CameraRefused
        With code and status kept.
    """
    sound = code if _CODE.fullmatch(code) else "unexpected"
    sentence, hint = REFUSALS.get(sound, _UNKNOWN)
    if sound not in REFUSALS:
        sentence = f'The camera refused: "{said or sound}".'
    return CameraRefused(sentence, hint, sound, status)


def code_of_status(status: int) -> str:
    """Give the error code for a reply that has only an HTTP status."""
    return _BY_STATUS.get(status, "unexpected")
