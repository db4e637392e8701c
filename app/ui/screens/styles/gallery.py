"""The gallery, which holds pictures of all styles at this place, rendered together."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias, TypeVar

import numpy as np

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.colour import FloatImage
from app.core.base.progress import Token
from app.core.cautions.caution import Caution, Hazard, hazards_of
from app.core.measure.finish.findings import Findings
from app.core.painting.user_style import Asking, UserStyle, prepare_user_style
from app.core.places.place import CaptureFacts
from app.core.portrait.gallery_portraits import greyed
from app.core.portrait.head import Head
from app.core.solver.place_light import Facing, PlaceLight, pictures_at
from app.core.solver.solve import proposal, quality_scale
from app.core.solver.style_result import StyleResult
from app.core.solver.turn_choice import LIMITS
from app.core.storage.item_library import DamagedItem
from app.core.styles.style import Style
from app.ui.presenters.lamps_here import lamps_here
from app.ui.presenters.window_model import Model, Selection

Pair: TypeAlias = "tuple[Bytes | None, Bytes | None]"
T = TypeVar("T")

Size: TypeAlias = tuple[int, int]
"""Size of a picture, in rows and columns of device pixels."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of the pictures on the screen."""

    card: Size = (127, 99)
    portrait: Size = (208, 200)
    background: Size = (136, 128)
    compared: Size = (256, 256)


class ValueCache:
    """Caches one value of each kind until its key or its owner changes.

    Args:
        before: Cache whose values are copied. The copy can be used in another thread.
    """

    def __init__(self, before: ValueCache | None = None) -> None:
        self._values: dict[str, tuple[Hashable, object, Any]] = (
            dict(before._values) if before else {}
        )

    def has(self, what: str, key: Hashable, owner: object) -> bool:
        """Return whether the cache holds a value for this key and owner."""
        entry = self._values.get(what)
        return entry is not None and entry[0] == key and entry[1] is owner

    def is_value(self, what: str, value: object) -> bool:
        """Return whether `value` is the cached value of this kind."""
        entry = self._values.get(what)
        return entry is not None and entry[2] is value

    def once(self, what: str, key: Hashable, owner: object, make: Callable[[], T]) -> T:
        """Return the value of a kind, calling `make` only if the key or the owner has changed."""
        entry = self._values.get(what)
        if entry is None or entry[0] != key or entry[1] is not owner:
            self._values[what] = entry = (key, owner, make())
        value: T = entry[2]
        return value


