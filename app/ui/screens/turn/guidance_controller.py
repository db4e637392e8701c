"""From what the camera sees to what is said: the reading of a moment, and its guide."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.base.angles import difference, wrap
from app.core.guidance.guide import FRESH, Guide, Reading, Source, guide
from app.core.localization.heading_conversion import Looks, sees_sitter, turn_of_heading
from app.core.text.turns import Mode

if TYPE_CHECKING:
    from app.core.guidance.guide import Goal, Phase
    from app.core.localization.tracking import Track
    from app.ui.presenters.services import Services
    from app.ui.screens.turn.camera import LiveCamera
    from app.ui.screens.turn.heading_tracker import HeadingTracker
    from app.ui.screens.turn.state import Guidance
    from app.ui.screens.turn.words import Hindrance


_PAUSE_S: Final = 3.0


class SpeechThrottle:
    """Does not talk without a pause: one sentence in some seconds, or a new state."""

    def __init__(self) -> None:
        self._told: tuple[Phase | None, str, float] = (None, "", -_PAUSE_S)

    def tell(self, guidance: Guidance, now_s: float) -> Guidance:
        """Fill in what is told."""
        phase, told, since = self._told
        if guidance.phase is not phase or (guidance.spoken != told and now_s - since >= _PAUSE_S):
            self._told = (guidance.phase, guidance.spoken, now_s)
        return replace(guidance, announced=self._told[1])


class GuidanceController:
    """Knows the turn of this moment, and what the guidance needs to remember.

    Attributes
    ----------
    guide : Guide or None
        What was said last; None while there is nothing to turn to.
    asked_deg : float or None
        How far it is to the light, deg, whatever is shown; None where nobody knows.
    """

    def __init__(self, services: Services, camera: LiveCamera, sight: HeadingTracker) -> None:
        self._services = services
        self._camera = camera
        self._sight = sight
        self._memory = FRESH
        self.guide: Guide | None = None
        self.hindrance: Hindrance = "none"
        self.asked_deg: float | None = None

    @property
    def mode(self) -> Mode:
        """Who moves."""
        return Mode(self._services.model.settings.mode)

    @property
    def looks(self) -> Looks:
        """Which way the camera looks."""
        return Looks.PHOTOGRAPHER if self._camera.looks == "me" else Looks.SITTER

    @property
    def asking(self) -> bool:
        """Whether it is to be said which way the camera looks.

        In a selfie the photographer is the sitter, and either answer would be the same.
        """
        live = self._camera.source is Source.LIVE
        return live and self.mode is Mode.WALK and self._camera.looks == "ask"

    @property
    def sees_sitter(self) -> bool:
        """Whether the person in the picture is the sitter."""
        return sees_sitter(self.looks, self.mode)

    @property
    def track(self) -> Track | None:
        """What is known of where the camera points; None before the first picture."""
        track = self._sight.track
        return track if track is not None and track.raw is not None else None

    def forget(self) -> None:
        """Begin anew."""
        self._memory, self.asked_deg = FRESH, None

    def advance(self, goal: Goal) -> Guide:
        """Work out what to say now, and remember what the next moment needs."""
        self.hindrance, reading = self._reading()
        if reading.source is not Source.LIVE:
            self.asked_deg = None
        elif reading.turn_deg is not None:
            # Whatever is shown: a camera that was left behind is still asked to turn.
            asked, _ = guide(goal, replace(reading, left_behind=False))
            self.asked_deg = None if asked.until_light is None else float(asked.until_light)
        self.guide, self._memory = guide(goal, reading, self._memory, self.mode)
        return self.guide

    def axis_turn(self, shown: Guide) -> float | None:
        """Where the camera's axis points, as a turn beside the one that is shown, deg."""
        track, turn = self.track, self._turn()
        if track is None or track.heading_deg is None or turn is None or shown.now is None:
            return None
        axis = turn_of_heading(
            track.heading_deg,
            looks=self.looks,
            mode=self.mode,
            front_deg=self._services.model.front_deg,
        )
        return wrap(shown.now + difference(axis, turn))

    def _reading(self) -> tuple[Hindrance, Reading]:
        now, source = self._services.clock.now(), self._camera.source
        if source is Source.LIVE and self.asking:
            return "asking", Reading(None, now, Source.NONE)
        if source is Source.LIVE and self._sight.error is not None:
            return "blank", Reading(None, now, Source.NONE)
        track = self.track
        if source is Source.LIVE and (self._sight.learning or track is None):
            why: Hindrance = "learning" if self._sight.learning else "looking"
            return why, Reading(None, now, Source.STARTING)
        left_behind = track is not None and track.left_behind
        return "none", Reading(self._turn(), now, source, left_behind)

    def _turn(self) -> float | None:
        track = self.track
        if track is None:
            return None
        return track.turn_deg(self.looks, self.mode, self._services.model.front_deg)
