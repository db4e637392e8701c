"""A camera's error codes, with a sentence and a hint for each."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from app.core.text import tr
from app.devices.errors import CameraRefused
from app.devices.theta.untrusted import JsonValue, table, words

BUSY: Final = "serviceUnavailable"
"""The only error code after which the same request may be repeated."""

_UPDATE: Final = tr(
    "Update the camera’s firmware with Ricoh’s app; if it is current, report the camera’s model."
)
_RESTART: Final = tr("Restart the camera, then try again.")
_WAIT: Final = tr("Wait a few seconds, then try again.")

REFUSALS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "unknownCommand": (tr("The camera does not know this command."), _UPDATE),
        "missingParameter": (tr("The request to the camera was incomplete."), _UPDATE),
        "invalidParameterName": (tr("The camera does not know one of the settings."), _UPDATE),
        "invalidParameterValue": (
            tr("The camera does not accept a value, or the file is no longer on it."),
            tr("Reconnect the camera."),
        ),
        "tooManyParameters": (tr("The request to the camera had too many parameters."), _UPDATE),
        "disabledCommand": (
            tr("The camera cannot do this at the moment."),
            tr(
                "Wait until it has finished, close plug-ins, set the camera to photos, then try "
                "again."
            ),
        ),
        "corruptedFile": (
            tr("A file on the camera is damaged."),
            tr("Shoot again; if it happens often, check the camera’s storage."),
        ),
        "powerOffSequenceRunning": (
            tr("The camera is switching itself off."),
            tr("Switch it on again and charge it if needed."),
        ),
        "invalidFileFormat": (
            tr("The camera cannot save photos in this format."),
            tr("Choose another photo size."),
        ),
        "canceledShooting": (tr("The shot was cancelled on the camera."), tr("Start it again.")),
        "canceledConversion": (
            tr("The conversion was cancelled on the camera."),
            tr("Start it again."),
        ),
        BUSY: (tr("The camera is busy."), _WAIT),
        "unexpected": (tr("The camera has an internal error."), _RESTART),
        "serverError": (tr("The camera has an internal error."), _RESTART),
        "notFound": (
            tr("The file is not on the camera."),
            tr("It may have been deleted; check the photos on the camera."),
        ),
        "invalidSessionId": (tr("The camera closed the connection."), tr("Reconnect the camera.")),
        "cameraInExclusiveUse": (
            tr("Another app is using the camera."),
            tr("Close that app on the other device, or switch the camera’s Wi-Fi off and on."),
        ),
        "unactivated": (
            tr("The camera is not activated yet."),
            tr("Activate it with the manufacturer’s app, then reconnect."),
        ),
    }
)
"""A sentence and a hint for each of the camera's error codes."""

_UNKNOWN: Final = (tr("The camera refused the request."), _WAIT)
_CODE: Final = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,59}")
_BY_STATUS: Final = MappingProxyType({404: "notFound", 416: "invalidParameterValue", 503: BUSY})


def refused(value: JsonValue, status: int) -> CameraRefused | None:
    """Return the error contained in a message, or None if there is none."""
    message = table(value)
    error = message.get("error")
    if not isinstance(error, dict) and message.get("state") != "error":
        return None
    fields = table(error)
    return refusal(words(fields.get("code")), status, words(fields.get("message")))


def bare_refusal(status: int) -> CameraRefused:
    """Return the error for a reply that contains nothing but an HTTP status."""
    return refusal(_BY_STATUS.get(status, "unexpected"), status)


def refusal(code: str, status: int, message: str = "") -> CameraRefused:
    """Return the error for a camera's error code.

    Args:
        code: The camera's code. Anything that does not look like a code becomes "unexpected".
        message: The camera's own message, shown only if the code is not in `REFUSALS`.
    """
    sound = code if _CODE.fullmatch(code) else "unexpected"
    sentence, hint = REFUSALS.get(sound, _UNKNOWN)
    if sound not in REFUSALS:
        sentence = tr("The camera refused the request: “{said}”.", said=message or sound)
    return CameraRefused(sentence, hint, sound, status)
