"""Sources of live video, their text form in the settings, and the cameras created from them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, cast

from app.core.text import tr
from app.devices.clock import Clock
from app.devices.webcam.files import VideoFile
from app.devices.webcam.network import Keys, MjpegWebcam, RtspWebcam, no_keys
from app.devices.webcam.network_connection import Address
from app.devices.webcam.protocol import Webcam, WebcamError
from app.devices.webcam.simulated import DEMO_SIZE, SimulatedWebcam

Kind: TypeAlias = Literal["webcam", "network", "video", "demo"]

FOV_RANGE_DEG: Final = (20.0, 150.0)
"""Permitted range of the horizontal field of view, in degrees."""

WIDTHS: Final = (640, 1280, 1920)
"""Widths that can be requested, in pixels, in addition to 0 for the default."""

_KINDS: Final = ("webcam", "network", "video", "demo")
_MOST_INDEX: Final = 63
_LONGEST: Final = 2000
_MOST_KEPT: Final = 12
_LONGEST_KEPT: Final = 4000


@dataclass(frozen=True, slots=True)
class LiveSource:
    """A source of live video.

    Examples:
        >>> LiveSource.parse("network:rtsp://192.168.1.20:8554/live").kind
        'network'
    """

    kind: Kind
    where: str

    @classmethod
    def webcam(cls, index: int) -> LiveSource:
        """Return the source for one of this computer's webcams."""
        return cls("webcam", str(index))

    @classmethod
    def network(cls, text: str) -> LiveSource:
        """Return the source for a network camera.

        Raises:
            WebcamError: As in `Address.parse`.
        """
        return cls("network", str(Address.parse(text)))

    @classmethod
    def parse(cls, text: str) -> LiveSource:
        """Parse a source from the text that its `text` property returned.

        Raises:
            WebcamError: With the code "bad-address" if the text is invalid.
        """
        kind, colon, where = text.partition(":")
        if not colon or kind not in _KINDS or not where or len(text) > _LONGEST:
            raise _unknown()
        if kind == "network":
            return cls.network(where)
        if kind == "webcam" and not (
            where.isascii() and where.isdigit() and int(where[:9]) <= _MOST_INDEX
        ):
            raise _unknown()
        if kind in ("video", "demo") and not Path(where).is_absolute():
            raise _unknown()
        return cls(cast("Kind", kind), where)

    @property
    def text(self) -> str:
        """The source as a single line of text."""
        return f"{self.kind}:{self.where}"

    @property
    def index(self) -> int:
        """Index of a webcam, or 0 for other kinds."""
        return int(self.where) if self.kind == "webcam" else 0

    @property
    def address(self) -> Address | None:
        """Address of a network camera, or None for other kinds."""
        return Address.parse(self.where) if self.kind == "network" else None

    @property
    def keepable(self) -> bool:
        """Whether the source may be saved, that is, contains no password and is not the demo."""
        address = self.address
        secret = address is not None and address.secret
        plain = self.text.isprintable() and self.text == self.text.strip()
        return plain and not secret and self.kind != "demo"

    @property
    def title(self) -> str:
        """Name of the source, with any secrets left out."""
        address = self.address
        if address is not None:
            return address.host
        if self.kind == "demo":
            return tr("Demo webcam")
        if self.kind == "webcam":
            return tr("Webcam {number}", number=self.index + 1)
        return Path(self.where).name


def make_source(
    source: LiveSource, clock: Clock, *, width: int = 0, keys: Keys = no_keys
) -> Webcam:
    """Create the camera for a source without opening it. This computer's webcams are not supported.

    Args:
        width: Maximum width of a frame in pixels, or 0 for the default.

    Raises:
        WebcamError: If the source is a webcam.
    """
    address = source.address
    if address is not None:
        kind = RtspWebcam if address.scheme == "rtsp" else MjpegWebcam
        return kind(address, clock, keys=keys, width=width)
    path = Path(source.where)
    if source.kind == "video":
        return VideoFile(path, clock, width=width)
    if source.kind == "demo":
        return SimulatedWebcam(path, clock, size=DEMO_SIZE)
    raise _unknown()


@dataclass(frozen=True, slots=True)
class SourceView:
    """The settings of one source.

    Attributes:
        fov_deg: Horizontal field of view set by the user, in degrees, or None to estimate it.
        learnt_deg: The last estimate of it, in degrees, used only for drawing.
    """

    fov_deg: float | None = None
    learnt_deg: float | None = None
    width: int = 0


@dataclass(frozen=True, slots=True)
class SourceViews:
    """The settings of recent sources, most recent last."""

    views: dict[str, SourceView] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> SourceViews:
        """Parse the text form of the settings, skipping damaged entries."""
        try:
            table: Any = json.loads(text[:_LONGEST_KEPT]) if text else {}
        except (ValueError, RecursionError):
            table = {}
        rows = list(table.items())[-_MOST_KEPT:] if isinstance(table, dict) else []
        return cls({name: _view(row) for name, row in rows if isinstance(row, dict)})

    @property
    def text(self) -> str:
        """The settings as one line for saving. The oldest are omitted if it would be too long."""
        rows = list(self.views.items())[-_MOST_KEPT:]
        while rows:
            text = json.dumps({name: _row(view) for name, view in rows}, separators=(",", ":"))
            if len(text) <= _LONGEST_KEPT:
                return text
            rows = rows[1:]
        return ""

    def of(self, source: LiveSource) -> SourceView:
        """Return the settings for a source."""
        return self.views.get(source.text, SourceView())

    def with_(self, source: LiveSource, **changes: Any) -> SourceViews:
        """Return a copy with changed settings for one source."""
        others = {name: view for name, view in self.views.items() if name != source.text}
        return SourceViews({**others, source.text: replace(self.of(source), **changes)})

    def view_of(self, source: LiveSource) -> SourceViews:
        """Return a copy that omits `source` if it must not be saved."""
        if source.keepable:
            return self
        return SourceViews({n: view for n, view in self.views.items() if n != source.text})


def _view(row: dict[str, Any]) -> SourceView:
    width = row.get("width")
    return SourceView(
        _angle(row.get("fov")), _angle(row.get("learnt")), width if width in WIDTHS else 0
    )


def _row(view: SourceView) -> dict[str, float]:
    values = {"fov": view.fov_deg, "learnt": view.learnt_deg, "width": view.width or None}
    return {name: round(value, 1) for name, value in values.items() if value is not None}


def _angle(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    inside = math.isfinite(value) and FOV_RANGE_DEG[0] <= value <= FOV_RANGE_DEG[1]
    return float(value) if inside else None


def _unknown() -> WebcamError:
    return WebcamError(
        tr("This live camera does not exist."), tr("Choose another one."), "bad-address"
    )
