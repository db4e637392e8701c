"""A simulated webcam at the demo location.

The demo location has a view with depth every 5 degrees. Between two views, both backgrounds are
shifted according to their depth and then blended. The sitter always faces the camera and stays in
place. Only the light on them changes from one view to the next.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes, Float32
from app.core.localization.heading_conversion import heading_of_turn
from app.core.text import tr
from app.devices.clock import Clock, SystemClock
from app.devices.webcam.protocol import WEBCAM, Webcam, WebcamError

_CACHE_SIZE: Final = 12  # views kept in memory
_SKY_M: Final = 1000.0
_BEHIND_M: Final = 0.45  # metres behind the sitter's centre beyond which everything is background
_STEPS: Final = 2  # iterations to find the depth at the target position from the depth here


@dataclass(frozen=True, slots=True, eq=False)
class _SourceView:
    """One view separated into layers.

    Attributes:
        behind: (H, W, 3) uint8. Background. Behind the sitter, it is filled with the nearest
            visible pixels.
        visible: (H, W) uint8. 255 where the background is visible.
        sitter: (H, W, 4) uint8. The sitter's colours, premultiplied by alpha, followed by alpha.
        depth: (h, w) float32. Depth along the optical axis, in metres, at half size. Behind the
            sitter, it is the depth of the surrounding background.
    """

    behind: Bytes = field(repr=False)
    visible: Bytes = field(repr=False)
    sitter: Bytes = field(repr=False)
    depth: Float32 = field(repr=False)
    box: tuple[slice, slice]


class DemoViews:
    """The views of the demo location from one distance. This class is not thread-safe.

    Args:
        distance_m: Distance to the sitter in metres. The nearest available distance is used.
        aspect: Width of a frame divided by its height. Views are cropped at the top and bottom.

    Raises:
        WebcamError: If the views are missing or damaged.
    """

    def __init__(self, folder: Path, distance_m: float = 1.2, aspect: float = 16 / 9) -> None:
        self._folder = folder
        try:
            table = json.loads((folder / "views.json").read_text(encoding="utf-8"))
            self._focal = float(table["focal_px"])
            self._near_m = float(table["depth"]["near_m"])
            self._size = (int(table["size"][0]), int(table["size"][1]))
            self.fov_deg = float(table["horizontal_fov_deg"])
            there = sorted({float(view["distance_m"]) for view in table["views"]})
            self.distance_m = min(there, key=lambda d: abs(d - distance_m))
            self._files = self._find_files(table["views"])
            self._turns = sorted(self._files)
        except (OSError, KeyError, TypeError, ValueError) as error:
            raise _missing() from error
        rows = min(round(self._size[0] / aspect), self._size[1])
        self._rows = slice((self._size[1] - rows) // 2, (self._size[1] - rows) // 2 + rows)
        self._view = lru_cache(_CACHE_SIZE)(self._read)

    def _find_files(self, views: list[dict[str, Any]]) -> dict[float, tuple[Path, Path]]:
        files = {
            float(view["turn_deg"]): (self._folder / view["image"], self._folder / view["depth"])
            for view in views
            if float(view["distance_m"]) == self.distance_m
        }
        if len(files) < 2:
            raise ValueError
        return files

    def picture(self, turn_deg: float) -> Bytes:
        """Return the camera's view at a turn.

        Args:
            turn_deg: Turn of the sitter, and of the camera with them, in degrees.

        Returns:
            (H, W, 3) uint8 sRGB, as a new array.

        Raises:
            WebcamError: If an image is missing or damaged.
        """
        before, after, share = self._neighbours(turn_deg)
        first, second = self._view(before), self._view(after)
        gap = (after - before) % 360.0
        picture, visible = self._shift(first, share * gap)
        if share > 0.0:
            other, other_seen = self._shift(second, (share - 1.0) * gap)
            picture = _mixed((picture, visible), (other, other_seen), share)
        _add_sitter(picture, first, second, share)
        return picture

    def _neighbours(self, turn_deg: float) -> tuple[float, float, float]:
        turn = turn_deg % 360.0
        place = int(np.searchsorted(self._turns, turn, side="right")) - 1
        before, after = self._turns[place], self._turns[(place + 1) % len(self._turns)]
        gap = (after - before) % 360.0
        return before, after, ((turn - before) % 360.0) / gap

    def _read(self, turn: float) -> _SourceView:
        image, depth = self._files[turn]
        try:
            picture = cv2.imdecode(np.fromfile(image, np.uint8), cv2.IMREAD_COLOR_RGB)
            code = cv2.imdecode(np.fromfile(depth, np.uint8), cv2.IMREAD_UNCHANGED)
        except (OSError, cv2.error) as error:
            raise _missing() from error
        if picture is None or code is None or picture.shape[1::-1] != self._size:
            raise _missing()
        half = (picture.shape[1] // 2, picture.shape[0] // 2)
        metres = np.full(code.shape, _SKY_M, np.float32)
        np.divide(self._near_m * 65535.0, code, out=metres, where=code > 0, dtype=np.float32)
        metres = np.asarray(cv2.resize(metres, half, interpolation=cv2.INTER_NEAREST), np.float32)
        sitter = _sitter(metres, self.distance_m + _BEHIND_M)
        return self._apart(np.asarray(picture, np.uint8), metres, sitter)

    def _apart(self, picture: Bytes, metres: Float32, sitter: Bytes) -> _SourceView:
        wide = cv2.dilate(sitter, np.ones((5, 5), np.uint8))
        behind_m = np.where(wide > 0, np.median(metres[wide == 0]), metres).astype(np.float32)
        behind_m = np.asarray(cv2.medianBlur(behind_m, 5), np.float32)
        share = cv2.resize(sitter, self._size, interpolation=cv2.INTER_LINEAR)
        share = np.asarray(cv2.GaussianBlur(share, (0, 0), 1.2), np.uint8)[self._rows]
        # No trace of the sitter may remain in the background around them.
        hidden = np.asarray(cv2.resize(wide, self._size), np.uint8)[self._rows]
        cut = picture[self._rows]
        down, across = np.nonzero(share)
        box = (slice(down.min(), down.max() + 1), slice(across.min(), across.max() + 1))
        half = slice(self._rows.start // 2, self._rows.stop // 2)
        return _SourceView(
            _filled(cut, hidden), 255 - hidden, _shared(cut, share), behind_m[half].copy(), box
        )

    def _shift(self, view: _SourceView, by_deg: float) -> tuple[Bytes, Bytes]:
        """Return a view's background, turned by `by_deg` more, and its visibility mask."""
        rows, columns = view.depth.shape
        focal = self._focal / 2.0
        x = ((np.arange(columns) + 0.5 - columns / 2.0) / focal).astype(np.float32)
        y = ((np.arange(rows) + 0.5 - rows / 2.0) / focal).astype(np.float32)[:, None]
        angle = math.radians(by_deg)
        sine, cosine = np.float32(math.sin(angle)), np.float32(math.cos(angle))
        distance = np.float32(self.distance_m)
        depth = view.depth
        for step in range(_STEPS):
            # Rotation about the sitter's axis: a point straight ahead here is by_deg to the right
            # there.
            beyond = depth - distance
            ahead = beyond * cosine - x * depth * sine + distance
            scale = np.float32(focal) / np.maximum(ahead, np.float32(0.2))
            across = (x * depth * cosine + beyond * sine) * scale + np.float32(columns / 2 - 0.5)
            down = y * depth * scale + np.float32(rows / 2 - 0.5)
            if step + 1 < _STEPS:
                depth = np.asarray(
                    cv2.remap(
                        view.depth, across, down, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE
                    ),
                    np.float32,
                )
        size = (view.behind.shape[1], view.behind.shape[0])
        maps = [cv2.resize(m, size) * np.float32(2.0) + np.float32(0.5) for m in (across, down)]
        behind = cv2.remap(
            view.behind, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        visible = cv2.remap(view.visible, maps[0], maps[1], cv2.INTER_LINEAR)
        return np.asarray(behind, np.uint8), np.asarray(visible, np.uint8)


def _sitter(metres: Float32, limit_m: float) -> Bytes:
    """Return a half-size mask of the sitter: 255 for near pixels connected to the centre."""
    near = (metres < limit_m).astype(np.uint8)
    _, labels = cv2.connectedComponents(near)
    middle = int(labels[labels.shape[0] // 2, labels.shape[1] // 2])
    if middle == 0:
        raise _missing()
    return np.where(labels == middle, 255, 0).astype(np.uint8)


def _filled(picture: Bytes, hidden: Bytes) -> Bytes:
    """Fill hidden areas of the background with the nearest pixels."""
    mask = (hidden > 0).astype(np.uint8)
    _, labels = cv2.distanceTransformWithLabels(
        mask, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    visible = mask == 0
    nearest = np.zeros((int(labels.max()) + 1, 3), np.uint8)
    nearest[labels[visible]] = picture[visible]
    smooth = cv2.blur(nearest[labels], (5, 5))
    return np.where(visible[..., None], picture, smooth).astype(np.uint8)


def _mixed(first: tuple[Bytes, Bytes], second: tuple[Bytes, Bytes], share: float) -> Bytes:
    """Blend two backgrounds, or use just the visible one where the other is hidden."""
    mixed = np.asarray(cv2.addWeighted(first[0], 1.0 - share, second[0], share, 0.0), np.uint8)
    part = (first[1] < 250) | (second[1] < 250)
    if part.any():
        one = (first[1][part].astype(np.float32) + 1.0) * np.float32(1.0 - share)
        other = (second[1][part].astype(np.float32) + 1.0) * np.float32(share)
        weight = (other / (one + other))[:, None]
        mixed[part] = (first[0][part] * (1.0 - weight) + second[0][part] * weight).astype(np.uint8)
    return mixed


def _shared(picture: Bytes, share: Bytes) -> Bytes:
    part = (picture.astype(np.float32) * (share[..., None] / np.float32(255.0)) + 0.5).astype(
        np.uint8
    )
    return np.dstack([part, share])


def _add_sitter(picture: Bytes, first: _SourceView, second: _SourceView, share: float) -> None:
    top = min(first.box[0].start, second.box[0].start)
    bottom = max(first.box[0].stop, second.box[0].stop)
    left = min(first.box[1].start, second.box[1].start)
    right = max(first.box[1].stop, second.box[1].stop)
    box = (slice(top, bottom), slice(left, right))
    layer = first.sitter[box]
    if share > 0.0:
        layer = np.asarray(
            cv2.addWeighted(layer, 1.0 - share, second.sitter[box], share, 0.0), np.uint8
        )
    rest = np.float32(1.0) - layer[..., 3:] / np.float32(255.0)
    picture[box] = np.minimum(picture[box] * rest + layer[..., :3], 255.0).astype(np.uint8)


def _missing() -> WebcamError:
    return WebcamError(
        tr("The pictures of the demo location are missing or damaged."),
        tr("Reinstall Turnlight."),
        "no-views",
    )


FPS: Final = 24.0
"""Frames per second."""

SIZE: Final = (1280, 720)
"""Columns and rows of a frame."""

DEMO_SIZE: Final = (1080, 720)
"""Columns and rows of a frame in the demo."""

FOV_DEG: Final = 60.0
"""Horizontal field of view, in degrees.

It covers the full width of the demo views, whose height is cropped to 36 degrees.
"""

_STILL: Final = replace(WEBCAM, still=True)


class SimulatedWebcam(Webcam):
    """Shows the sitter at the demo location, with the background at the current turn.

    The camera looks at the sitter, who is at the centre of the frame and faces the lens. The
    camera's heading is therefore the turn + 180 degrees.

    Args:
        views: Folder with the demo location's views.
        distance_m: Distance to the sitter in metres. The nearest available distance is used.
        size: Columns and rows of a frame.
    """

    def __init__(
        self,
        views: Path,
        clock: Clock | None = None,
        *,
        distance_m: float = 1.2,
        size: tuple[int, int] = SIZE,
    ) -> None:
        super().__init__(tr("Demo webcam"), FOV_DEG, clock or SystemClock(), _STILL)
        self._size = size
        self._last: tuple[float, Bytes] | None = None
        self._aim = 0.0  # degrees
        self._folder = views
        self._views: DemoViews | None = None
        self.distance_m = distance_m

    @property
    def turn_deg(self) -> float:
        """The turn of the next frame, in degrees in (-180, 180]."""
        return self._aim

    @property
    def heading_deg(self) -> float:
        """The camera's heading as a panorama azimuth, in degrees in (-180, 180]."""
        return heading_of_turn(self.turn_deg)

    def set_turn(self, turn_deg: float) -> None:
        """Set the turn for all following frames, in degrees, positive clockwise."""
        self._aim = wrap(turn_deg)

    def connect(self) -> None:
        """Read the list of views the first time this is called."""
        if self._views is None:
            aspect = self._size[0] / self._size[1]
            self._views = DemoViews(self._folder, self.distance_m, aspect)
            self.distance_m = self._views.distance_m
        self._due_s = self._clock.now()

    def read(self) -> Bytes | None:
        """Return the next frame when it is due."""
        # If late by more than a frame, skip some, as a camera does.
        self.pace(1.0 / FPS, 1.0 / FPS)
        aim = self._aim
        if self._last is None or self._last[0] != aim:
            self._last = (aim, self.view(aim))
        return self._last[1]

    def disconnect(self) -> None:
        """Do nothing."""

    def view(self, turn_deg: float) -> Bytes:
        """Return the frame for a turn as (H, W, 3) uint8 sRGB."""
        if self._views is None:
            raise WebcamError(tr("The webcam is not open."), tr("Open it first."), "no-webcam")
        picture = self._views.picture(turn_deg)
        return np.asarray(cv2.resize(picture, self._size, interpolation=cv2.INTER_LINEAR), np.uint8)
