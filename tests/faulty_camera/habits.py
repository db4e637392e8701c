"""Bad habits of single models, as users report them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from random import Random
from typing import Any, Final

from app.devices.clock import Clock
from app.devices.simulated.body import CameraBody
from app.devices.simulated.cameras import Personality
from app.devices.simulated.commands import Action, Command, Parameters
from app.devices.simulated.exchange import (
    LATENCY_S,
    CommandRefused,
    JsonValue,
    Piece,
    Reply,
    Request,
)
from app.devices.simulated.preview import PreviewBody, PreviewGate
from app.devices.simulated.scene import Scene
from app.devices.simulated.shooting import JobKind, ShootingJob
from tests.faulty_camera.old_api import OldApiCamera
from tests.faulty_camera.silence import NO_ANSWER

_NONE: Final = float("-inf")


@dataclass(frozen=True, slots=True)
class Habits:
    """Bad habits of a model.

    * `forgets`: it loses its settings with its Wi-Fi.
    * `ends_preview`: it ends its preview at any time.
    * `hangs_at_thumbnails`: it never answers a list with thumbnails.
    * `rest_s`: seconds after a picture in which another one breaks the connection.
    * `preview_rest_s`: seconds after a picture in which the preview is refused.
    """

    forgets: bool = False
    ends_preview: bool = False
    hangs_at_thumbnails: bool = False
    rest_s: float = _NONE
    preview_rest_s: float = _NONE


HABITS: Final = {
    "SC": Habits(preview_rest_s=1.2),
    "SC2": Habits(
        forgets=True,
        ends_preview=True,
        hangs_at_thumbnails=True,
        rest_s=1.5,
    ),
}
"""By the names of the models."""


class Instead(Exception):
    """A reply in place of the one that is being made."""

    def __init__(self, reply: Reply) -> None:
        super().__init__(reply.status)
        self.reply = reply


class FitfulBody(PreviewBody):
    """A preview that ends after a number of pieces."""

    def __init__(self, gate: PreviewGate, pieces: Iterator[Piece], most: int) -> None:
        super().__init__(gate, pieces)
        self._left = most

    def __next__(self) -> Piece:
        if self._left == 0:
            self.close()
            raise StopIteration
        self._left -= 1
        return super().__next__()


class FitfulPreview(PreviewGate):
    """The preview of a camera that ends it at any time."""

    def __init__(
        self, scene: Scene, person: Personality, clock: Clock, options: dict[str, JsonValue]
    ) -> None:
        super().__init__(scene.environment, person, clock, options)
        self._dice = Random(f"{person.name}/preview")

    def make_body(self, pieces: Iterator[Piece]) -> PreviewBody:
        return FitfulBody(self, pieces, self._dice.randint(300, 1500))


class OddCamera(OldApiCamera):
    """A camera with the bad habits of its model."""

    def __init__(
        self, scene: Scene, personality: Personality | str, clock: Clock, **options: Any
    ) -> None:
        super().__init__(scene, personality, clock, **options)
        self.habits = HABITS.get(self.personality.name, Habits())
        self._changes = {
            "camera.listFiles": self._list_files,
            "camera.getLivePreview": self._open_preview,
        }
        if self.habits.ends_preview:
            self.preview = FitfulPreview(scene, self.personality, clock, self.store.values)

    def route(self, request: Request) -> Reply:
        try:
            return super().route(request)
        except Instead as instead:
            return instead.reply

    def find_command(self, name: str) -> Command | None:
        command, change = super().find_command(name), self._changes.get(name)
        if command is None or change is None:
            return command
        return replace(command, act=partial(change, command.act))

    def shoot(self, name: str, kind: JobKind, shots: Sequence[dict[str, JsonValue]]) -> ShootingJob:
        if kind == "single" and self._rests(self.habits.rest_s):
            raise Instead(Reply(0, delay_s=LATENCY_S))
        return super().shoot(name, kind, shots)

    def _rests(self, seconds: float) -> bool:
        job = self.shooter.job
        return job is not None and self.clock.now() - job.ended < seconds

    def _list_files(
        self, act: Action, camera: CameraBody, parameters: Parameters
    ) -> Parameters | Reply:
        if self.habits.hangs_at_thumbnails and parameters.get("maxThumbSize") == 640:
            return NO_ANSWER
        return act(camera, parameters)

    def _open_preview(
        self, act: Action, camera: CameraBody, parameters: Parameters
    ) -> Parameters | Reply:
        if self._rests(self.habits.preview_rest_s):
            raise CommandRefused("disabledCommand")
        return act(camera, parameters)
