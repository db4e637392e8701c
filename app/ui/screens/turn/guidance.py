"""The right-hand column: how far to turn, which way to walk and whether the light is reached."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from app.core.base.angles import difference, wrap
from app.core.guidance.guide import FRESH, LOST, Goal, Guide, HeadingSource, Phase, Reading, guide
from app.core.guidance.who_moves import Mode
from app.core.localization.heading_conversion import Looks, sees_sitter, turn_of_heading
from app.core.localization.sitter import background_mask
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.screens.turn.live.source_words import SourceWords, source_words
from app.words.guidance import DIRECTIONS, HOLD, guide_words
from app.words.phrases.turns import turn_words

if TYPE_CHECKING:
    from app.core.localization.live.tracking import Track
    from app.ui.screens.turn.live.camera import LiveCamera
    from app.ui.screens.turn.live.heading_tracker import HeadingTracker

Sign: TypeAlias = Literal["clockwise", "counter-clockwise", "check", "none"]
"""Direction of the arrow, or the check mark that replaces it."""

Hindrance: TypeAlias = Literal["none", "learning", "looking", "asking", "blank"]
"""The reason why there is no heading: the panorama's index is still being built ("learning"), no
picture has been located yet ("looking"), it is unknown which way the camera faces ("asking") or the
panorama has no usable features ("blank").
"""

PILLS: Final[dict[Hindrance, tuple[str, str]]] = {
    "learning": (tr("Learning the background"), "refresh"),
    "looking": (tr("Looking for the background"), "target"),
    # Until this is answered, left and right might be swapped.
    "asking": (tr("Choose which way the camera faces"), "help"),
    "blank": (tr("No heading here"), "warning"),
}
TAKE: Final = tr("Take the picture")
FROM_PHOTO: Final = tr("From where the photo was taken")
_ICONS: Final = {
    Phase.LOST: "target",
    Phase.FEW_DETAILS: "target",
    Phase.LEFT: "walk",
    Phase.AWAY: "warning",
}
_LEFT: Final = tr("The best light is a little to your left.")
_RIGHT: Final = tr("The best light is a little to your right.")
REST: Final = {Mode.WALK: (_RIGHT, _LEFT), Mode.SELFIE: (_LEFT, _RIGHT)}
_COARSE: Final = (36, 48)
_HIDING: Final = 0.55  # fraction of the picture; a larger sitter hides too much of the background
_PAUSE_S: Final = 3.0  # between two announcements


@dataclass(frozen=True, slots=True)
class Guidance:
    """The contents of the right-hand column.

    Attributes:
        number: Turn in whole degrees, or None if a sentence is shown instead.
        number_words: "to go", "to the best" or an empty string.
        walk, company: Display text such as "Walk to your left" and "The sitter turns with you."
            Either may be empty.
        pill, pill_icon: Text of the pill, such as "Not in the light yet", and its icon. If the text
            is empty, there is no pill.
        inside: Whether the sitter is in the light. If so, the column turns green.
        spoken, announced: The same guidance for screen readers. `announced` changes at most once
            every 3 s.
    """

    phase: Phase = Phase.STARTING
    sign: Sign = "none"
    number: int | None = None
    number_words: str = ""
    direction: str = ""
    walk: str = ""
    company: str = ""
    pill: str = ""
    pill_icon: str = "bulb"
    inside: bool = False
    sentence: str = ""
    sentence_icon: str = "webcam"
    advice: str = ""
    spoken: str = ""
    announced: str = ""


class GuidanceController:
    """Determines the next step from the current heading and the previous guidance.

    Attributes:
        guide: The latest guidance, or None while there is no goal.
        asked_deg: Remaining turn to the light in degrees, whether or not it is displayed, or None
            while it is unknown.
        from_deg: Turn at which the last photo was taken, in degrees, or 0 for the start. If there
            is no heading, the displayed turn is measured from this turn.
    """

    def __init__(self, services: Services, camera: LiveCamera, tracker: HeadingTracker) -> None:
        self._services = services
        self._camera = camera
        self._tracker = tracker
        self._memory = FRESH
        self.guide: Guide | None = None
        self.hindrance: Hindrance = "none"
        self.asked_deg: float | None = None
        self.from_deg = 0.0
        self._last_words: tuple[Phase | None, str, float] = (None, "", -_PAUSE_S)

    @property
    def mode(self) -> Mode:
        """Who moves: the photographer and the sitter together, or the sitter alone."""
        return Mode(self._services.model.settings.mode)

    @property
    def looks(self) -> Looks:
        """The person that the camera faces: the sitter or the photographer."""
        return Looks.PHOTOGRAPHER if self._camera.looks == "me" else Looks.SITTER

    @property
    def asking(self) -> bool:
        """Whether to ask the user which way the camera faces.

        In a selfie the photographer is the sitter, so the answer makes no difference.
        """
        live = self._camera.source is HeadingSource.LIVE
        return live and self.mode is Mode.WALK and self._camera.looks == "ask"

    @property
    def sees_sitter(self) -> bool:
        """Whether the person in the picture is the sitter."""
        return sees_sitter(self.looks, self.mode)

    @property
    def track(self) -> Track | None:
        """The latest position of the camera in the panorama, or None before the first picture."""
        track = self._tracker.track
        return track if track is not None and track.raw is not None else None

    def forget(self) -> None:
        """Clear the guidance history."""
        self._memory, self.asked_deg, self.from_deg = FRESH, None, 0.0

    def advance(self, goal: Goal, yaw_deg: float | None = None) -> Guide:
        """Update the guidance for the current moment, and return the result.

        Args:
            yaw_deg: Yaw of the sitter's face, in degrees, or None if it is unknown.
        """
        self.hindrance, reading = self._reading()
        reading = replace(reading, yaw_deg=yaw_deg)
        if reading.source is not HeadingSource.LIVE:
            self.asked_deg = None
        elif reading.turn_deg is not None:
            # A camera that was left behind needs a target turn as well.
            guidance, _ = guide(goal, replace(reading, left_behind=False))
            self.asked_deg = None if guidance.until_light is None else float(guidance.until_light)
        self.guide, self._memory = guide(goal, reading, self._memory)
        return self.guide

    def axis_turn(self, guidance: Guide) -> float | None:
        """Return the turn of the camera's axis in degrees, or None if it is unknown."""
        track, turn = self.track, self._turn()
        if track is None or track.heading_deg is None or turn is None or guidance.now is None:
            return None
        axis = turn_of_heading(
            track.heading_deg,
            looks=self.looks,
            mode=self.mode,
            front_deg=self._services.model.front_deg,
        )
        return wrap(guidance.now + difference(axis, turn))

    def _reading(self) -> tuple[Hindrance, Reading]:
        now, source = self._services.clock.now(), self._camera.source
        if source is HeadingSource.LIVE and self.asking:
            return "asking", Reading(None, now, HeadingSource.NONE, from_deg=self.from_deg)
        if source is HeadingSource.LIVE and self._tracker.error is not None:
            return "blank", Reading(None, now, HeadingSource.NONE, from_deg=self.from_deg)
        track = self.track
        if source is HeadingSource.LIVE and (self._tracker.learning or track is None):
            why: Hindrance = "learning" if self._tracker.learning else "looking"
            return why, Reading(None, now, HeadingSource.STARTING, from_deg=self.from_deg)
        left_behind = track is not None and track.left_behind
        few_details = track is not None and track.raw is not None and track.raw.few_details
        return "none", Reading(
            self._turn(), now, source, left_behind, self.from_deg, few_details=few_details
        )

    def _turn(self) -> float | None:
        track = self.track
        if track is None:
            return None
        return track.turn_deg(self.looks, self.mode, self._services.model.front_deg)

    def column(self, guidance: Guide) -> Guidance:
        """Build the right-hand column, and announce it to screen readers every few seconds."""
        words = self._column(guidance)
        plan = self._services.model.lamp_plan
        if guidance.hold and plan is not None:
            words = replace(words, advice=plan.where)
        elif words.sentence and self._camera.error is None and self.hindrance == "none":
            words = replace(words, advice=self._advice(guidance))
        now_s = self._services.clock.now()
        phase, last_words, since = self._last_words
        if words.phase is not phase or (words.spoken != last_words and now_s - since >= _PAUSE_S):
            self._last_words = (words.phase, words.spoken, now_s)
        return replace(words, announced=self._last_words[1])

    def _column(self, guidance: Guide) -> Guidance:
        if guidance.phase in (Phase.NO_WEBCAM, Phase.STARTING):
            return self._whole_turn(guidance)
        if guidance.number is None:
            return self._sentence(guidance)
        words = guide_words(guidance, self.mode)
        if guidance.hold and guidance.lamp:
            # From here on the lamp matters, so its text must be readable from afar.
            return Guidance(
                phase=guidance.phase,
                inside=True,
                sentence=f"{words.headline}.",
                sentence_icon="bulb",
                spoken=words.spoken,
            )
        base = Guidance(
            phase=guidance.phase,
            sign=_sign(guidance),
            number=guidance.number,
            number_words=words.number_words,
            direction=words.headline
            if guidance.phase is Phase.NOSE
            else DIRECTIONS[guidance.direction],
            walk=words.walk,
            company=words.company,
            pill=words.light,
            pill_icon="warning" if guidance.beyond else "bulb",
            spoken=words.spoken,
        )
        if not guidance.inside:
            return base
        # The number in "4° to the best" is drawn large.
        base = replace(base, number_words=tr("to the best"), pill_icon="check", inside=True)
        if guidance.lamp:
            return base
        walk = HOLD if guidance.hold else ""
        rest = "" if guidance.hold else REST[self.mode][guidance.direction == "clockwise"]
        company = "\n".join(part for part in (rest, words.sitter) if part)
        return replace(base, direction=TAKE, walk=walk, company=company)

    def _sentence(self, guidance: Guide) -> Guidance:
        """Build the column with a sentence instead of a number. Camera problems come first."""
        error = self._camera.error
        if error is not None and guidance.phase in LOST:
            message, icon = str(error), "warning"
        else:
            is_away = guidance.phase is Phase.AWAY
            message = (
                self._source_words.lost_sentence if is_away else guide_words(guidance).headline
            )
            icon = _ICONS.get(guidance.phase, "webcam")
        return Guidance(guidance.phase, sentence=message, sentence_icon=icon, spoken=message)

    def _whole_turn(self, guidance: Guide) -> Guidance:
        """Build the column for the whole turn, made by eye if there is no heading."""
        source = self._source_words
        starting = guidance.phase is Phase.STARTING
        missing = (source.starting if starting else source.missing, "webcam")
        why, icon = PILLS.get(self.hindrance, missing)
        words, here = guide_words(guidance, self.mode, why), why
        if self.from_deg and not starting:
            here, icon = FROM_PHOTO, "camera"
        return Guidance(
            phase=guidance.phase,
            sign=_sign(guidance),
            number=guidance.number or 0,
            direction=DIRECTIONS[guidance.direction] or tr("No turn needed"),
            walk=words.walk,
            company=tr("Then {lamp}.", lamp=guidance.lamp) if guidance.lamp else words.company,
            pill=here,
            pill_icon=icon,
            spoken=words.spoken,
        )

    def _advice(self, guidance: Guide) -> str:
        """Return advice for when the heading is lost. It is usually to compare Live with Goal."""
        if guidance.phase is Phase.LEFT:
            return tr("This camera isn't moving with you, so the turn can't be measured.")
        if guidance.phase not in LOST:
            return ""
        turn = turn_words(float(guidance.goal))
        by_eye = tr("Or go by eye until Live looks like Goal: {turn} from the start.", turn=turn)
        sitter = None if self.track is None else self.track.sitter
        if sitter is not None and background_mask(sitter, _COARSE).mean() <= 1.0 - _HIDING:
            return tr(
                "The sitter is blocking the background. Step back, or aim slightly to one side. "
                "{by_eye}",
                by_eye=by_eye,
            )
        return by_eye

    @property
    def _source_words(self) -> SourceWords:
        return source_words(self._camera.chosen.kind)


def _sign(guidance: Guide) -> Sign:
    return "check" if guidance.inside else guidance.direction