@dataclass(frozen=True, slots=True, eq=False)
class GalleryQuestion:
    """Everything that the gallery depends on.

    Attributes:
        light: Light of the place, or None until it is measured. There are no results without light.
        objective: "picture" or "paper".
        sun: Panorama azimuth and elevation of the sun, in degrees, or None if they are unknown.
        size: Size of a card's picture, in rows and columns.
        rough: Whether the place was measured from a single photo.
        cautions: Cautions about the light, with the styles whose answers depend on it.
        selection: Selection for which the results were computed.
        capture: How the light was measured.
        pinned: Style whose exposure all pictures share, "" for the suggested style, or None if
            every picture has its own exposure.
    """

    head: Head
    light: PlaceLight | None = None
    front_deg: float = 0.0
    results: tuple[StyleResult, ...] = ()
    own: tuple[UserStyle, ...] = ()
    damaged: tuple[DamagedItem, ...] = ()
    objective: str = "picture"
    sun: tuple[float, float] | None = None
    size: Size = (127, 99)
    rough: bool = False
    cautions: tuple[Caution, ...] = ()
    pinned: str | None = None
    selection: Selection | None = None
    capture: CaptureFacts | None = None

    def findings(self) -> Findings:
        """Return the lamps at the place. The first call takes a while."""
        return Findings() if self.light is None else lamps_here(self.light, self.capture)

    def is_current(self, model: Model) -> bool:
        """Return whether the question matches the current selection."""
        if self.light is not None or model.light is not None:
            return self.light is model.light and self.selection == model.selection
        # without light, only the targets matter
        same_head = self.head is model.head and self.head.name == model.head_name
        return same_head and self.head.studios == model.studios


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A consistent set of the gallery's numbers and pictures.

    Attributes:
        targets: Target portraits by style, each (h, w, 3) uint8 sRGB and always in colour.
        pictures: For each style, the target and the picture here, as shown on the card. The picture
            here is None if there is no light.
        quick: Whether the pictures have only the transport's resolution although full size is
            possible.
        exposed: Common exposure of all pictures here, or an empty tuple if each has its own.
    """

    question: GalleryQuestion
    styles: Mapping[str, Style]
    results: Mapping[str, StyleResult]
    asking: Mapping[str, Asking] = field(repr=False)
    targets: Mapping[str, Bytes] = field(repr=False)
    pictures: Mapping[str, Pair] = field(repr=False)
    version: int = 1
    quick: bool = False
    exposed: tuple[float, ...] = ()

    @property
    def paper(self) -> bool:
        """Whether the paper's rule applies. It puts a style with C below the limit out of reach."""
        return self.question.objective == "paper" and self.question.light is not None

    @cached_property
    def quality_scale(self) -> float:
        """Factor that converts C to the scale of its limit."""
        head, light = self.question.head, self.question.light
        return 1.0 if light is None else quality_scale(light.searched, head.pack.header.picture)

    def quality(self, result: StyleResult) -> float:
        """Return the maximum C over all turns, on the scale of its limit."""
        return float(result.quality_curve.max()) * self.quality_scale

    def hazards(self, name: str) -> tuple[Hazard, ...]:
        """Return the hazards on which a style's answer depends."""
        if name not in self.results or name in self.asking:
            return ()
        return hazards_of(self.question.cautions, self.source(name))

    def within(self, result: StyleResult) -> bool:
        """Return whether a style is within reach according to the rule in force."""
        if self.paper:
            return self.quality(result) >= LIMITS.quality
        return result.attainable

    def exposure_of(self, name: str) -> tuple[float, ...]:
        """Return the exposure of a style's picture here."""
        head, light, result = self.head_for(name), self.question.light, self.results[name]
        assert light is not None
        nose = wrap(result.nose_deg + self.question.front_deg)
        lights = [Facing(light, nose, self.styles[name].expose)]
        return head.exposures(pictures_at(head.transport, light, [nose]), lights)

    @cached_property
    def mine(self) -> frozenset[str]:
        """Names of the user's own styles."""
        return frozenset(style.name for style in self.question.own)

    def source(self, name: str) -> str:
        """Return a style's name in the pack. A copy without strokes goes by its original's name."""
        return self.copies.get(name, name)

    @cached_property
    def copies(self) -> Mapping[str, str]:
        """Names of the user's copies without strokes, mapped to those of the built-in originals."""
        return {one.name: one.copy_of for one in self.question.own if one.name not in self.asking}

    def lit_style(self, name: str) -> Style | None:
        """Return the style whose lamps light the target, or None for a painted style."""
        if name in self.asking:
            return None
        pack = self.question.head.pack
        return pack.styles[pack.index(self.source(name))]

    def target(self, name: str) -> FloatImage:
        """Return the target picture of a style, (N, N, 3) linear float32 with maximum 1."""
        head, own = self.head_for(name), self.asking.get(name)
        if own is not None:
            return head.target_of(own.style) if head.yaw_deg else own.target
        return head.pack.target(self.source(name))

    def head_for(self, name: str) -> Head:
        """Return the head as the lens sees it for a style."""
        result = self.results.get(name)
        return self.question.head.turned(result.yaw_deg if result else 0.0)

    def by_head(self, names: Iterable[str]) -> dict[Head, list[str]]:
        """Group styles by the view of the head that they need."""
        groups: dict[Head, list[str]] = {}
        for name in names:
            groups.setdefault(self.head_for(name), []).append(name)
        return groups


