"""Compares the live picture with the goal, either overlaid, side by side or alternating.

One job at a time aligns the newest picture with the goal, and pictures that arrive in the meantime
are skipped. The state carried over from one picture to the next is passed to the job and returned
with its result, so the threads share nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from app.core.base.angles import difference
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.guidance.guide import LOST, HeadingSource, Phase
from app.core.localization.align import BARE, LikelyPose, SteadyOverlay, align, steady_overlay
from app.core.localization.homography import Alignment
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.screens.turn.live.overlay import LiveOverlay

if TYPE_CHECKING:
    from app.core.localization.live.tracking import Track
    from app.ui.screens.turn.goal import GoalViews
    from app.ui.screens.turn.guidance import GuidanceController
    from app.ui.screens.turn.live.camera import LiveCamera

_ALIGN: Final = "turn-align"
_BLINK_S: Final = 0.6
BESIDE: Final = tr("Live picture only, until the background is found")


@dataclass(frozen=True, slots=True)
class AlignmentState:
    """The row of tools under the pictures.

    Attributes:
        available: Whether there is a live picture to compare.
        mode: ``overlay``, ``split`` or ``blink``.
        swaps: Whether a button swaps Live and Goal because blinking is switched off.
        opacity: Opacity of Live over Goal or, in a split, the part of the width that Live takes up,
            in per cent.
    """

    on: bool = False
    available: bool = False
    mode: str = "overlay"
    swaps: bool = False
    opacity: int = 45


class AlignmentPanel:
    """Compares the live picture with the goal while the comparison is switched on."""

    def __init__(
        self,
        services: Services,
        camera: LiveCamera,
        guidance: GuidanceController,
        changed: Callable[[], None],
    ) -> None:
        self._services = services
        self._camera = camera
        self._guidance = guidance
        self._changed = changed
        self._aligner = Aligner(services, changed)
        self._opacity = 0.45
        self._mode = "overlay"
        self._swapped = False

    @property
    def available(self) -> bool:
        """Whether there is a live picture to compare with the goal."""
        return self._camera.source is HeadingSource.LIVE and not self._guidance.asking

    @property
    def on(self) -> bool:
        """Whether the comparison is switched on."""
        return self._aligner.on

    def toggle(self) -> None:
        """Start or stop the comparison."""
        if self.on or self.available:
            self._aligner.switch(on=not self.on)
            self._changed()

    def stop(self) -> None:
        """Stop the comparison."""
        self._aligner.switch(on=False)

    def set_mode(self, mode: str) -> None:
        """Set the kind of comparison: ``overlay``, ``split`` or ``blink``."""
        self._mode = mode
        self._changed()

    def swap(self) -> None:
        """Swap Live and Goal when blinking is switched off."""
        self._swapped = not self._swapped
        self._changed()

    def set_opacity(self, per_cent: float) -> None:
        """Set the opacity of Live over Goal, from 0 to 100 per cent."""
        self._opacity = min(max(per_cent / 100.0, 0.0), 1.0)
        self._changed()

    def look(self, views: GoalViews | None) -> None:
        """Align the newest picture with the goal, unless an alignment is already running."""
        frame = self._camera.frame
        if views is not None and frame is not None and self.on:
            fovs = (views.scene.panorama_fov_deg, self._camera.fov_guess_deg)
            pose = _likely_pose(self._guidance.track, views.scene.azimuth_deg)
            self._aligner.look(frame.picture, views.target, fovs, pose)

    def overlay(self, views: GoalViews | None) -> LiveOverlay | None:
        """Return the overlay of Live on Goal, or None if Live is shown alone."""
        if not self.on or views is None or not self.available or self._unaligned:
            return None
        alignment, opacity = self._aligner.alignment, self._opacity
        homography = None if alignment is None else alignment.homography
        if self._mode == "blink":
            opacity = 1.0 if self._shows_live else 0.0
        return LiveOverlay(views.goal, homography, opacity, self._mode == "split")

    def tag(self) -> str:
        """Return a description of the comparison, or an empty string if it is switched off."""
        if not self.on or not self.available:
            return ""
        if self._unaligned:
            return BESIDE
        aligned = tr("Aligned") if self._is_aligned else tr("Not yet aligned")
        return f"{self._compared}. {aligned}"

    def resolve(self) -> AlignmentState:
        """Return the state of the tools."""
        return AlignmentState(
            on=self.on and self.available,
            available=self.available,
            mode=self._mode,
            swaps=self._mode == "blink" and self._services.model.calm,
            opacity=round(100.0 * self._opacity),
        )

    @property
    def _is_aligned(self) -> bool:
        alignment = self._aligner.alignment
        return alignment is not None and alignment.status == "found"

    @property
    def _unaligned(self) -> bool:
        """Whether Live cannot be placed over Goal, because heading and alignment are both lost."""
        guide = self._guidance.guide
        lost = guide is not None and guide.phase in (*LOST, Phase.LEFT)
        return lost and not self._is_aligned

    @property
    def _shows_live(self) -> bool:
        """Whether Live is on display, either while blinking or after a manual swap."""
        if self._services.model.calm:
            return not self._swapped
        return int(self._services.clock.now() / _BLINK_S) % 2 == 0

    @property
    def _compared(self) -> str:
        if self._mode == "blink":
            return tr("Live") if self._shows_live else tr("Goal")
        split = self._mode == "split"
        return tr("Live on the left, goal on the right") if split else tr("Live over the goal")


@dataclass(slots=True, eq=False)
class Aligner:
    """Aligns the newest picture with the goal, one picture at a time.

    Attributes:
        alignment: The smoothed alignment, or None before the first picture.
    """

    services: Services
    changed: Callable[[], None]
    on: bool = False
    alignment: Alignment | None = None
    _pictures: tuple[Bytes, Bytes] | None = field(default=None, repr=False)
    _state: tuple[SteadyOverlay, Sitter | None] = field(default=(BARE, None), repr=False)

    def switch(self, on: bool) -> None:
        """Turn the alignment on or off."""
        self.on, self.alignment, self._pictures = on, None, None
        self._state = (BARE, None)
        if not on:
            self.services.runner.cancel(_ALIGN)

    def look(
        self,
        picture: Bytes,
        target: Bytes,
        fovs_deg: tuple[float, float],
        pose: LikelyPose | None = None,
    ) -> None:
        """Align a picture with the goal, unless an alignment is already running.

        Args:
            picture: The camera's picture, (H, W, 3) uint8 sRGB, not mirrored.
            target: The view at the goal, (H, W, 3) uint8 sRGB, not mirrored.
            fovs_deg: Horizontal fields of view of the target and the camera, in degrees.
            pose: Pose of the camera according to its heading, or None if it is unknown.
        """
        before, pictures = self._state, self._pictures
        same = pictures is not None and pictures[0] is picture and pictures[1] is target
        same = same and before[0].rival is None
        if not self.on or same or self.services.runner.running(_ALIGN):
            return
        if pictures is not None and pictures[1] is not target:
            before = (BARE, before[1])  # The goal has changed.
        self._pictures, now_s = (picture, target), self.services.clock.now()
        self.services.runner.submit(
            _ALIGN,
            lambda token, report: _aligned(picture, target, fovs_deg, pose, before, now_s),
            done=self._set_state,
            failed=lambda error: self._set_state((BARE, None)),
        )

    def _set_state(self, state: tuple[SteadyOverlay, Sitter | None]) -> None:
        if self.on:
            self._state, self.alignment = state, state[0].alignment
            self.changed()


def _likely_pose(track: Track | None, goal_deg: float) -> LikelyPose | None:
    """Return the camera's pose according to its last heading, or None if there is none.

    Args:
        goal_deg: Panorama azimuth of the camera's axis at the goal, in degrees.
    """
    heading = None if track is None else track.raw
    if heading is None or heading.heading_deg is None:
        return None
    to_goal = difference(goal_deg, heading.heading_deg)
    return LikelyPose(to_goal, heading.pitch_deg, heading.roll_deg, heading.zoom)


def _aligned(
    picture: Bytes,
    target: Bytes,
    fovs_deg: tuple[float, float],
    pose: LikelyPose | None,
    before: tuple[SteadyOverlay, Sitter | None],
    now_s: float,
) -> tuple[SteadyOverlay, Sitter | None]:
    """Align a picture with the goal by means of the background behind the sitter."""
    overlay, near = before
    try:
        sitter = find_sitter(picture, fovs_deg[1], near)
    except CoreError:
        sitter = None
    alignment = align(
        target,
        picture,
        fov_deg=fovs_deg[0],
        view_fov_deg=fovs_deg[1],
        sitter_deg=0.0 if sitter is None else sitter.angle_deg,
        mask=None if sitter is None else background_mask(sitter, picture.shape[:2]),
        pose=pose,
    )
    sizes = ((picture.shape[1], picture.shape[0]), (target.shape[1], target.shape[0]))
    return steady_overlay(overlay, alignment, sizes, now_s), sitter
