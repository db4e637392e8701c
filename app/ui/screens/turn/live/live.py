"""The text on the Live and Goal pictures, and the quality of the heading."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.core.guidance.guide import LOST, Guide, HeadingSource, Phase
from app.core.guidance.who_moves import Mode
from app.core.text import tr
from app.ui.screens.turn.live.source_words import source_words
from app.words.guidance import trouble_line
from app.words.phrases.turns import sureness_words

if TYPE_CHECKING:
    from app.ui.presenters.services import Services
    from app.ui.screens.turn.guidance import GuidanceController
    from app.ui.screens.turn.live.camera import LiveCamera
    from app.ui.screens.turn.live.heading_tracker import HeadingTracker

ASPECT: Final = 1.5
"""Minimum aspect ratio (width / height) of the live picture. A taller picture is cropped at the top
and bottom.
"""


@dataclass(frozen=True, slots=True)
class LiveWords:
    """The text on and above the Live and Goal pictures.

    Attributes:
        live, goal: Text beside the two headings, such as "webcam".
        name: The camera's name.
        message: Description of a problem and its remedy.
        brief: Description of the problem alone.
        tag: State of the comparison of Live with Goal.
        dim: Whether the picture is out of date.
        asking: Whether to ask the user which way the camera faces.
        aspect: Aspect ratio (width / height) of both pictures.
        quality, quality_icon: Text such as "Heading certain", and the icon beside it.
    """

    live: str = ""
    goal: str = tr("what the camera should see")
    name: str = ""
    message: str = ""
    brief: str = ""
    tag: str = ""
    dim: bool = False
    asking: bool = False
    aspect: float = ASPECT
    quality: str = ""
    quality_icon: str = "target"


@dataclass(frozen=True, slots=True)
class CameraMenu:
    """The menu of the live picture.

    Attributes:
        webcams: Index and name of each webcam.
        webcam: Index of the webcam in use, or -1 for any other source.
        looks: ``sitter``, ``me`` or ``ask``.
        sounds: Whether the sounds of the guidance are on.
    """

    webcams: tuple[tuple[int, str], ...] = ()
    webcam: int = 0
    looks: str = "ask"
    sounds: bool = True


class LivePanel:
    """Builds the text on the Live and Goal pictures.

    Attributes:
        aspect: Aspect ratio (width / height) of both pictures.
    """

    def __init__(
        self,
        services: Services,
        camera: LiveCamera,
        tracker: HeadingTracker,
        guidance: GuidanceController,
    ) -> None:
        self._services = services
        self._camera = camera
        self._tracker = tracker
        self._guidance = guidance
        self.aspect = ASPECT

    def resolve(self, guide: Guide, tag: str) -> LiveWords:
        """Return the text on the pictures. `tag` describes the comparison of Live with Goal."""
        quality, icon = self._quality(guide)
        return replace(
            self._words(),
            name=self._camera.name,
            tag=tag,
            asking=self._guidance.asking,
            aspect=self.aspect,
            quality=quality,
            quality_icon=icon,
        )

    def menu(self) -> CameraMenu:
        """Return the menu of the live picture."""
        sounds = self._services.model.settings.sounds and self._services.sounds.available
        camera = self._camera
        return CameraMenu(camera.listed, camera.index, camera.looks, sounds)

    def _words(self) -> LiveWords:
        """Return the text that describes both pictures. In selfie mode, they are mirrored."""
        source, error = self._camera.source, self._camera.error
        words, selfie = source_words(self._camera.chosen.kind), self._guidance.mode is Mode.SELFIE
        goal = tr("what the camera should see")
        if selfie:
            goal = tr("what the camera should see, mirrored")
        if source is HeadingSource.LIVE:
            message, brief = ("", "") if error is None else (str(error), error.message)
            live = tr("{source}, mirrored", source=words.noun) if selfie else words.noun
            return LiveWords(live, goal, message=message, brief=brief)
        if source is HeadingSource.AWAY:
            message = words.lost_sentence
            return LiveWords(tr("last picture"), goal, message=message, brief=words.lost, dim=True)
        if source is HeadingSource.STARTING:
            return LiveWords(words.starting, goal)
        message = tr("{trouble}. Turn by the number shown.", trouble=words.missing)
        brief = words.missing
        if error is not None and error.code != "no-webcam":
            message, brief = str(error), error.message
        live = tr("{trouble}: showing the goal", trouble=words.missing)
        return LiveWords(live, goal, message=message, brief=brief)

    def _quality(self, guide: Guide) -> tuple[str, str]:
        """Return a phrase that describes the quality of the heading, and the icon for it."""
        source, tracker, track = self._camera.source, self._tracker, self._guidance.track
        words = source_words(self._camera.chosen.kind)
        if source is HeadingSource.AWAY:
            return words.lost, "warning"
        if source is HeadingSource.NONE:
            return words.missing, "webcam"
        if source is HeadingSource.STARTING:
            return words.starting, "webcam"
        if tracker.error is not None:
            return str(tracker.error), "warning"
        if tracker.learning:
            return tr("Learning the background of this place…"), "refresh"
        if guide.phase in (*LOST, Phase.LEFT):
            error = self._camera.error
            return trouble_line(guide.phase) if error is None else error.message, "target"
        if track is None or track.heading_deg is None:
            return tr("Looking for the background"), "target"
        sureness = sureness_words(track.confidence, confirmed=track.confirmed)
        if self._guidance.sees_sitter and track.sitter is None:
            return tr("Heading {sureness}, no sitter seen", sureness=sureness), "target"
        return tr("Heading {sureness}", sureness=sureness), "target"
