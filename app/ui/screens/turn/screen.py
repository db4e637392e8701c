"""The Turn screen, which combines its panels and guides the sitter to the goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.core.base.angles import whole, wrap
from app.core.guidance.guide import Goal, Guide, HeadingSource
from app.core.guidance.who_moves import Mode
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services, sound_words
from app.ui.presenters.window_model import COMPUTING, NO_LIGHT, Step
from app.ui.screens.turn.background_strip import scale_of
from app.ui.screens.turn.beep_player import BeepPlayer
from app.ui.screens.turn.goal import TurnScene
from app.ui.screens.turn.guidance import GuidanceController
from app.ui.screens.turn.live.alignment import AlignmentPanel
from app.ui.screens.turn.live.camera import LiveCamera
from app.ui.screens.turn.live.face import FaceReader, FaceWish
from app.ui.screens.turn.live.heading_tracker import HeadingTracker
from app.ui.screens.turn.live.live import ASPECT, LivePanel
from app.ui.screens.turn.live.source import SourcesPresenter
from app.ui.screens.turn.photos.photos import DROP_WORDS, Shots
from app.ui.screens.turn.pictures import Pictures, TurnImages
from app.ui.screens.turn.plan import walk_plan
from app.ui.screens.turn.portraits import StyleWords, style_words
from app.ui.screens.turn.state import TurnSizes, TurnState, TurnView

if TYPE_CHECKING:
    from app.devices.webcam import WebcamFrame

NO_STYLE: Final = tr("No style chosen yet.")
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
BACK: Final[dict[str, tuple[str, str, str]]] = {
    Step.PROBE: (tr("Back to Probe"), "probe", tr("probe")),
    Step.STYLES: (tr("Back to the styles"), "styles", tr("styles")),
    Step.LIGHT: (tr("Back to the lamp"), "light", tr("lamp")),
}


class TurnPresenter(Presenter[TurnView]):
    """Guides the sitter to the goal.

    Attributes:
        alignment, shots, sources: The panels that the view calls directly.
    """

    drop_words = DROP_WORDS

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._place_controller = place_controller
        self._sizes = TurnSizes()
        self._on = False
        self._state: TurnState | None = None
        self._camera = LiveCamera(services, self._refresh)
        self._tracker = HeadingTracker(services, self._refresh)
        self._guidance = GuidanceController(services, self._camera, self._tracker)
        self._live = LivePanel(services, self._camera, self._tracker, self._guidance)
        self.alignment = AlignmentPanel(services, self._camera, self._guidance, self._refresh)
        self._face = FaceReader(services, self._refresh)
        self._images = TurnImages(services, self._refresh)
        self._beeps = BeepPlayer(services)
        self.sources = SourcesPresenter(services, self._camera, self._source_taken)
        self.shots = Shots(
            services, place_controller, lambda: self._tracker.index, self._show_shots
        )
        services.model.changed.connect(self._model_changed)

    def enter(self) -> None:
        """Start the camera and build the index of the place's background."""
        self._on = True
        self._place_controller.photo_taker = self.shots.take
        self._tracker.start()
        self._begin()
        self._refresh()

    def leave(self) -> None:
        """Stop the camera and the sound."""
        self._on = False
        self._place_controller.photo_taker = None
        self._beeps.stop()
        self._camera.stop()
        self._tracker.stop()
        self.alignment.stop()
        self._face.forget()
        self._images.drop_live()
        self._guidance.forget()
        self.shots.settle()

    def actions(self) -> Sequence[Action]:
        """Return the available actions."""
        back, icon, hint = BACK[self._origin]
        actions = [
            Action("turn-align", tr("Lay the live picture over the goal"), self.alignment.toggle,
                   "layers", "Space", lambda: self.alignment.available, tr("align")),
            Action("turn-sound", tr("Turn sound on or off"), self.toggle_sounds, "sound", "M",
                   hint=tr("sound")),
            Action("turn-selfie", tr("Turn selfie mode on or off"), self.toggle_mode, "selfie",
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
        """Set the sizes of the pictures."""
        if sizes != self._sizes:
            self._sizes = sizes
            self._refresh()

    def tick(self) -> None:
        """Show the newest picture and its guidance. The view calls this 25 times a second."""
        if not self._on or self._empty()[0]:
            return
        self._camera.tick()
        self.sources.tick()
        frame = self._camera.frame
        if frame is not None and self._camera.source is HeadingSource.LIVE:
            rows, columns = frame.picture.shape[:2]
            self._live.aspect = max(columns / rows, ASPECT)
            self._tracker.look(
                frame,
                self._camera.fov_deg,
                sees_sitter=self._guidance.sees_sitter,
                asked_deg=self._guidance.asked_deg,
            )
            self._learn_fov()
            self._look_at_face(frame)
            views = self._images.views
            self.alignment.look(views)
            self._images.want_live(
                frame.picture, self._sizes.well, self._guidance.mode, self.alignment.overlay(views)
            )
        self._refresh()
        if self._services.model.goal_computing:
            # The goal may change in a moment.
            self._beeps.stop()
            return
        self._note_arrival()
        self._beeps.tick(self._guidance.guide)

    def _note_arrival(self) -> None:
        """Mark the goal as reached when the camera or a photo shows the sitter in the light."""
        model, guide = self._services.model, self._guidance.guide
        aim, reached = model.aim, model.reached
        if aim is not None and self.shots.prove(aim[1], aim[2]):
            reached = aim
        elif guide is not None and guide.now is not None:
            reached = aim if guide.inside else None
        if reached != model.reached:
            model.update(reached=reached)

    def set_mode(self, mode: str) -> None:
        """Set who moves: ``walk`` or ``selfie``."""
        self._services.model.set("mode", mode)

    def toggle_mode(self) -> None:
        """Switch between the two modes, walking and selfie."""
        self.set_mode("walk" if self._guidance.mode is Mode.SELFIE else "selfie")

    def toggle_sounds(self) -> None:
        """Turn the sounds on or off."""
        on = not self._services.model.settings.sounds
        self._services.model.set("sounds", on)
        words, _ = sound_words(on, self._services.sounds)
        self._services.notify.tell(f"{words}.")

    def answer(self, looks: str) -> None:
        """Set the person that the camera faces: ``sitter`` or ``me``."""
        self._services.model.set("camera_looks", looks)

    def choose_webcam(self, index: int) -> None:
        """Switch to another webcam."""
        self._source_taken()
        self._camera.choose(index)

    def ask_source(self) -> None:
        """Open the sheet for choosing a live camera."""
        if self._view is not None:
            self._view.ask_source()

    def ask_photos(self) -> None:
        """Open the dialog for choosing photos to check."""
        if self._view is not None:
            self._view.ask_photos()

    def ask_folder(self) -> None:
        """Open the dialog for choosing a folder in which to watch for photos."""
        if self._view is not None:
            self._view.ask_folder()

    def open_photos(self, paths: Sequence[Path]) -> None:
        """Check photos, or open other files as a place."""
        if not self.shots.take(paths):
            self._place_controller.open_paths(paths)

    def set_mirrored(self, mirrored: bool) -> None:
        """Set whether to treat a new photo as mirrored if its background is inconclusive."""
        self._services.model.set("mirrored", mirrored)

    def turn_again(self) -> None:
        """Return to the guidance, with the goal of the last photo checked.

        If there is no heading, the displayed turn is measured from the turn of that photo.
        """
        shot, model = self.shots.last(), self._services.model
        self.shots.settle()
        self.alignment.stop()
        self._guidance.forget()
        if shot is not None and shot.facing_deg is not None:
            self._guidance.from_deg = wrap(shot.facing_deg - model.front_deg)
            if any(result.name == shot.style for result in model.results):
                goal = wrap(shot.goal_facing_deg - model.front_deg)
                model.update(chosen=shot.style, needle_deg=None, goal_deg=goal)
        self._refresh()

    def back(self) -> None:
        """Close the alignment, or return to the previous screen."""
        if self.alignment.on:
            self.alignment.toggle()
        else:
            self._services.model.update(step=self._origin, painting=None)

    @property
    def _origin(self) -> str:
        """The previous screen, or by default the screen on which the goal was chosen."""
        lamp = Step.LIGHT if self._services.model.lamp_plan is not None else Step.STYLES
        before = self._services.model.before
        return before if before in BACK else lamp

    def fill(self) -> None:
        """Perform the action of the empty state's button."""
        step = Step.PROBE if self._services.model.light is None else Step.STYLES
        self._services.model.update(step=step, painting=None)

    def demo_turn(self, turn_deg: float) -> None:
        """Move the demo's camera to a turn."""
        if self._camera.simulated is not None:
            self._camera.simulated.set_turn(self._services.model.azimuth_of(turn_deg))
            self._refresh()

    def demo_step(self, by_deg: float) -> None:
        """Move the demo's camera by a number of degrees. Positive numbers are clockwise."""
        here = self._demo_deg()
        if here is not None:
            self.demo_turn(float(here) + by_deg)

    def resolve(self) -> TurnState:
        """Return the current state of the screen."""
        model = self._services.model
        empty, action = self._empty()
        goal = model.goal
        if empty or goal is None or model.light is None:
            self._guidance.guide = self._state = None
            return TurnState(empty, action, self._guidance.mode.value)
        check = self._face.check
        guide = self._guidance.advance(goal, None if check is None else check.light.pose.yaw_deg)
        scene = self._scene(guide)
        self._images.want_views(model.light, scene)
        if not model.goal_computing:
            self._want_portraits(guide, goal)
        mode, axis = self._guidance.mode, self._guidance.axis_turn(guide)
        style, pictures = self._with_film(style_words(model, guide.now, check), guide)
        plan, words = walk_plan(model, guide, goal, mode, self._guidance.from_deg)
        self._state = TurnState(
            stale=model.goal_computing,
            mode=mode.value,
            guidance=self._guidance.column(guide),
            style=style,
            live=self._live.resolve(guide, self.alignment.tag()),
            menu=self._live.menu(),
            alignment=self.alignment.resolve(),
            demo_deg=self._demo_deg(),
            scale=scale_of(guide, goal, scene.panorama_fov_deg, axis, mode),
            plan=plan,
            plan_words=words,
            shots=self.shots.resolve(),
            pictures=pictures,
        )
        return self._state

    def _show_shots(self) -> None:
        """Show the photos at once. A video frame that serves as Now follows at the next tick."""
        if self._state is None:
            self._refresh()
        elif self._view is not None and self._in_front:
            self._state = replace(self._state, shots=self.shots.resolve())
            self._view.show_state(self._state)

    def _source_taken(self) -> None:
        """Discard the previous camera's results."""
        self._tracker.forget()
        self._images.drop_live()
        self._refresh()

    def _begin(self) -> None:
        self.shots.follow()
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
            return NO_LIGHT, tr("Go to Probe")
        if model.target_turn_deg is None:
            if model.goal_computing:
                return COMPUTING, ""
            return NO_STYLE, tr("Choose a style")
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

    def _want_portraits(self, guidance: Guide, goal: Goal) -> None:
        model, size = self._services.model, self._sizes.portrait
        if model.head is None or model.light is None or model.chosen is None:
            return
        head, yaw = model.head, goal.yaw_deg
        own, name = model.own_style, model.pack_style or model.chosen
        painted = None if own is None or own.copy_of else own
        self._images.want_target(head, yaw, painted, name, size)
        turn = float(guidance.goal if guidance.now is None else guidance.now)
        # The light on a face depends on the direction of the nose.
        facing = model.azimuth_of(turn - yaw)
        expose = head.expose_of(name if painted is None else painted.origin)
        self._images.want_now(head, yaw, model.light, facing, size, expose, model.lamp_plan)

    def _with_film(self, style: StyleWords, guide: Guide) -> tuple[StyleWords, Pictures]:
        """When there is no heading, show the sitter's face from a video as Now."""
        pictures = self._images.pictures
        if self._camera.source is HeadingSource.NONE:
            # Without a webcam, both wells show the goal.
            pictures = replace(pictures, live=pictures.goal)
        frame = None if guide.now is not None else self.shots.filmed(self._services.model.chosen)
        if frame is None or frame.thumbnail is None:
            return style, pictures
        return replace(style, now_tag=frame.name), replace(pictures, now=frame.thumbnail)

    def _learn_fov(self) -> None:
        track = self._guidance.track
        if track is not None and track.fov_deg is not None and track.status == "tracking":
            self._camera.learn_fov(track.fov_deg)

    def _look_at_face(self, frame: WebcamFrame) -> None:
        """Check the light on the face if the heading is known and the face is the sitter's."""
        model, track, guidance = self._services.model, self._guidance.track, self._guidance.guide
        goal, result, head, light = model.goal, model.goal_result, model.head, model.light
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

    def _demo_deg(self) -> int | None:
        simulated = self._camera.simulated
        if simulated is None:
            return None
        return whole(wrap(simulated.turn_deg - self._services.model.front_deg))
