"""The Turn screen: from the chosen style and the live camera to what to do with one's feet."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.angles import wrap
from app.core.turning.guidance import FRESH, Guide, Phase, Reading, Source, guide
from app.core.turning.headings import Looks, turn_of_heading
from app.core.turning.words import Mode, whole
from app.ui.presenters.actions import Action
from app.ui.presenters.model import Step
from app.ui.presenters.turn_album import Album
from app.ui.presenters.turn_camera import LiveCamera
from app.ui.presenters.turn_pictures import Overlay, Scene
from app.ui.presenters.turn_sight import Aligner, Sight
from app.ui.presenters.turn_sounds import Beeper
from app.ui.presenters.turn_state import (
    ASPECT,
    LiveWords,
    Pictures,
    StyleWords,
    Tools,
    TurnSizes,
    TurnState,
)
from app.ui.presenters.turn_words import (
    goal_of,
    guidance_of,
    live_words,
    match_words,
    quality_words,
    scale_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.painting import UserStyle
    from app.core.turning.guidance import Goal
    from app.ui.presenters.desk import Desk
    from app.ui.presenters.services import Services
    from app.ui.presenters.turn_state import Guidance, TurnView
    from app.ui.presenters.turn_words import Hindrance

__all__ = ["TurnPresenter"]

_SHOWN: Final = frozenset(
    {"light", "front_deg", "head", "results", "user_styles", "chosen", "goal_deg", "settings"}
)
_ANNOUNCE_S: Final = 3.0


class TurnPresenter:
    """Guides the turn.

    Parameters
    ----------
    services : Services
        The window's.
    desk : Desk
        The open place.
    """

    def __init__(self, services: Services, desk: Desk) -> None:
        del desk
        self._services = services
        self._view: TurnView | None = None
        self._sizes = TurnSizes()
        self._on = False
        self._memory = FRESH
        self._guide: Guide | None = None
        self._hindrance: Hindrance = "none"
        self._aspect = ASPECT
        self._opacity = 0.45
        self._announced: tuple[Phase | None, str, float] = (None, "", -_ANNOUNCE_S)
        self._camera = LiveCamera(services, self._show)
        self._sight = Sight(services, self._show)
        self._aligner = Aligner(services, self._show)
        self._album = Album(services, self._show)
        self._beeper = Beeper(services)
        services.model.changed.connect(self._model_changed)

    # -- as every screen's presenter -----------------------------------------------------------

    def attach(self, view: TurnView) -> None:
        """Show everything in `view` from now on."""
        self._view = view
        self._show()

    def detach(self) -> None:
        """Show nothing any more; the webcam stays on until the screen is left."""
        self._view = None

    def entered(self) -> None:
        """Start the webcam and get to know the panorama."""
        self._on = True
        self._sight.start()
        self._begin()
        self._show()

    def left(self) -> None:
        """Give the webcam back and be quiet."""
        self._on = False
        self._beeper.stop()
        self._camera.stop()
        self._sight.stop()
        self._aligner.switch(on=False)
        self._album.drop_live()
        self._memory = FRESH

    def actions(self) -> Sequence[Action]:
        """Give what can be done here."""
        actions = [
            Action(
                "turn-align",
                "Lay the live picture over the goal",
                self.toggle_align,
                "layers",
                "Space",
                self._can_align,
                "align",
            ),
            Action("turn-sound", "Sound on or off", self.toggle_sounds, "sound", "M", hint="sound"),
            Action(
                "turn-selfie",
                "Selfie: I turn myself, or back",
                self.toggle_mode,
                "selfie",
                "S",
                hint="selfie",
            ),
            Action("turn-back", "Back to the styles", self.back, "styles", "Esc", hint="styles"),
        ]
        if self._empty()[0]:
            return [Action("turn-fill", self._empty()[1], self.fill, "", "Return; Enter"), *actions]
        for index, name in self._camera.listed:
            actions.append(
                Action(
                    f"turn-webcam-{index}",
                    f"Webcam: {name}",
                    lambda index=index: self.choose_webcam(index),  # type: ignore[misc]
                    "webcam",
                )
            )
        return actions

    def measure(self, sizes: TurnSizes) -> None:
        """Make pictures of these sizes from now on."""
        if sizes != self._sizes:
            self._sizes = sizes
            self._show()

    def tick(self) -> None:
        """Go on: take the newest picture and say what it means. To be called 24 times a second."""
        if not self._on or self._empty()[0]:
            return
        self._camera.tick()
        frame = self._camera.frame
        if frame is not None and self._camera.source is Source.LIVE:
            rows, columns = frame.picture.shape[:2]
            self._aspect = max(columns / rows, ASPECT)
            self._sight.look(frame, self._camera.fov_deg)
            self._look_aligned()
            self._album.want_live(frame.picture, self._sizes.well, self._mode, self._overlay())
        self._show()
        self._beeper.tick(self._guide)

    # -- what the user does --------------------------------------------------------------------

    def set_mode(self, mode: str) -> None:
        """Say who moves: ``walk`` or ``selfie``."""
        self._change("mode", mode)

    def toggle_mode(self) -> None:
        """Change over between walking and selfie."""
        self.set_mode("walk" if self._mode is Mode.SELFIE else "selfie")

    def toggle_sounds(self) -> None:
        """Be heard, or be quiet."""
        heard = not self._services.model.settings.sounds
        self._change("sounds", heard)
        self._services.notify.tell("Sound on: quicker as you get near." if heard else "Sound off.")

    def answer(self, looks: str) -> None:
        """Say which way the camera looks: ``sitter`` or ``me``."""
        self._change("camera_looks", looks)

    def toggle_align(self) -> None:
        """Lay the live picture over the goal, or show it alone again."""
        if self._aligner.on or self._can_align():
            self._aligner.switch(on=not self._aligner.on)
            self._show()

    def set_opacity(self, per_cent: float) -> None:
        """Let the live picture cover the goal so much, 0 to 100."""
        self._opacity = min(max(per_cent / 100.0, 0.0), 1.0)
        self._show()

    def choose_webcam(self, index: int) -> None:
        """Take another webcam."""
        self._sight.forget()
        self._album.drop_live()
        self._camera.choose(index)

    def back(self) -> None:
        """Go back to the styles."""
        self._services.model.update(step=Step.STYLES, painting=None)

    def fill(self) -> None:
        """Go where the empty screen's button says."""
        step = Step.PROBE if self._services.model.light is None else Step.STYLES
        self._services.model.update(step=step, painting=None)

    def demo_turn(self, turn_deg: float) -> None:
        """Put the demo's camera where the sitter has turned so far.

        Parameters
        ----------
        turn_deg : float
            Deg, counted from where the photographer stands.
        """
        if self._camera.simulated is not None:
            self._camera.simulated.set_turn(self._services.model.azimuth_of(turn_deg))
            self._show()

    def demo_step(self, by_deg: float) -> None:
        """Move the demo's camera by some degrees, positive clockwise."""
        here = self._demo_deg()
        if here is not None:
            self.demo_turn(float(here) + by_deg)

    # -- what is shown -------------------------------------------------------------------------

    def resolve(self) -> TurnState:
        """Work out what the screen shows now."""
        model = self._services.model
        empty, action = self._empty()
        goal = goal_of(model.result, model.target_turn_deg)
        if empty or goal is None or model.light is None:
            self._guide = None
            return TurnState(empty, action, self._mode.value)
        shown = self._advance(goal)
        scene = self._scene(shown)
        self._album.want_views(model.light, scene)
        self._want_portraits(shown)
        source = self._camera.source
        words = live_words(
            source,
            self._camera.error,
            shown.goal,
            self._camera.fov_deg,
            self._mode is Mode.SELFIE,
        )
        return TurnState(
            mode=self._mode.value,
            guidance=self._announce(guidance_of(shown, self._hindrance, self._camera.error)),
            style=self._style_words(shown),
            live=self._with_camera(words),
            scale=scale_of(shown, goal, scene.panorama_fov_deg),
            tools=self._tools(shown),
            pictures=self._pictures(source),
        )

    @property
    def _mode(self) -> Mode:
        return Mode(self._services.model.settings.mode)

    @property
    def _looks(self) -> Looks:
        return Looks.PHOTOGRAPHER if self._camera.looks == "me" else Looks.SITTER

    @property
    def _asking(self) -> bool:
        """In a selfie the photographer is the sitter, and either answer would be the same."""
        live = self._camera.source is Source.LIVE
        return live and self._mode is Mode.WALK and self._camera.looks == "ask"

    def _show(self) -> None:
        if self._view is not None:
            self._view.show_state(self.resolve())

    def _begin(self) -> None:
        light = self._services.model.light
        if self._on and light is not None and not self._empty()[0]:
            self._sight.learn(light)
            self._camera.start()

    def _model_changed(self, names: frozenset[str]) -> None:
        if not names & _SHOWN:
            return
        self._begin()
        self._show()

    def _change(self, key: str, value: object) -> None:
        model = self._services.model
        model.update(settings=model.settings.with_(key, value))

    def _empty(self) -> tuple[str, str]:
        model = self._services.model
        if model.light is None:
            return "No light measured yet.", "Go to Probe"
        if model.target_turn_deg is None:
            return "No style chosen yet.", "Choose a style"
        return "", ""

    def _advance(self, goal: Goal) -> Guide:
        """Work out the guide of this moment, and remember what the next one needs."""
        self._hindrance, reading = self._reading()
        self._guide, self._memory = guide(goal, reading, self._memory, self._mode)
        return self._guide

    def _reading(self) -> tuple[Hindrance, Reading]:
        now, source = self._services.clock.now(), self._camera.source
        if source is Source.LIVE and self._asking:
            return "asking", Reading(None, now, Source.NONE)
        if source is Source.LIVE and self._sight.error is not None:
            return "blank", Reading(None, now, Source.NONE)
        if source is Source.LIVE and (self._sight.learning or self._sight.heading is None):
            return "learning", Reading(None, now, Source.STARTING)
        return "none", Reading(self._turn(), now, source)

    def _turn(self) -> float | None:
        heading = self._sight.heading
        if heading is None or heading.heading_deg is None:
            return None
        return turn_of_heading(
            heading.heading_deg,
            looks=self._looks,
            mode=self._mode,
            front_deg=self._services.model.front_deg,
        )

    def _scene(self, shown: Guide) -> Scene:
        return Scene(
            goal_deg=float(shown.goal),
            front_deg=self._services.model.front_deg,
            looks=self._looks,
            mode=self._mode,
            fov_deg=self._camera.fov_deg,
            camera_m=self._camera.distance_m,
            well=self._sizes.well,
            strip=self._sizes.strip,
        )

    def _announce(self, guidance: Guidance) -> Guidance:
        """Do not talk without a pause: one sentence in some seconds, or a new state."""
        now = self._services.clock.now()
        phase, told, since = self._announced
        if guidance.phase is not phase or (guidance.spoken != told and now - since >= _ANNOUNCE_S):
            self._announced = (guidance.phase, guidance.spoken, now)
        return replace(guidance, announced=self._announced[1])

    def _style_words(self, shown: Guide) -> StyleWords:
        model = self._services.model
        result, own = model.result, self._own()
        if result is None:
            return StyleWords()
        built_in = model.head.pack.styles if model.head is not None else ()
        style = next((one for one in built_in if one.name == result.name), None)
        title = own.title if own is not None else result.title
        side = own.side_words if own is not None else style.side_words if style else ""
        match, at_goal = match_words(result, model.goal_deg, shown.now)
        tag = "Now" if shown.now is not None else "At the goal"
        return StyleWords(title, side.replace(" (", "\n(") or "painted", match, at_goal, tag)

    def _own(self) -> UserStyle | None:
        model = self._services.model
        return next((one for one in model.user_styles if one.name == model.chosen), None)

    def _want_portraits(self, shown: Guide) -> None:
        model, size = self._services.model, self._sizes.portrait
        if model.head is None or model.light is None or model.chosen is None:
            return
        self._album.want_target(model.head, self._own(), model.chosen, size)
        turn = float(shown.goal if shown.now is None else shown.now)
        self._album.want_now(model.head, model.light, model.azimuth_of(turn), size)

    def _with_camera(self, words: LiveWords) -> LiveWords:
        tag = ""
        if self._aligner.on and self._can_align():
            found = self._aligner.alignment
            agreed = found is not None and found.status == "found"
            tag = "Live lies on the goal" if agreed else "Live over the goal, not yet aligned"
        return replace(
            words, name=self._camera.name, tag=tag, asking=self._asking, aspect=self._aspect
        )

    def _pictures(self, source: Source) -> Pictures:
        pictures = self._album.pictures
        # Without a webcam the goal stands in both places.
        return replace(pictures, live=pictures.goal) if source is Source.NONE else pictures

    def _tools(self, shown: Guide) -> Tools:
        quality, icon, bad = self._quality(shown)
        settings = self._services.model.settings
        return Tools(
            aligning=self._aligner.on and self._can_align(),
            can_align=self._can_align(),
            opacity=round(100.0 * self._opacity),
            quality=quality,
            quality_icon=icon,
            quality_bad=bad,
            demo_deg=self._demo_deg(),
            webcams=self._camera.listed,
            webcam=self._camera.index,
            looks=self._camera.looks,
            sounds=settings.sounds,
        )

    def _quality(self, shown: Guide) -> tuple[str, str, bool]:
        sight = self._sight
        wrong = self._camera.error
        lost = ""
        if shown.phase is Phase.LOST:
            lost = shown.headline if wrong is None else wrong.message
        return quality_words(self._camera.source, sight.error, sight.learning, lost, sight.heading)

    def _can_align(self) -> bool:
        return self._camera.source is Source.LIVE and not self._asking

    def _look_aligned(self) -> None:
        views, frame = self._album.views, self._camera.frame
        if views is not None and frame is not None and self._aligner.on:
            fovs = (views.scene.panorama_fov_deg, self._camera.fov_deg)
            self._aligner.look(frame.picture, views.target, fovs)

    def _overlay(self) -> Overlay | None:
        views, found = self._album.views, self._aligner.alignment
        if not self._aligner.on or views is None or not self._can_align():
            return None
        homography = found.homography if found is not None else None
        return Overlay(views.goal, homography, self._opacity)

    def _demo_deg(self) -> int | None:
        simulated = self._camera.simulated
        if simulated is None:
            return None
        return whole(wrap(simulated.turn_deg - self._services.model.front_deg))
