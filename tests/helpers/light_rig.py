"""The Light presenter on a real head with answers that a test decides on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.core.base.angles import wrap
from app.core.second_light.in_hand import InHand, LampHead
from app.core.second_light.lamp_answers import Answers, LampPosition, LampQuestion
from app.core.second_light.search import LampPlacement
from app.core.second_light.visible_change import VISIBLE, VisibleChange
from app.core.solver.head_shape import load_shape_of
from app.core.solver.place_light import PlaceLight
from app.core.solver.shortfall import Cause, LightShortfall
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS
from app.ui.screens.light.own_lamp.mask import MaskEdit
from app.ui.screens.light.own_lamp.sheets import CaptureAsk, WordsAsk
from app.ui.screens.light.placement import jobs as work
from app.ui.screens.light.placement.pictures import LampView
from app.ui.screens.light.screen import LightPresenter, LightState
from tests.helpers.styles_screen import HoldingRunner, Table, head, scene_light

__all__ = ["LightRig", "Watching", "placed"]

BEST = {"badger": (-74.0, -16.0), "left-split": (80.0, 5.0), "right-split": (-80.0, 5.0)}
SAVED = {"badger": (20.0, 62.0), "below": (9.0, 48.0)}
GAINED = {"left-split": (61.0, 84.0)}


def placed(
    before: StyleResult, match: float, spot: tuple[float, float], turn: float
) -> LampPlacement:
    """An answer: the map has its peak where the lamp is best."""
    azimuths = np.arange(64) * 5.625
    altitudes = np.arange(-4, 5) * 16.875
    away = (azimuths - spot[0] + 180.0) % 360.0 - 180.0
    values = match * np.exp(-(away[None, :] ** 2 + (altitudes[:, None] - spot[1]) ** 2) / 3200.0)
    return LampPlacement(
        name=before.name,
        title=before.title,
        side=before.side,
        turn_index=0,
        placement=0,
        turn_deg=turn,
        turn_refined_deg=turn,
        lamp_azimuth_deg=spot[0],
        lamp_altitude_deg=spot[1],
        lamp_azimuth_refined_deg=spot[0],
        lamp_altitude_refined_deg=spot[1],
        quality=1.0,
        match=match,
        strength=60.0,
        attainable=match >= 45.0,
        before=before,
        change=VisibleChange(20.0),
        map=values.astype(np.float32),
        evaluated=36864,
    )


class Watching:
    """A view that remembers."""

    def __init__(self) -> None:
        self.states: list[LightState] = []
        self.asked = self.focused = 0
        self.captures: list[CaptureAsk] = []
        self.words: list[WordsAsk] = []
        self.said: list[str] = []
        self.masks: list[MaskEdit] = []

    def show_state(self, state: LightState) -> None:
        self.states.append(state)

    def ask_pictures(self) -> None:
        self.asked += 1

    def ask_capture(self, ask: CaptureAsk) -> None:
        self.captures.append(ask)

    def ask_words(self, ask: WordsAsk) -> None:
        self.words.append(ask)

    def say(self, sentence: str) -> None:
        self.said.append(sentence)

    def ask_mask(self, edit: MaskEdit) -> None:
        self.masks.append(edit)

    def take_lamp_focus(self) -> None:
        self.focused += 1

    @property
    def last(self) -> LightState:
        return self.states[-1]


class LightRig:
    """Model, services and presenter; how a lamp is tried is told by `saved` and `gained`.

    Args:
        folder: The user's.
        patch: Puts the answers in place of the search.
    """

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.table = Table(folder, HoldingRunner())
        self.runner, self.model = self.table.runner, self.table.model
        self.saved, self.gained = dict(SAVED), dict(GAINED)
        self.hands: list[Any] = []
        self.questions: list[LampQuestion] = []
        self.looks: list[tuple[str, LampPosition]] = []
        self.nearer: LampPlacement | None = None
        self.allowed = np.ones(576, bool)
        self.power = 1.0
        self.weak: set[str] = set()
        self.same: set[str] = set()  # styles whose picture the lamp does not change
        patch.setattr(work, "prepare_head", self._prepare)
        patch.setattr(work, "take_in_hand", self.take)
        patch.setattr(work, "wait", lambda *_: None)
        patch.setattr(work, "ask", self._ask)
        patch.setattr(work, "look", self._look)
        patch.setattr(work, "result_with", self._with)
        patch.setattr(work, "closer", lambda *_: self.nearer)
        self.shape = load_shape_of(head().transport, "generic")
        self.presenter = LightPresenter(self.table.services, self.table.desk)
        self.view = Watching()

    def start(
        self, light: PlaceLight | None = None, lamp: str = "phone", bright: str = "living"
    ) -> LightRig:
        """Open a place, take a lamp and say how bright it is."""
        self.table.open(light or scene_light())
        self.presenter.attach(self.view)
        if lamp:
            self.presenter.take_lamp(lamp)
        if bright:
            self.presenter.scale.choose(bright)
        return self

    @property
    def state(self) -> LightState:
        return self.presenter.resolve()

    def take(
        self, base: LampHead, lamp: Any, token: Any, report: Any, grey: bool = False
    ) -> InHand:
        del token, report
        self.hands.append(lamp)
        nothing: Any = SimpleNamespace(distance_m=lamp.distance_m)
        return InHand(base, lamp, nothing, nothing, grey)

    def _prepare(self, of: Any, token: Any) -> LampHead:
        del token
        nothing: Any = None
        return LampHead(of, self.shape, nothing, nothing)

    def _ask(self, hand: InHand, question: LampQuestion, styles: Any = None) -> Answers:
        del styles
        self.questions.append(question)
        before = {one.name: one for one in self.model.results}
        answers = []
        for style in hand.head.pack.styles:
            without, match = {**self.saved, **self.gained}.get(style.name, (90.0, 92.0))
            old = replace(before[style.name], match=without, attainable=without >= 45.0)
            spot = BEST.get(style.name, (0.0, 20.0))
            one = placed(old, match, spot, -56.0)
            if style.name in self.weak:
                why = LightShortfall(Cause.WEAK_LAMP, "contrast", 12.0, 20.0)
                one = replace(one, strength=12.0, attainable=False, shortfall=why)
            if style.name in self.same:
                one = replace(one, change=VisibleChange(VISIBLE - 0.1))
            answers.append(replace(one, power=self.power))
        return Answers(hand, question, tuple(answers), self.allowed)

    def _with(self, answers: Answers, name: str, held: LampPosition, match: float) -> StyleResult:
        del held
        one = answers.of(name)
        assert one is not None
        facing = wrap(one.turn_refined_deg + answers.question.front_deg)
        return replace(one.before, turn_refined_deg=facing, match=match)

    def _look(
        self, answers: Answers, name: str, held: LampPosition, size: Any, known: Any
    ) -> LampView:
        del known
        self.looks.append((name, held))
        one = answers.of(name)
        assert one is not None
        grey = np.full((*size, 3), 90, np.uint8)
        away = abs(held.azimuth_deg - one.lamp_azimuth_refined_deg)
        away += 10.0 * abs(np.log2(held.power / one.power))
        match = max(one.match - away, 0.0)
        reach = match >= LIMITS.match
        return LampView(
            answers, name, held, size, grey, grey, grey, match, 50.0, reach, None, one.change
        )