def question_of(model: Model, size: Size) -> GalleryQuestion | None:
    """Return the question for the current state, or None while no head is loaded.

    Args:
        size: Size of a card's picture, in rows and columns.
    """
    if model.head is None:
        return None
    settings, place = model.settings, model.place
    where = place.location if place is not None else None
    sun = None
    if where is not None and where.sun_azimuth_deg is not None:
        sun = (where.sun_azimuth_deg, where.sun_elevation_deg or 0.0)
    capture = None if place is None else place.capture
    return GalleryQuestion(
        head=model.head,
        light=model.light,
        front_deg=model.front_deg,
        results=model.results if model.light is not None else (),
        own=model.user_styles,
        damaged=model.damaged_styles,
        objective=settings.objective,
        sun=sun,
        size=size,
        rough=capture is not None and capture.plan == "rough",
        cautions=() if capture is None else capture.cautions,
        pinned=(model.chosen or "") if settings.same_exposure else None,
        selection=model.answered if model.light is not None else None,
        capture=capture,
    )


def look(
    question: GalleryQuestion, last: Snapshot | None, token: Token, *, quick: bool = False
) -> Snapshot:
    """Render the pictures for all cards, reusing those that already exist.

    Args:
        quick: Whether to render at the transport's resolution instead of full size.
    """
    pack = question.head.pack
    before = last if last is not None and last.question.head is question.head else None
    asking = _prepared(question, before, token)
    styles = {style.name: style for style in pack.styles}
    styles.update((one.name, _style_of(one, styles, asking)) for one in question.own)
    results = {one.name: one for one in question.results if one.name in styles}
    draft = Snapshot(question, styles, results, asking, {}, {}, 1)
    targets = _old_targets(before, draft, quick)
    for head, missing in draft.by_head(name for name in styles if name not in targets).items():
        linear = np.stack([draft.target(name) for name in missing])
        lamps = [draft.lit_style(name) for name in missing]
        portraits = head.portraits(linear, question.size, lamps, close=True, quick=quick)
        targets.update(zip(missing, portraits, strict=True))
        token.check()
    here: dict[str, Bytes] = {}
    if question.light is not None and results:
        if question.pinned is not None:
            front = question.pinned if question.pinned in results else proposal(question.results)
            draft = replace(draft, exposed=draft.exposure_of(front or next(iter(results))))
        for head, names in draft.by_head(results).items():
            noses = [wrap(results[name].nose_deg + question.front_deg) for name in names]
            linear = pictures_at(head.transport, question.light, noses)
            token.check()
            lights = [
                Facing(question.light, nose, styles[name].expose)
                for name, nose in zip(names, noses, strict=True)
            ]
            exposed = draft.exposed * len(names) or head.exposures(linear, lights)
            portraits = head.portraits(
                linear, question.size, lights, close=True, quick=quick, gains=exposed
            )
            here.update(zip(names, portraits, strict=True))
    pictures = {}
    for name in styles:
        pair, result = (targets[name], here.get(name)), results.get(name)
        clear = result is None or draft.within(result)
        pictures[name] = pair if clear else _greyed(*pair)
    version = 1 if last is None else last.version + 1
    return replace(draft, targets=targets, pictures=pictures, version=version, quick=quick)


def _prepared(
    question: GalleryQuestion, before: Snapshot | None, token: Token
) -> dict[str, Asking]:
    asking = {}
    names = {style.name for style in question.head.pack.styles}
    for style in question.own:
        if style.copy_of in names:
            continue
        old = before.asking.get(style.name) if before is not None else None
        if old is None or old.style is not style:
            token.check()
            old = prepare_user_style(question.head.transport, style)
        asking[style.name] = old
    return asking


def _style_of(own: UserStyle, built_in: Mapping[str, Style], asking: Mapping[str, Asking]) -> Style:
    """Return one of the user's styles. For an unpainted copy, rename the built-in style."""
    if own.name in asking:
        origin = built_in.get(own.origin)
        return own.style if origin is None else replace(own.style, expose=origin.expose)
    return replace(built_in[own.copy_of], name=own.name, title=own.title)


def _old_targets(before: Snapshot | None, draft: Snapshot, quick: bool) -> dict[str, Bytes]:
    if before is None or before.question.size != draft.question.size:
        return {}
    if before.quick and not quick:
        return {}
    return {
        name: picture
        for name, picture in before.targets.items()
        if before.asking.get(name) is draft.asking.get(name)
        and before.source(name) == draft.source(name)
        and before.head_for(name) is draft.head_for(name)
    }


def _greyed(target: Bytes, here: Bytes | None) -> Pair:
    return greyed(target), None if here is None else greyed(here)
