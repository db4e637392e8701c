"""The portraits, the background and the weights of the chosen style at the needle's turn.

Parts that do not depend on the turn are computed once.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np

from app.core.base.angles import turn_of_index, wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.localization.views import background_view
from app.core.portrait.gallery_portraits import exposure_in_mean_light
from app.core.portrait.ratio_and_glare import (
    Glare,
    cheeks,
    eye_light,
    glare,
    lighting_ratio,
)
from app.core.solver.peaks import best_index
from app.core.solver.place_light import Facing, PlaceLight, picture_at
from app.core.solver.style_result import StyleResult
from app.core.text import tr
from app.ui.presenters.window_model import COMPUTING, looking_words
from app.ui.screens.styles.cards import lamps_note
from app.ui.screens.styles.detail import CurveMark, DetailState, with_words
from app.ui.screens.styles.gallery import GalleryQuestion, Sizes, Snapshot, ValueCache
from app.words.phrases.directions import light_words
from app.words.phrases.quantities import exposed_words
from app.words.phrases.turns import signed
from app.words.portrait.face_light import (
    catchlight_words,
    glare_line,
    glare_sentence,
    ratio_line,
    ratio_sentence,
    stops_words,
)
from app.words.verdict import quality_words

_EXPOSED: Final = tr("Exposure {exposed}, relative to a face in this place’s average light")
_ALIKE: Final = tr("Exposure {exposed}, the same for all pictures here, set by the selected style")

_OF_PICTURE: Final = (
    *("here", "here_exposed", "exposed_tip", "lamps_note", "marks"),
    *("ratio", "ratio_short", "ratio_tip", "glare", "glare_tip", "glare_strong"),
)
"""Fields derived from the picture here. They are always updated together with that picture."""


class DetailResolver:
    """Resolves the details, caching everything that does not depend on the turn.

    Args:
        before: Resolver whose cached values are copied. The copy can be used in another thread.
    """

    def __init__(self, before: DetailResolver | None = None) -> None:
        self._cache: ValueCache = ValueCache(None if before is None else before._cache)

    def at(
        self,
        snapshot: Snapshot,
        name: str,
        needle_deg: float | None,
        sizes: Sizes,
        *,
        quick: bool = False,
        draft: bool = False,
        last: DetailState | None = None,
    ) -> DetailState:
        """Return the details of a style.

        Args:
            needle_deg: Turn, in degrees, or None for the best turn.
            quick: Whether to use small pictures, which can keep up with a drag, if no larger ones
                exist.
            draft: Whether to halve the width in pixels and omit the catchlights.
            last: State whose larger picture is shown instead of a quick one.
        """
        key = (name, needle_deg, sizes.portrait, sizes.background)
        quick = quick and not self._cache.has("state", (*key, None), snapshot)
        last = last if quick else None
        return self._cache.once(
            "quick-state" if quick else "draft-state" if draft else "state",
            (*key, last),
            snapshot,
            lambda: self._resolved(snapshot, name, needle_deg, sizes, last, quick, draft),
        )

    def is_quick(self, state: DetailState) -> bool:
        """Return whether a state still lacks its larger pictures."""
        return self._cache.is_value("quick-state", state)

    def _resolved(
        self,
        snapshot: Snapshot,
        name: str,
        needle_deg: float | None,
        sizes: Sizes,
        last: DetailState | None,
        quick: bool,
        draft: bool,
    ) -> DetailState:
        style = snapshot.styles[name]
        base = DetailState(
            key=name,
            title=style.title,
            side=light_words(style.side, style.place) or tr("Painted"),
            target=self._target(snapshot, name, sizes, quick),
            lamps_note=lamps_note(snapshot, name),
            weights=self._weights(snapshot, name),
            front=snapshot.question.front_deg,
        )
        light, result = snapshot.question.light, snapshot.results.get(name)
        if light is None:
            return replace(base, main="probe", main_words=tr("Go to Probe"))
        if result is None:
            return replace(base, panorama=light.display, main_works=False)
        turn = result.turn_refined_deg if needle_deg is None else needle_deg
        state = with_words(base, snapshot, result, turn, at_best=needle_deg is None)
        view = self._background(light, turn, snapshot.question.front_deg, sizes)
        state = replace(state, panorama=light.display, background=view)
        if last is not None:
            return self._with_last_picture(state, snapshot, last)
        return self._with_pictures(state, snapshot, light, turn, sizes, quick, draft)

    def _with_last_picture(
        self, state: DetailState, snapshot: Snapshot, last: DetailState
    ) -> DetailState:
        """Keep the last picture while the needle moves, with its values if the turn is the same."""
        if last.needle == state.needle:
            return replace(state, **{name: getattr(last, name) for name in _OF_PICTURE})
        return replace(
            state,
            here=last.here,
            here_tag=COMPUTING,
            marks=last.marks,
            lamps_note=state.lamps_note or looking_words(snapshot.head_for(state.key)),
            ratio=COMPUTING,
        )

    def _with_pictures(
        self,
        state: DetailState,
        snapshot: Snapshot,
        light: PlaceLight,
        turn: float,
        sizes: Sizes,
        quick: bool,
        draft: bool,
    ) -> DetailState:
        head = snapshot.head_for(state.key)
        marks: tuple[CurveMark, ...] = ()
        if snapshot.paper:
            marks = self._marks(snapshot, snapshot.results[state.key], light, sizes, quick)
        # shared by the draft and the full picture that follows
        values, linear, exposed = self._cache.once(
            "lit",
            (state.key, turn),
            snapshot,
            lambda: self._portrait_parts(snapshot, state.key, light, turn),
        )
        nose = wrap(turn + snapshot.question.front_deg - head.yaw_deg)
        here = Facing(light, nose, snapshot.styles[state.key].expose)
        return replace(
            state,
            **values,
            lamps_note=state.lamps_note
            or (
                looking_words(head)
                if quick or draft
                else catchlight_words(head.catchlights(here, snapshot.question.findings()))
            ),
            here=head.portraits(
                [linear], sizes.portrait, [here], quick=quick, draft=draft, gains=exposed
            )[0],
            marks=marks,
        )

    def _portrait_parts(
        self, snapshot: Snapshot, name: str, light: PlaceLight, turn: float
    ) -> tuple[dict[str, Any], FloatImage, tuple[float, ...]]:
        """Return the state's fields, the linear picture and its exposure gains at a turn."""
        question, head = snapshot.question, snapshot.head_for(name)
        transport = question.head.transport
        facing = wrap(turn + question.front_deg)
        nose = wrap(facing - head.yaw_deg)
        straight = picture_at(transport, light, nose)
        linear = picture_at(head.transport, light, nose) if head.yaw_deg else straight
        warning = self._glare(light, facing, question)
        areas = self._cache.once("cheeks", 0, question.head, lambda: cheeks(transport))
        ratio = lighting_ratio(transport, straight.reshape(-1, 3)[transport.pixels], areas)
        here = Facing(light, nose, snapshot.styles[name].expose)
        exposed = snapshot.exposed or head.exposures([linear], [here])
        zero = self._cache.once(
            "zero",
            question.head.name,
            light,
            lambda: exposure_in_mean_light(transport, light.searched),
        )
        stops = exposed_words(math.log2(exposed[0] / zero))
        values = {
            "here_exposed": stops,
            "exposed_tip": (_ALIKE if snapshot.exposed else _EXPOSED).format(exposed=stops),
            "ratio": stops_words(ratio),
            "ratio_short": ratio_line(ratio),
            "ratio_tip": tr("Lighting ratio: {ratio}", ratio=ratio_sentence(ratio)),
            "glare": glare_line(warning),
            "glare_tip": glare_sentence(warning) if warning.warns else "",
            "glare_strong": warning.level == "strong",
        }
        return values, linear, exposed

    def _marks(
        self,
        snapshot: Snapshot,
        result: StyleResult,
        light: PlaceLight,
        sizes: Sizes,
        quick: bool,
    ) -> tuple[CurveMark, ...]:
        """Return marks, with pictures, at the median and minimum C, as in figure 4 of the paper."""
        curve, head = result.quality_curve, snapshot.question.head
        everywhere = np.ones(len(curve), bool)

        def mark(tag: str, words: str, index: int) -> CurveMark:
            turn = turn_of_index(index)
            facing = wrap(turn + snapshot.question.front_deg)
            linear = picture_at(head.transport, light, facing)
            here = [Facing(light, facing, snapshot.styles[result.name].expose)]
            (picture,) = head.portraits(
                [linear], sizes.portrait, here, quick=quick, gains=snapshot.exposed
            )
            value = quality_words(float(curve[index]) * snapshot.quality_scale)
            text = words.format(turn=signed(turn), quality=value)
            return CurveMark(tag, turn, text, picture)

        def make() -> tuple[CurveMark, ...]:
            middle = -np.abs(curve - np.median(curve))
            return (
                mark(
                    tr("Median"),
                    tr("Median at {turn}: C {quality}"),
                    best_index(middle, everywhere),
                ),
                mark(
                    tr("Minimum"),
                    tr("Minimum at {turn}: C {quality}"),
                    best_index(-curve, everywhere),
                ),
            )

        return self._cache.once(f"marks {quick}", (sizes.portrait, snapshot.exposed), result, make)

    def _target(self, snapshot: Snapshot, name: str, sizes: Sizes, quick: bool) -> Bytes:
        head, size = snapshot.head_for(name), sizes.portrait
        owner, style = snapshot.asking.get(name, head), snapshot.lit_style(name)
        quick = quick and not self._cache.has("target", (name, size), owner)
        return self._cache.once(
            "quick-target" if quick else "target",
            (name, size),
            owner,
            lambda: head.portraits([snapshot.target(name)], size, [style], quick=quick)[0],
        )

    def _weights(self, snapshot: Snapshot, name: str) -> FloatImage:
        head, asking = snapshot.question.head, snapshot.asking.get(name)
        if asking is not None:
            return self._cache.once(
                "weights", name, asking, lambda: asking.weights.preintegrated(head.transport)
            )
        pack, yaw = head.pack, snapshot.head_for(name).yaw_deg
        name = snapshot.source(name)
        # rolled by whole texels to the turn of the lens
        columns = round(yaw / 360.0 * pack.header.environment[1])

        def make() -> FloatImage:
            return np.roll(pack.preintegrated[pack.index(name)], -columns, axis=1)

        return self._cache.once("weights", (name, columns), head, make)

    def _background(self, light: PlaceLight, turn: float, front: float, sizes: Sizes) -> Bytes:
        rows, columns = sizes.background
        return self._cache.once(
            "background",
            (turn, front, sizes.background),
            light,
            lambda: background_view(light.display, turn, (columns, rows), front),
        )

    def _glare(self, light: PlaceLight, facing: float, question: GalleryQuestion) -> Glare:
        eyes = self._cache.once("eyes", 0, light, lambda: eye_light(light.environment.radiance))
        return glare(eyes, facing, question.sun, question.findings())
