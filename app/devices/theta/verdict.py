"""From the first look at a reply to what it means: an answer, a refusal, or no camera at all."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from app.devices.errors import BadReply, CameraRefused
from app.devices.theta.failures import no_camera
from app.devices.theta.refusals import code_of_status, refusal
from app.devices.theta.untrusted import JsonValue, parse_json, table, words

if TYPE_CHECKING:
    from app.devices.theta.reply import Reply

_OK: Final = 200
_STREAMS: Final = frozenset({200, 206})
_NOT_OK: Final = 300
_ERRORS: Final = 400
_SERVER_ERRORS: Final = 500
_ELSEWHERE: Final = frozenset({404, 405, 407, 410, 421, 426, 451, 511})
_ERROR_BYTES: Final = 65536
_PAGE: Final = re.compile(rb"[\s\xef\xbb\xbf]*<")


def judge_json(reply: Reply, data: bytes) -> JsonValue:
    """Read a reply that should be JSON.

    Returns
    -------
    JsonValue
        The value; an error object inside a good reply is left to the reader of the message.

    Raises
    ------
    CameraRefused
        For an HTTP error, with the camera's code where it gave one.
    NotACamera
        For a web page, a redirect or a path that nobody knows.
    BadReply
        For anything else that is no JSON.
    """
    if _OK <= reply.status < _NOT_OK:
        if _is_page(reply, data):
            raise no_camera()
        return parse_json(data)
    error = _error_within(data, reply.status)
    if error is not None:
        raise error
    elsewhere = reply.status < _ERRORS or reply.status in _ELSEWHERE
    if elsewhere or (reply.status < _SERVER_ERRORS and _is_page(reply, data)):
        raise no_camera()
    raise refusal(code_of_status(reply.status), reply.status)


def judge_stream(reply: Reply) -> None:
    """Make sure that a reply is something to be streamed.

    Raises
    ------
    CameraRefused
        For an HTTP error, and for an error object where a file should be; 404 is "notFound".
    NotACamera
        For a redirect, and for a web page where a file should be.
    BadReply
        For a reply of any other kind.
    """
    kind = reply.headers.get("content-type", "").lower()
    if reply.status in _STREAMS:
        if "html" in kind:
            raise no_camera()
        if "json" not in kind:
            return
    data = reply.whole(_ERROR_BYTES)
    error = _error_within(data, reply.status)
    if error is not None:
        raise error
    if _NOT_OK <= reply.status < _ERRORS:
        raise no_camera()
    if reply.status >= _ERRORS:
        raise refusal(code_of_status(reply.status), reply.status)
    raise BadReply("The camera sent something else than the file.", "Try again.")


def refused(value: JsonValue, status: int) -> CameraRefused | None:
    """Find an error object in a message."""
    message = table(value)
    error = message.get("error")
    if not isinstance(error, dict) and message.get("state") != "error":
        return None
    fields = table(error)
    return refusal(words(fields.get("code")), status, words(fields.get("message")))


def _error_within(data: bytes, status: int) -> CameraRefused | None:
    with suppress(BadReply):
        return refused(parse_json(data), status)
    return None


def _is_page(reply: Reply, data: bytes) -> bool:
    return "html" in reply.headers.get("content-type", "").lower() or bool(_PAGE.match(data))
