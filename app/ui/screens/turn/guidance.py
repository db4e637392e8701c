"""From what the camera sees to what is said, seen and heard: the guidance of this moment."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeAlias

import numpy as np

from app.core.base.angles import difference, wrap
from app.core.guidance.beeps import Cue, Sound, cue, samples
from app.core.guidance.guide import FRESH, Goal, Guide, HeadingSource, Phase, Reading, guide
from app.core.guidance.mode import Mode
from app.core.localization.heading_conversion import Looks, sees_sitter, turn_of_heading
from app.core.localization.sitter import background_mask
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.screens.turn.state import Guidance, LiveWords, Sign
from app.words.guidance import DIRECTIONS, guide_words, trouble_line
from app.words.phrases.turns import turn_words

if TYPE_CHECKING:
    from app.core.localization.tracking import Track
    from app.ui.screens.turn.camera import LiveCamera
    from app.ui.screens.turn.heading_tracker import HeadingTracker

Hindrance: TypeAlias = Literal["none", "learning", "looking", "asking", "blank"]
"""Why there is no heading: the panorama is being learnt, no picture was looked at yet, it is not
known which way the camera looks, or there is nothing in the panorama to find it by."""

_PILLS: Final[dict[Hindrance, tuple[str, str]]] = {
    "learning": (tr("Learning the background"), "refresh"),
    "looking": (tr("Looking for the background"), "target"),
    # Without the answer left and right could be mistaken.
    "asking": (tr("Say which way the camera looks"), "help"),
    "blank": (tr("No heading here"), "warning"),
}
_ICONS: Final = {Phase.LOST: "target", Phase.LEFT: "walk", Phase.AWAY: "warning"}


class _SourceWords(NamedTuple):
    """What a kind of live source is called, and what is said of it."""

    noun: str
    starting: str
    gone_words: str
    remedy: str
    missing: str


_SOURCES: Final = {
    "webcam": _SourceWords(
        tr("webcam"),
        tr("Starting the webcam"),
        tr("Webcam disconnected"),
        tr("Plug it back in to continue."),
        tr("No webcam"),
    ),
    "network": _SourceWords(
        tr("network camera"),
        tr("Connecting to the network camera"),
        tr("Network camera lost"),
        tr("Turnlight connects again by itself."),
        tr("No network camera"),
    ),
    "video": _SourceWords(
        tr("video"),
        tr("Opening the video"),
        tr("The video stopped"),
        tr("Choose it again."),
        tr("No video"),
    ),
}
_SURENESS: Final = ((0.9, tr("certain")), (0.7, tr("likely")), (0.0, tr("doubtful")))
_LEFT: Final = tr("The best is a little to your left.")
_RIGHT: Final = tr("The best is a little to your right.")
_REST: Final = {Mode.WALK: (_RIGHT, _LEFT), Mode.SELFIE: (_LEFT, _RIGHT)}
_COARSE: Final = (36, 48)
_HIDING: Final = 0.55  # of the picture: a sitter who is larger leaves too little of the background
_PAUSE_S: Final = 3.0  # between two sentences that are announced
_LOOPS: Final = 8  # of the steady tone, one second each, whose end joins its start
_EARLY_S: Final = 0.04  # rather cut the tone a little than let it fall silent


class GuidanceController:
    """Knows the turn of this moment, and what the guidance needs to remember.

    Attributes:
        guide: What was said last; None while there is nothing to turn to.
        asked_deg: How far it is to the light, deg, whatever is shown; None where unknown.
        from_deg: Turn of the photograph that was checked last, deg; 0 is the start. Without a
            heading the number counts from there.
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
        live = self._camera.source is HeadingSource.LIVE
        return live and self.mode is Mode.WALK and self._camera.looks == "ask"

    @property
    def sees_sitter(self) -> bool:
        """Whether the person in the picture is the sitter."""
        return sees_sitter(self.looks, self.mode)

    @property
    def track(self) -> Track | None:
        """What is known of where the camera points; None before the first picture."""
        track = self._tracker.track
        return track if track is not None and track.raw is not None else None

    def forget(self) -> None:
        """Start over."""
        self._memory, self.asked_deg, self.from_deg = FRESH, None, 0.0

    def advance(self, goal: Goal, yaw_deg: float | None = None) -> Guide:
        """Work out what to say now, and remember what the next moment needs.

        `yaw_deg`: how the sitter's face is turned; None where none is read.
        """
        self.hindrance, reading = self._reading()
        reading = replace(reading, yaw_deg=yaw_deg)
        if reading.source is not HeadingSource.LIVE:
            self.asked_deg = None
        elif reading.turn_deg is not None:
            # Whatever is shown: a camera that was left behind is still asked to turn.
            guidance, _ = guide(goal, replace(reading, left_behind=False))
            self.asked_deg = None if guidance.until_light is None else float(guidance.until_light)
        self.guide, self._memory = guide(goal, reading, self._memory)
        return self.guide

    def axis_turn(self, guidance: Guide) -> float | None:
        """Where the camera's axis points, as a turn beside the one that is shown, deg."""
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
        return "none", Reading(self._turn(), now, source, left_behind, self.from_deg)

    def _turn(self) -> float | None:
        track = self.track
        if track is None:
            return None
        return track.turn_deg(self.looks, self.mode, self._services.model.front_deg)

    def column(self, guidance: Guide) -> Guidance:
        """Write the right column, and what a reader is told: a sentence in some seconds."""
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
            # The lamp is what counts now, in words that can be read from afar.
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
        # "4° to the best": the number itself is drawn large.
        base = replace(base, number_words=tr("to the best"), pill_icon="check", inside=True)
        if guidance.lamp:
            return base
        walk = tr("Hold it") if guidance.hold else ""
        rest = "" if guidance.hold else _REST[self.mode][guidance.direction == "clockwise"]
        company = "\n".join(part for part in (rest, words.sitter) if part)
        return replace(base, direction=tr("Take the picture"), walk=walk, company=company)

    def _sentence(self, guidance: Guide) -> Guidance:
        """Say one sentence, without a number: what is wrong with the picture counts first."""
        error = self._camera.error
        if error is not None and guidance.phase is Phase.LOST:
            message, icon = str(error), "warning"
        else:
            is_away = guidance.phase is Phase.AWAY
            message = _gone_words(self._source_words) if is_away else guide_words(guidance).headline
            icon = _ICONS.get(guidance.phase, "webcam")
        return Guidance(guidance.phase, sentence=message, sentence_icon=icon, spoken=message)

    def _whole_turn(self, guidance: Guide) -> Guidance:
        """Without a heading the whole turn is shown, to be made by eye."""
        source = self._source_words
        starting = guidance.phase is Phase.STARTING
        missing = (source.starting if starting else source.missing, "webcam")
        why, icon = _PILLS.get(self.hindrance, missing)
        words, here = guide_words(guidance, self.mode, why), why
        if self.from_deg and not starting:
            here, icon = tr("From where the photo was taken"), "camera"
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
        """Say what can be done while the heading is not known: go by the pictures."""
        if guidance.phase is Phase.LEFT:
            return tr("This camera isn't moving with you, so the turn can't be measured.")
        if guidance.phase is not Phase.LOST:
            return ""
        turn = turn_words(float(guidance.goal))
        by_eye = tr("Or go by eye until Live looks like Goal: {turn} from the start.", turn=turn)
        sitter = None if self.track is None else self.track.sitter
        if sitter is not None and background_mask(sitter, _COARSE).mean() <= 1.0 - _HIDING:
            return tr(
                "The sitter hides it: step back, or aim a little beside them. {by_eye}",
                by_eye=by_eye,
            )
        return by_eye

    def live_words(self) -> LiveWords:
        """Say what the two wells show; in a selfie both are mirrored."""
        source, error = self._camera.source, self._camera.error
        words, selfie = self._source_words, self.mode is Mode.SELFIE
        view_words = tr("what the camera should see")
        if selfie:
            view_words = tr("what the camera should see, mirrored")
        if source is HeadingSource.LIVE:
            message, brief = ("", "") if error is None else (str(error), error.message)
            live = tr("{source}, mirrored", source=words.noun) if selfie else words.noun
            return LiveWords(live, view_words, message=message, brief=brief)
        if source is HeadingSource.AWAY:
            gone_words = _gone_words(words)
            return LiveWords(
                tr("last picture"), view_words, message=gone_words, brief=words.gone_words, dim=True
            )
        if source is HeadingSource.STARTING:
            return LiveWords(words.starting, view_words)
        message = tr("{trouble}. Turn by the number.", trouble=words.missing)
        brief = words.missing
        if error is not None and error.code != "no-webcam":
            message, brief = str(error), error.message
        live = tr("{trouble}: the goal", trouble=words.missing)
        return LiveWords(live, view_words, message=message, brief=brief)

    def quality(self, guidance: Guide) -> tuple[str, str]:
        """Say how well the heading is known, in words and with an icon."""
        source, tracker, track = self._camera.source, self._tracker, self.track
        words = self._source_words
        if source is HeadingSource.AWAY:
            return words.gone_words, "warning"
        if source is HeadingSource.NONE:
            return words.missing, "webcam"
        if source is HeadingSource.STARTING:
            return words.starting, "webcam"
        if tracker.error is not None:
            return str(tracker.error), "warning"
        if tracker.learning:
            return tr("Learning the background of this place…"), "refresh"
        if guidance.phase in (Phase.LOST, Phase.LEFT):
            wrong = self._camera.error
            return trouble_line(guidance.phase) if wrong is None else wrong.message, "target"
        if track is None or track.heading_deg is None:
            return tr("Looking for the background"), "target"
        sureness = confidence_words(track.confidence)
        if self.sees_sitter and track.sitter is None:
            return tr("Heading {sureness}, no sitter seen", sureness=sureness), "target"
        return tr("Heading {sureness}", sureness=sureness), "target"

    @property
    def _source_words(self) -> _SourceWords:
        return _SOURCES.get(self._camera.chosen.kind, _SOURCES["webcam"])


