"""Which live source is meant, as it is kept in the settings, and how it is made."""

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
"""Horizontal fields of view that can be set, deg."""

WIDTHS: Final = (640, 1280, 1920)
"""Columns of pictures that can be asked for, besides 0 for what is usual."""

_KINDS: Final = ("webcam", "network", "video", "demo")
_MOST_INDEX: Final = 63
_LONGEST: Final = 2000
_MOST_KEPT: Final = 12
_LONGEST_KEPT: Final = 4000


@dataclass(frozen=True, slots=True)
class LiveSource:
    """One source of live pictures.

    Examples:
        >>> LiveSource.parse("network:rtsp://192.168.1.20:8554/live").kind
        'network'
    """

    kind: Kind
    where: str

    @classmethod
    def webcam(cls, index: int) -> LiveSource:
        """Mean a webcam of this computer."""
        return cls("webcam", str(index))

    @classmethod
    def network(cls, text: str) -> LiveSource:
        """Mean a network camera; raises `WebcamError` as `Address.parse` does."""
        return cls("network", str(Address.parse(text)))

    @classmethod
    def parse(cls, text: str) -> LiveSource:
        """Read what `text` wrote.

        Raises `WebcamError` when it is none; the code is "bad-address".
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
        """All of it in one line."""
        return f"{self.kind}:{self.where}"

    @property
    def index(self) -> int:
        """Of a webcam; 0 for others."""
        return int(self.where) if self.kind == "webcam" else 0

    @property
    def address(self) -> Address | None:
        """Of a network camera; None for others."""
        return Address.parse(self.where) if self.kind == "network" else None

    @property
    def keepable(self) -> bool:
        """Whether it may be written into the settings: no password is in it, and it is no demo."""
        address = self.address
        secret = address is not None and address.secret
        plain = self.text.isprintable() and self.text == self.text.strip()
        return plain and not secret and self.kind != "demo"

    @property
    def title(self) -> str:
        """What it is called in one line; nothing secret is in it."""
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
    """Make a source that is not yet opened; those of this computer are made elsewhere.

    `width`: most columns of its pictures; 0 for what is usual. Raises `WebcamError` when it is a
    webcam.
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
    """How one source's pictures are taken.

    * `fov_deg`: horizontal field of view as the user set it, deg; None to estimate it.
    * `learnt_deg`: the last estimate, deg: to draw with, and never taken for known.
    """

    fov_deg: float | None = None
    learnt_deg: float | None = None
    width: int = 0


@dataclass(frozen=True, slots=True)
class SourceViews:
    """The `SourceView` of each source that has been used lately, the last used last."""

    views: dict[str, SourceView] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> SourceViews:
        """Read what `text` wrote; whatever is damaged is left out."""
        try:
            table: Any = json.loads(text[:_LONGEST_KEPT]) if text else {}
        except (ValueError, RecursionError):
            table = {}
        rows = list(table.items())[-_MOST_KEPT:] if isinstance(table, dict) else []
        return cls({name: _view(row) for name, row in rows if isinstance(row, dict)})

    @property
    def text(self) -> str:
        """All of it in one line, to be kept; the oldest are dropped where it is too long."""
        rows = list(self.views.items())[-_MOST_KEPT:]
        while rows:
            text = json.dumps({name: _row(view) for name, view in rows}, separators=(",", ":"))
            if len(text) <= _LONGEST_KEPT:
                return text
            rows = rows[1:]
        return ""

    def of(self, source: LiveSource) -> SourceView:
        """Return how a source's pictures are taken."""
        return self.views.get(source.text, SourceView())

    def with_(self, source: LiveSource, **changes: Any) -> SourceViews:
        """Return them with one source's changed."""
        others = {name: view for name, view in self.views.items() if name != source.text}
        return SourceViews({**others, source.text: replace(self.of(source), **changes)})

    def view_of(self, source: LiveSource) -> SourceViews:
        """Return them without a source that may not be kept."""
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
    return WebcamError(tr("There is no such live camera."), tr("Choose one again."), "bad-address")
