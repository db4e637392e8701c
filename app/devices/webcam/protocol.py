"""What a webcam is to the rest of the program."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.devices.errors import DeviceError

if TYPE_CHECKING:
    from app.devices.mailbox import Mailbox

Bytes: TypeAlias = NDArray[np.uint8]

GUESS_FOV_DEG: Final = 65.0
"""Horizontal field of view to draw with while nothing is known: most webcams have 60 to 78 deg."""


class WebcamError(DeviceError):
    """A webcam cannot be used, or its picture is of no use.

    Codes: ``no-webcam``, ``busy``, ``unplugged``, ``silent`` (no picture comes), ``black``,
    ``frozen``, ``slow``, ``no-views`` (the demo's pictures are missing). Of network cameras:
    ``bad-address``, ``unreachable``, ``not-a-stream``, ``password``, ``password-refused``. Of
    files and folders: ``no-file``, ``bad-file``.
    """

    default_code = "webcam"


class WebcamState(StrEnum):
    """What a webcam is doing.

    ``off`` until it is opened; ``connecting`` for the first time; ``live`` while pictures come;
    ``lost`` when they just stopped; ``retrying`` while it is opened again, however often, and
    while it waits for a password.
    """

    OFF = "off"
    CONNECTING = "connecting"
    LIVE = "live"
    LOST = "lost"
    RETRYING = "retrying"


@dataclass(frozen=True, slots=True, eq=False)
class WebcamFrame:
    """One picture.

    Attributes
    ----------
    picture : (H, W, 3) uint8
        sRGB, as the camera sees it, not mirrored. Not to be written to.
    """

    picture: Bytes = field(repr=False)
    number: int
    received_s: float


class Webcam(Protocol):
    """A webcam; everything may be called from any thread."""

    @property
    def name(self) -> str:
        """Name to show."""

    @property
    def fov_deg(self) -> float | None:
        """Horizontal field of view of its pictures, deg; None while nobody knows it."""

    @property
    def frames(self) -> Mailbox[WebcamFrame]:
        """Where its pictures come; only the newest is kept."""

    @property
    def state(self) -> WebcamState:
        """What it is doing now."""

    @property
    def error(self) -> WebcamError | None:
        """What is wrong: why it is lost, or with its pictures while it is live."""

    @property
    def fps(self) -> float:
        """Pictures per second, lately."""

    @property
    def count(self) -> int:
        """How many pictures have come."""

    def open(self) -> None:
        """Begin, in a thread of its own; returns at once, and does nothing while it runs."""

    def close(self, wait_s: float = 0.5) -> None:
        """End; waits at most so long (real seconds) for the device to be given back."""


class Source(Protocol):
    """Where a webcam's pictures come from; used by one thread."""

    def open(self) -> None:
        """Get hold of the device; raises `WebcamError`."""

    def read(self) -> Bytes | None:
        """Give the next picture, (H, W, 3) uint8 sRGB, new or never written to again.

        None where none came this time; raises `WebcamError` when none will.
        """

    def close(self) -> None:
        """Give the device back; safe when it is not open."""
