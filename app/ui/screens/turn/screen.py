"""The Turn screen: from the chosen style and the live camera to what to do with one's feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.angles import whole, wrap
from app.core.guidance.guide import Goal, Guide, HeadingSource, Phase
from app.core.guidance.mode import Mode
from app.core.guidance.plan import PlanDrawing, PlanMark, plan_of
from app.core.solver.place_light import main_light
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.model import COMPUTING, Step
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services, sound_words
from app.ui.screens.turn.camera import LiveCamera
from app.ui.screens.turn.guidance import Beeper, GuidanceController
from app.ui.screens.turn.heading_tracker import Aligner, FaceReader, FaceWish, HeadingTracker
from app.ui.screens.turn.photos import DROP_WORDS, Shots
from app.ui.screens.turn.pictures import LiveOverlay, TurnImages, TurnScene
from app.ui.screens.turn.source import SourcesPresenter
from app.ui.screens.turn.state import (
    ASPECT,
    LiveWords,
    Pictures,
    Tools,
    TurnSizes,
    TurnState,
    TurnView,
    face_words,
    goal_of,
    own_style,
    scale_of,
    style_words,
)
from app.words.guidance import guide_words
from app.words.plan import PlanWords, plan_words

if TYPE_CHECKING:
    from app.devices.webcam import WebcamFrame

_FIELDS: Final = frozenset(
    {
        "place_folder",
        "light",
        "front_deg",
        "head",
        "head_name",
        "results",
        "answered",
        "user_styles",
        "chosen",
        "goal_deg",
        "plan",
        "settings",
    }
)
_BESIDE: Final = tr("Live alone until the background is found")
_BLINK_S: Final = 0.6
_BACK: Final[dict[str, tuple[str, str, str]]] = {
    Step.PROBE: (tr("Back to Probe"), "probe", tr("probe")),
    Step.STYLES: (tr("Back to the styles"), "styles", tr("styles")),
    Step.LIGHT: (tr("Back to the lamp"), "light", tr("lamp")),
}


class TurnPresenter(Presenter[TurnView]):
    """Guides the turn."""

    drop_words = DROP_WORDS

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._place_controller = place_controller
        self._sizes = TurnSizes()
        self._on = False
        self._aspect = ASPECT
        self._opacity = 0.45
        self._align_mode = "overlay"
        self._swapped = False
        self._camera = LiveCamera(services, self._refresh)
        self._tracker = HeadingTracker(services, self._refresh)
        self._guidance = GuidanceController(services, self._camera, self._tracker)
        self._aligner = Aligner(services, self._refresh)
        self._face = FaceReader(services, self._refresh)
        self._images = TurnImages(services, self._refresh)
        self._beeper = Beeper(services)
        self.sources = SourcesPresenter(services, self._camera, self._source_taken)
        self._shots = Shots(services, place_controller, lambda: self._tracker.index, self._refresh)
        services.model.changed.connect(self._model_changed)

    def enter(self) -> None:
        """Start the webcam and get to know the panorama."""
        self._on = True
        self._place_controller.photo_taker = self._shots.take
        self._tracker.start()
        self._begin()
        self._refresh()

    def leave(self) -> None:
        """Give the webcam back and be quiet."""
        self._on = False
        self._place_controller.photo_taker = None
        self._beeper.stop()
        self._camera.stop()
        self._tracker.stop()
        self._aligner.switch(on=False)
        self._face.forget()
        self._images.drop_live()
        self._guidance.forget()
        self._shots.settle()

    def actions(self) -> Sequence[Action]:
        """Give what can be done here."""
        back, icon, hint = _BACK[self._origin]
        actions = [
            Action("turn-align", tr("Lay the live picture over the goal"), self.toggle_align,
                   "layers", "Space", lambda: self.can_align, tr("align")),
            Action("turn-sound", tr("Sound on or off"), self.toggle_sounds, "sound", "M",
                   hint=tr("sound")),
            Action("turn-selfie", tr("Selfie: I turn myself, or back"), self.toggle_mode, "selfie",
                   "S", hint=tr("selfie")),
            Action("turn-back", back, self.back, icon, "Esc", hint=hint),
        ]  # fmt: skip
        if fill := self._empty()[1]:
            return [Action("turn-fill", fill, self.fill, "", "Return; Enter"), *actions]
        return [
            *actions,
            Action("turn-photo", tr("Check my shot…"), self.ask_photos,
                   "camera", "P; Return; Enter"),
            Action("turn-watch", tr("Watch a folder for photos…"), self.ask_folder, "folder"),
            Action("turn-source", tr("Other camera, field of view…"), self.ask_source, "webcam"),
            *(
                Action(f"turn-webcam-{index}", tr("Webcam: {name}", name=name),
                       partial(self.choose_webcam, index), "webcam")
                for index, name in self._camera.listed
            ),
        ]  # fmt: skip

    def measure(self, sizes: TurnSizes) -> None:
        """Make pictures of these sizes from now on."""
        if sizes != self._sizes:
            self._sizes = sizes
            self._refresh()

    def tick(self) -> None:
        """Take the newest picture and say what it means. To be called 24 times a second."""
        if not self._on or self._empty()[0]:
            return
        self._camera.tick()
        self.sources.tick()
        frame = self._camera.frame
        if frame is not None and self._camera.source is HeadingSource.LIVE:
            rows, columns = frame.picture.shape[:2]
            self._aspect = max(columns / rows, ASPECT)
            self._tracker.look(
                frame,
                self._camera.fov_deg,
                sees_sitter=self._guidance.sees_sitter,
                asked_deg=self._guidance.asked_deg,
            )
            self._learn_fov()
            self._look_at_face(frame)
            self._look_aligned()
            self._images.want_live(
                frame.picture, self._sizes.well, self._guidance.mode, self._overlay()
            )
        self._refresh()
        if self._services.model.goal_computing:
            # No one is led to a goal that may be another in a moment.
            self._beeper.stop()
            return
        self._note_arrival()
        self._beeper.tick(self._guidance.guide)

    def _note_arrival(self) -> None:
        """Tell the rail: live sees the sitter in the light, or a photo that is kept shows it."""
        model, guide = self._services.model, self._guidance.guide
        aim, reached = model.aim, model.reached
        if aim is not None and self._shots.prove(aim[1], aim[2]):
            reached = aim
        elif guide is not None and guide.now is not None:
            reached = aim if guide.inside else None
        if reached != model.reached:
            model.update(reached=reached)

    def set_mode(self, mode: str) -> None:
        """Say who moves: ``walk`` or ``selfie``."""
        self._services.model.set("mode", mode)

    def toggle_mode(self) -> None:
        """Change over between walking and selfie."""
        self.set_mode("walk" if self._guidance.mode is Mode.SELFIE else "selfie")

    def toggle_sounds(self) -> None:
        """Be heard, or be quiet."""
        on = not self._services.model.settings.sounds
        self._services.model.set("sounds", on)
        words, _ = sound_words(on, self._services.sounds)
        self._services.notify.tell(f"{words}.")

    def answer(self, looks: str) -> None:
        """Say which way the camera looks: ``sitter`` or ``me``."""
        self._services.model.set("camera_looks", looks)

    def toggle_align(self) -> None:
        """Lay the live picture over the goal, or show it alone again."""
        if self._aligner.on or self.can_align:
            self._aligner.switch(on=not self._aligner.on)
            self._refresh()

    def set_align_mode(self, mode: str) -> None:
        """Compare live and goal another way: ``overlay``, ``split`` or ``blink``."""
        self._align_mode = mode
        self._refresh()

    def swap(self) -> None:
        """Show the other one of live and goal, where they do not blink."""
        self._swapped = not self._swapped
        self._refresh()

    def set_opacity(self, per_cent: float) -> None:
        """Let the live picture cover the goal so much, 0 to 100."""
        self._opacity = min(max(per_cent / 100.0, 0.0), 1.0)
        self._refresh()

    def choose_webcam(self, index: int) -> None:
        """Take another webcam."""
        self._source_taken()
        self._camera.choose(index)

    def ask_source(self) -> None:
        """Let another live camera be chosen."""
        if self._view is not None:
            self._view.ask_source()

    def ask_photos(self) -> None:
        """Let the photograph that was taken be chosen."""
        if self._view is not None:
            self._view.ask_photos()

    def ask_folder(self) -> None:
        """Let a folder be chosen that photographs come into."""
        if self._view is not None:
            self._view.ask_folder()

    def watch(self, folder: Path) -> None:
        """Check the photographs that come into a folder from now on."""
        self._shots.watch(folder)

    def open_photos(self, paths: Sequence[Path]) -> None:
        """Say how far off the light photographs were taken; a panorama is opened as a place."""
        if not self._shots.take(paths):
            self._place_controller.open_paths(paths)

    def set_mirrored(self, mirrored: bool) -> None:
        """Read photos as mirror images from now on where the place does not decide, or as taken."""
        self._services.model.set("mirrored", mirrored)

    def remove_shot(self, key: str) -> None:
        """Take a photograph off the list; can be undone."""
        self._shots.remove(key)

    def turn_again(self) -> None:
        """Go back to the guidance with the goal of the photo that was checked last.

        Without a heading the number counts from where that photo was taken.
        """
        shot, model = self._shots.last(), self._services.model
        self._shots.settle()
        self._aligner.switch(on=False)
        self._guidance.forget()
        if shot is not None and shot.facing_deg is not None:
            self._guidance.from_deg = wrap(shot.facing_deg - model.front_deg)
            if any(result.name == shot.style for result in model.results):
                goal = wrap(shot.goal_facing_deg - model.front_deg)
                model.update(chosen=shot.style, needle_deg=None, goal_deg=goal)
        self._refresh()

    def back(self) -> None:
        """Go back one level: from the alignment, else to where one came from."""
        if self._aligner.on:
            self.toggle_align()
        else:
            self._services.model.update(step=self._origin, painting=None)

    @property
    def _origin(self) -> str:
        """Where one came from; where that is not known, where the goal was chosen."""
        lamp = Step.LIGHT if self._services.model.lamp_plan is not None else Step.STYLES
        before = self._services.model.before
        return before if before in _BACK else lamp

    def fill(self) -> None:
        """Go where the empty screen's button says."""
        step = Step.PROBE if self._services.model.light is None else Step.STYLES
        self._services.model.update(step=step, painting=None)

    def demo_turn(self, turn_deg: float) -> None:
        """Put the demo's camera where the sitter has turned so far, from the photographer on."""
        if self._camera.simulated is not None:
            self._camera.simulated.set_turn(self._services.model.azimuth_of(turn_deg))
            self._refresh()

    def demo_step(self, by_deg: float) -> None:
        """Move the demo's camera by some degrees, positive clockwise."""
        here = self._demo_deg()
        if here is not None:
            self.demo_turn(float(here) + by_deg)

    def resolve(self) -> TurnState:
        """Work out what the screen shows now."""
        model = self._services.model
        empty, action = self._empty()
        goal = goal_of(model)
        if empty or goal is None or model.light is None:
            self._guidance.guide = None
            return TurnState(empty, action, self._guidance.mode.value)
        check = self._face.check
        guidance = self._guidance.advance(goal, None if check is None else check.light.pose.yaw_deg)
        scene = self._scene(guidance)
        self._images.want_views(model.light, scene)
        if not model.goal_computing:
            self._want_portraits(guidance, goal)
        source, axis = self._camera.source, self._guidance.axis_turn(guidance)
        style, pictures = style_words(model, guidance), self._pictures(source)
        # A film shows the sitter's own face there.
        frame = self._shots.filmed(model.chosen) if guidance.now is None else None
        if frame is not None and frame.thumbnail is not None:
            style = replace(style, now_tag=frame.name)
            pictures = replace(pictures, now=frame.thumbnail)
        style = replace(style, face=face_words(check, goal.yaw_deg))
        if model.goal_computing:
            style = replace(style, match=COMPUTING, match_at_goal="", face="")
        plan, words = self._plan(guidance, goal)
        return TurnState(
            stale=model.goal_computing,
            mode=self._guidance.mode.value,
            guidance=self._guidance.column(guidance),
            style=style,
            live=self._live_words(guidance),
            scale=scale_of(guidance, goal, scene.panorama_fov_deg, axis, scene.mode),
            plan=plan,
            plan_words=words,
            tools=self._tools(guidance),
            shots=self._shots.resolve(),
            pictures=pictures,
        )

    @property
    def can_align(self) -> bool:
        """Whether there is a live picture to lay over the goal."""
        return self._camera.source is HeadingSource.LIVE and not self._guidance.asking

    def _source_taken(self) -> None:
        """Forget what another camera showed."""
        self._tracker.forget()
        self._images.drop_live()
        self._refresh()

    def _begin(self) -> None:
        self._shots.follow()
        light = self._services.model.light
        if self._on and light is not None and not self._empty()[0]:
            self._tracker.learn(light, self._services.model.place_folder)
            self._camera.start()

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & {"place_folder", "front_deg"}:
            self._guidance.from_deg = 0.0
        if not names & _FIELDS:
            return
        self._begin()
        self._refresh()

    def _empty(self) -> tuple[str, str]:
        model = self._services.model
        if model.light is None:
            return tr("No light measured yet."), tr("Go to Probe")
        if model.target_turn_deg is None:
            if model.goal_computing:
                return COMPUTING, ""
            return tr("No style chosen yet."), tr("Choose a style")
        return "", ""

    def _scene(self, guidance: Guide) -> TurnScene:
        return TurnScene(
            goal_deg=float(guidance.goal),
            front_deg=self._services.model.front_deg,
            looks=self._guidance.looks,
            mode=self._guidance.mode,
            fov_deg=self._camera.fov_guess_deg,
            camera_m=self._camera.distance_m,
            well=self._sizes.well,
            strip=self._sizes.strip,
        )

    def _plan(self, guidance: Guide, goal: Goal) -> tuple[PlanDrawing, PlanWords]:
        """Draw up the walk, with what lights the sitter: the lamp to hold, or the place."""
        model, lamp = self._services.model, self._services.model.lamp_plan
        main = None if model.light is None else main_light(model.light, model.front_deg)
        lights: list[PlanMark] = []
        if main is not None:
            # A face counts toward its left, a turn clockwise.
            lights.append(PlanMark("light", wrap(-main)))
        if lamp is not None:
            nose = guidance.goal - goal.yaw_deg
            lights.append(PlanMark("lamp", wrap(nose - lamp.azimuth_deg), lamp.lamp))
        mode, words = self._guidance.mode, guide_words(guidance, self._guidance.mode)
        step = words.light if guidance.inside else words.walk
        plan = plan_of(guidance, goal, mode, self._guidance.from_deg, lights)
        return plan, plan_words(plan, step)

    def _want_portraits(self, guidance: Guide, goal: Goal) -> None:
        model, size = self._services.model, self._sizes.portrait
        if model.head is None or model.light is None or model.chosen is None:
            return
        head, yaw = model.head, goal.yaw_deg
        own, name = own_style(model), model.pack_style or model.chosen
        painted = None if own is None or own.copy_of else own
        self._images.want_target(head, yaw, painted, name, size)
        turn = float(guidance.goal if guidance.now is None else guidance.now)
        # Light falls on a face by where its nose points.
        facing = model.azimuth_of(turn - yaw)
        self._images.want_now(head, yaw, model.light, facing, size, model.lamp_plan)

    def _live_words(self, guidance: Guide) -> LiveWords:
        tag = ""
        if self._aligner.on and self.can_align:
            alignment = self._aligner.alignment
            agrees = alignment is not None and alignment.status == "found"
            tag = tr("Aligned") if agrees else tr("Not yet aligned")
            tag = _BESIDE if self._unsure else f"{self._compared()}. {tag}"
        words = self._guidance.live_words()
        return replace(
            words,
            name=self._camera.name,
            tag=tag,
            asking=self._guidance.asking,
            aspect=self._aspect,
        )

    def _pictures(self, source: HeadingSource) -> Pictures:
        pictures = self._images.pictures
        # Without a webcam the goal stands in both places.
        return replace(pictures, live=pictures.goal) if source is HeadingSource.NONE else pictures

    def _tools(self, guidance: Guide) -> Tools:
        quality, icon = self._guidance.quality(guidance)
        settings = self._services.model.settings
        return Tools(
            aligning=self._aligner.on and self.can_align,
            can_align=self.can_align,
            align_mode=self._align_mode,
            swaps=self._align_mode == "blink" and self._services.model.calm,
            opacity=round(100.0 * self._opacity),
            quality=quality,
            quality_icon=icon,
            demo_deg=self._demo_deg(),
            webcams=self._camera.listed,
            webcam=self._camera.index,
            looks=self._camera.looks,
            sounds=settings.sounds and self._services.sounds.available,
        )

    def _learn_fov(self) -> None:
        track = self._guidance.track
        if track is not None and track.fov_deg is not None and track.status == "tracking":
            self._camera.learn_fov(track.fov_deg)

    def _look_at_face(self, frame: WebcamFrame) -> None:
        """Hold what the sitter's face shows against the style, as far as both are known."""
        model, track, guidance = self._services.model, self._guidance.track, self._guidance.guide
        goal, result, head, light = goal_of(model), model.goal_result, model.head, model.light
        is_reliable = (
            guidance is not None and guidance.now is not None and self._guidance.sees_sitter
        )
        doll = self._camera.simulated is not None  # the demo's sitter has no real face
        if not is_reliable or doll or track is None or model.lamp_plan is not None:
            self._face.forget()
        elif goal and result and head and light and guidance and guidance.now is not None:
            name = model.pack_style or result.name
            wish = FaceWish(light, head, name, *goal.facing(model.front_deg))
            face = None if track.sitter is None else track.sitter.face
            self._face.look(frame.picture, face, wish, model.azimuth_of(float(guidance.now)))

    def _look_aligned(self) -> None:
        views, frame = self._images.views, self._camera.frame
        if views is not None and frame is not None and self._aligner.on:
            fovs = (views.scene.panorama_fov_deg, self._camera.fov_guess_deg)
            self._aligner.look(frame.picture, views.target, fovs)

    @property
    def _unsure(self) -> bool:
        """Whether live cannot be laid on the goal: then they are shown side by side."""
        alignment, guidance = self._aligner.alignment, self._guidance.guide
        is_aligned = alignment is not None and alignment.status == "found"
        return (
            not is_aligned and guidance is not None and guidance.phase in (Phase.LOST, Phase.LEFT)
        )

    def _overlay(self) -> LiveOverlay | None:
        views, alignment = self._images.views, self._aligner.alignment
        if not self._aligner.on or views is None or not self.can_align or self._unsure:
            return None
        homography = alignment.homography if alignment is not None else None
        opacity = self._opacity
        if self._align_mode == "blink":
            opacity = 1.0 if self._live_in_turn() else 0.0
        return LiveOverlay(views.goal, homography, opacity, self._align_mode == "split")

    def _live_in_turn(self) -> bool:
        """Whether it is live's turn while the two blink, or are swapped by hand."""
        if self._services.model.calm:
            return not self._swapped
        return int(self._services.clock.now() / _BLINK_S) % 2 == 0

    def _compared(self) -> str:
        if self._align_mode == "blink":
            return tr("Live") if self._live_in_turn() else tr("Goal")
        split = self._align_mode == "split"
        return tr("Live on the left, goal on the right") if split else tr("Live over the goal")

    def _demo_deg(self) -> int | None:
        simulated = self._camera.simulated
        if simulated is None:
            return None
        return whole(wrap(simulated.turn_deg - self._services.model.front_deg))