def _gone_words(words: _SourceWords) -> str:
    """Say that a source stopped, and what to do about it."""
    return f"{words.gone_words}. {words.remedy}" if words.remedy else f"{words.gone_words}."


def _sign(guidance: Guide) -> Sign:
    return "check" if guidance.inside else guidance.direction


def confidence_words(confidence: float) -> str:
    """Write how sure a heading is, from 0 to 1, in a word.

    Examples:
        >>> confidence_words(0.999), confidence_words(0.84), confidence_words(0.4)
        ('certain', 'likely', 'doubtful')
    """
    return next(words for least, words in _SURENESS if confidence >= least)


class Beeper:
    """Plays what a guide asks for, as the settings allow."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._playing: Sound = "none"
        self._next_s = 0.0

    def tick(self, guidance: Guide | None) -> None:
        """Play the next sound if it is time for it.

        `guidance`: what the screen says; None for nothing to be heard.
        """
        settings = self._services.model.settings
        target_cue = Cue("none") if guidance is None or not settings.sounds else cue(guidance)
        if target_cue.sound == "none":
            self.stop()
            return
        now = self._services.clock.now()
        every = target_cue.every_s or _LOOPS - _EARLY_S
        if target_cue.sound == self._playing:
            # Nearer than before, the next beep comes sooner than it was meant to.
            self._next_s = min(self._next_s, now + every)
            if now < self._next_s:
                return
        elif self._playing == "steady":
            self._services.sounds.stop()
        self._playing, self._next_s = target_cue.sound, now + every
        volume = settings.volume / 100.0
        sound = samples(target_cue.sound, target_cue.step)
        if target_cue.sound == "steady":
            sound = np.tile(sound, _LOOPS)
        self._services.sounds.play(sound, volume)

    def stop(self) -> None:
        """Be quiet."""
        if self._playing != "none":
            self._playing = "none"
            self._services.sounds.stop()
