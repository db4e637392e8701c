"""The Styles presenter on a real head, with one known lamp or a bundled scene, for tests."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np

from app.core.base.angles import wrap
from app.core.base.paths import resources
from app.core.base.progress import Token, silent
from app.core.environment.environment import from_radiance, read_environment
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight, prepare
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from app.ui.presenters.backgrounds import Backgrounds
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Folders, Services
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_model import Model
from app.ui.screens.styles.cards import CardState
from app.ui.screens.styles.screen import StylesPresenter
from tests.helpers.told import Told


@cache
def head(name: str = "generic") -> Head:
    """A shipped head, loaded once."""
    pack = load_named_pack(name)
    return Head(name, pack, load_transport_of(pack, name))


@cache
def lamp_light(azimuth_deg: float, elevation_deg: float = 20.0) -> PlaceLight:
    """A place with one small lamp at a panorama azimuth and nothing else but a faint glow."""
    lamp = far_lamp(StyleLamp(wrap(-azimuth_deg), elevation_deg, 8.0, 1.0, 2.0), (128, 256))
    radiance = np.repeat((lamp + 1e-4 * lamp.max())[..., None], 3, axis=2).astype(np.float32)
    return prepare(from_radiance(radiance, "one lamp"))


@cache
def scene_light(name: str = "interior") -> PlaceLight:
    """A bundled real scene."""
    return prepare(read_environment(resources() / "demo" / "scenes" / f"{name}.exr"))


class HoldingRunner:
    """Does everything at once, except for what is held back until it is released."""

    def __init__(self) -> None:
        self.held: set[str] = set()
        self.waiting: dict[str, Callable[[], None]] = {}
        self.ran: list[str] = []

    def submit(
        self,
        key: str,
        work: Callable[..., Any],
        *,
        title: str = "",
        done: Callable[..., None] | None = None,
        failed: Callable[[Exception], None] | None = None,
        cancelled: Callable[[], None] | None = None,
    ) -> None:
        del title, cancelled
        self.ran.append(key)

        def run() -> None:
            self.waiting.pop(key, None)
            try:
                answer = work(Token(), silent)
            except Exception as error:
                if failed is None:
                    raise
                failed(error)
                return
            if done is not None:
                done(answer)

        if key in self.held:
            self.waiting[key] = run
        else:
            run()

    def release(self, key: str) -> None:
        self.held.discard(key)
        self.waiting[key]()

    def cancel(self, key: str) -> None:
        self.waiting.pop(key, None)

    def running(self, key: str) -> bool:
        return key in self.waiting


class LearntBackgrounds(Backgrounds):
    """Has every background at hand: learning one takes a second."""

    def at_hand(self, light: PlaceLight) -> Any:
        return light


class Table:
    """Everything that the presenter needs, in a folder of the test's own."""

    def __init__(
        self, folder: Path, runner: Any = None, backgrounds: Backgrounds | None = None
    ) -> None:
        self.runner = HoldingRunner() if runner is None else runner
        self.told = Told()
        self.model = Model()
        self.folder = folder
        self.services = Services(
            model=self.model,
            runner=self.runner,
            notify=self.told,
            undo=UndoStack(),
            clock=MagicMock(),
            today=lambda: datetime(2026, 11, 21, 14, 5, tzinfo=UTC),
            devices=MagicMock(),
            folders=Folders(
                folder, folder / "places", folder / "styles", folder / "drafts", folder / "demo"
            ),
            backgrounds=backgrounds or LearntBackgrounds(),
        )
        self.desk = PlaceController(self.services)
        self.presenter = StylesPresenter(self.services, self.desk)

    def open(self, light: PlaceLight | None = None, front_deg: float = 0.0) -> Table:
        """Load the head and, if any, the light; everything is solved when this returns."""
        self.model.update(head=head(), light=light, front_deg=front_deg)
        return self

    def card(self, key: str) -> CardState:
        """The card that shows a style, chosen first if its card shows another side or style."""
        cards = {card.key: card for card in self.presenter.resolve().cards}
        if key not in cards:
            self.presenter.choose(key)
            cards = {card.key: card for card in self.presenter.resolve().cards}
        return cards[key]


def on_time(table: Table) -> Table:
    """Let a second pass whenever somebody looks at the clock."""
    table.services.clock.now.side_effect = count(0.0, 1.0).__next__  # type: ignore[attr-defined]
    return table
