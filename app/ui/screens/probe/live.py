"""The live preview on the way to a spot: the camera's picture and the three best styles.

One job reads pictures from the camera and puts the newest into a mailbox. A second job evaluates
the newest picture, one at a time. A slow computer therefore produces fewer results, but never
outdated ones.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import direction_of
from app.core.base.progress import PhraseReport, Token
from app.core.camera_catalogue import camera_facts
from app.core.measure.single.preview import RoughAnswer, preview_light, rough_answers
from app.core.styles.style_pack_file import load_named_pack
from app.core.text import tr
from app.devices.clock import wait
from app.devices.errors import DeviceError
from app.devices.latest_frame import Mailbox
from app.devices.mjpeg import decode
from app.devices.theta.client import OscClient
from app.devices.theta.link import Link
from app.ui.presenters.services import Services
from app.ui.screens.probe.capture.camera import CameraFinder
from app.words.phrases.directions import place_words
from app.words.phrases.turns import direction_words, size_words


@dataclass(frozen=True, slots=True)
class RoughCard:
    """One of the best styles in the live preview.

    Attributes:
        title, side, turn, direction, grade: Display text such as "Rembrandt", "sitter's left
            (camera right)", "96°", "clockwise" and "in reach".
        arrow: Icon of the direction.
        note: The word "rough", with a remark if the style needs the full bracket.
        unsure: Whether the turn depends on parts of the picture that are clipped in the preview.
    """

    title: str
    side: str
    turn: str
    direction: str
    grade: str
    note: str
    arrow: str
    unsure: bool
    spoken: str


@dataclass(frozen=True, slots=True)
class Live:
    """The camera's live preview.

    Attributes:
        picture: Newest picture, (h, 2 h, 3) uint8 sRGB, or None before the first one arrives.
        trouble: Whether `message` reports a problem.
    """

    picture: NDArray[np.uint8] | None = field(default=None, compare=False, repr=False)
    cards: tuple[RoughCard, ...] = ()
    message: str = ""
    trouble: bool = False


KEY: Final = "live-preview"

_ANSWER: Final = "live-answer"

_PAUSE_S: Final = 1.0

_SILENT_S: Final = 3.0

OPENING: Final = tr("Opening the live preview…")

_LOST_WORDS: Final = tr("Preview lost. Stay near the camera; it will reconnect by itself.")

_NOTHING: Final = tr("No style seems to be within reach here. Walk on.")

_HALF: Final = tr("The preview is not a whole panorama. Set the camera to show both lenses.")

ROUGH: Final = tr("Rough, from the live preview")


class LivePreview:
    """Runs the live preview from the camera in use."""

    def __init__(
        self, services: Services, cameras: CameraFinder, changed: Callable[[], None]
    ) -> None:
        self._services = services
        self._cameras = cameras
        self._changed = changed
        self._pictures: Mailbox[bytes] = Mailbox()
        self._link: Link | None = None
        self._heard_at = 0.0
        self._why = ""
        self._answering = False
        self.live: Live | None = None

    def toggle(self) -> None:
        """Start or stop the preview from the camera in use."""
        camera = self._services.model.camera
        if self.live is not None:
            self.stop()
        elif camera is not None and not camera.busy:
            device, keys = camera.device, self._cameras.credentials(camera.device)
            self.live = Live(message=OPENING)
            self._pictures, self._answering, self._why = Mailbox(), False, ""
            self._heard_at = self._services.clock.now()
            facts, pictures = camera_facts(device.model), self._pictures
            size = facts.previews[0] if facts is not None and facts.previews else None

            def work(token: Token, report: PhraseReport) -> None:
                while True:
                    self._link = self._services.devices.link(device, keys)
                    with contextlib.closing(self._link):
                        self._read(size, pictures, token, report)
                    wait(self._services.clock, _PAUSE_S, token)

            self._services.runner.submit(KEY, work)
            self._changed()

    def stop(self) -> None:
        """Stop the preview, if it is running, so that the camera is free."""
        if self.live is not None:
            self.live = None
            self._services.runner.cancel(KEY)
            if self._link is not None:
                # Otherwise the job would wait for the camera's next picture.
                self._link.close()
            self._changed()

    def tick(self) -> None:
        """Evaluate the newest picture unless a job is running. The view calls this regularly."""
        if self.live is None or self._answering:
            return
        now, jpeg = self._services.clock.now(), self._pictures.get()
        if jpeg is None:
            # Some cameras start slowly, so wait until they refuse.
            opening = self.live.picture is None and not self._why
            if now - self._heard_at > _SILENT_S and not opening:
                self.live = Live(self.live.picture, message=self._why or _LOST_WORDS, trouble=True)
                self._changed()
            return
        self._heard_at, self._answering, self._why = now, True, ""
        head, pictures = self._services.model.head, self._pictures

        def work(token: Token, report: PhraseReport) -> Live:
            pack = load_named_pack("generic") if head is None else head.pack
            picture = decode(jpeg)
            preview = None if picture is None else preview_light(picture, pack.header.environment)
            if preview is None:
                return Live(picture, message=_HALF, trouble=True)
            cards = tuple(map(_card, rough_answers(preview, pack)))
            return Live(picture, cards, ROUGH if cards else _NOTHING)

        self._services.runner.submit(
            _ANSWER,
            work,
            done=lambda live: self._answered(pictures, live),
            failed=lambda error: self._answered(pictures, None),
            cancelled=lambda: self._answered(pictures, None),
        )

    def _answered(self, pictures: Mailbox[bytes], live: Live | None) -> None:
        if pictures is self._pictures:
            self._answering = False
            if live is not None and self.live is not None:
                self.live = live
                self._changed()

    def _read(
        self,
        size: tuple[int, int, int] | None,
        into: Mailbox[bytes],
        token: Token,
        report: PhraseReport,
    ) -> None:
        """Read pictures until the camera stops sending them."""
        assert self._link is not None
        try:
            client = OscClient(self._link, self._services.clock, token)
            with client.live_preview(size) as pictures:
                for jpeg in pictures:
                    token.check()
                    into.put(jpeg)
                    report(0.0, "")
        except DeviceError as error:
            token.check()
            self._why = error.message


def _card(answer: RoughAnswer) -> RoughCard:
    result, turn = answer.result, answer.result.turn_refined_deg
    words = {
        "title": result.title,
        "side": place_words(result.side, ""),
        "turn": size_words(turn),
        "direction": direction_words(turn),
        "grade": tr("in reach, soft") if result.grade == "soft" else tr("in reach"),
        "note": tr("rough, needs the bracket") if answer.unsure else tr("rough"),
    }
    spoken = ", ".join(part for part in words.values() if part)
    arrow = "counterclockwise" if direction_of(turn) == "counter-clockwise" else "clockwise"
    return RoughCard(**words, arrow=arrow, unsure=answer.unsure, spoken=spoken)
