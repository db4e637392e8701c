"""The Styles screen: which style, how far to turn for it, and what becomes of the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from app.core.base.angles import wrap
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish, YawAsked, YawWord
from app.core.solver.style_result import StyleResult
from app.core.styles.lamps import (
    AS_PUBLISHED,
    Studio,
    choice_keys,
    parse_ratio,
    parse_softness,
)
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.model import COMPUTING, Step
from app.ui.presenters.services import Presenter, Services
from app.ui.screens.styles.cards import cards_of, filters_of, rules_words, stale_card
from app.ui.screens.styles.files import StyleFiles
from app.ui.screens.styles.gallery import Snapshot
from app.ui.screens.styles.like_photo import LIKE_WORDS, LikePhoto, LikeState
from app.ui.screens.styles.pictures import StylesPictures
from app.ui.screens.styles.state import (
    CardState,
    DetailState,
    Filter,
    LampsState,
    LensState,
    Main,
    Sizes,
    Sort,
    StylesState,
    StylesView,
)
from app.words.lamps import RATIO_CHOICES, SIZE_CHOICES, studio_words
from app.words.phrases.directions import LENS_CHOICES, aside_words

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController

T = TypeVar("T", CardState, DetailState)

_GALLERY: Final = frozenset({"head", "light", "results", "user_styles", "damaged_styles"})
_SELECTED: Final = frozenset({"front_deg", "settings", "place", "head_name"})
_FIELDS: Final = frozenset({"chosen", "needle_deg"})
_SAME_DEG: Final = 1e-6
_MOST: Final = 4  # styles beside each other
_EMPTY: Final = {
    Filter.ALL: "",
    Filter.IN_REACH: tr("No style is in reach here. A lamp may bring some back."),
    Filter.OUT_OF_REACH: tr("Every style is in reach here."),
    Filter.MINE: tr("Paint a style, or drop a portrait whose light you like."),
}
_NOT_MEASURED: Final = tr("No light measured yet.")
_ASIDE: Final = tr("aside")
_LENS_SHORT: Final = {
    "0": tr("straight"),
    "auto": tr("best"),
    "short": tr("short"),
    "broad": tr("broad"),
}
_MAIN_WORDS: Final[dict[Main | None, tuple[str, str]]] = {
    "turn": (tr("Turn to this style"), tr("turn")),
    "lamp": (tr("Try a lamp for this style"), tr("try a lamp")),
    "probe": (tr("Go to Probe"), tr("go to Probe")),
    None: (tr("Turn to this style"), ""),
}
"""What the main button's key does, for the list of actions and for the foot."""


_CLIPPED: Final = 0.01  # of the light: less changes no turn


class StylesPresenter(Presenter[StylesView]):
    """Resolves the gallery and the detail, and takes what the user does there."""

    drop_words = LIKE_WORDS

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._place_controller = place_controller
        self.files = StyleFiles(services, place_controller, self._front)
        self.like = LikePhoto(services, place_controller, self._show_like)
        self._pictures = StylesPictures(services, self._refresh)
        self._cards: tuple[CardState, ...] = ()
        self._cards_key: tuple[object, ...] = ()
        self._filter, self._sort = Filter.ALL, Sort.MATCH
        self._marked: tuple[str, ...] = ()
        self._swapped = False
        services.model.changed.connect(self._model_changed)
        if services.model.results:
            # Pictures are made before anybody looks.
            self._pictures.ask()

    # -- what the frame calls ------------------------------------------------------------------

    def attach(self, view: StylesView) -> None:
        """Show everything in `view` from now on."""
        self._view = view
        self.files.attach(view)
        if self._snapshot is None and not self._pictures.has_asked:
            self._pictures.ask()
        self._refresh()

    def detach(self) -> None:
        """Show nothing any more."""
        super().detach()
        self.files.attach(None)

    def enter(self) -> None:
        """Show what has changed meanwhile."""
        if not self._in_front:
            self._in_front = True
            self._refresh()
        self._place_controller.photo_taker = self.like.take

    def leave(self) -> None:
        """The screen is hidden: the needle may move without pictures being made."""
        self._in_front = False
        self._place_controller.photo_taker = None

    def _show_like(self, state: LikeState) -> None:
        if self._view is not None:
            self._view.show_like(state)

    def actions(self) -> Sequence[Action]:
        """List what can be done here; what has hints comes first."""
        has_light, files = self._has_light, self.files
        main, hint = _MAIN_WORDS[self._main()]
        return (
            Action("next-style", tr("Next style"), self.choose_next, hint=tr("choose"),
                   keys=tr("Arrows")),
            Action(
                "styles-main", main, self.main, "turn", "Return; Enter",
                self._main_works, hint=hint,
            ),
            Action("paint-style", tr("Paint on this style"), self.paint, "brush", "P",
                   hint=tr("paint")),
            Action("swap-pictures", tr("Swap target and here"),
                   lambda: self.swap(not self._swapped), "mirror", keys="S"),
            Action("compare-styles", tr("Compare the marked styles"), self.compare, "grid", "C",
                   lambda: len(self._marked) > 1 and not self._pictures.stale),
            Action("same-exposure", tr("Same exposure"), self.expose_alike, "exposure", "E"),
            Action("lens", tr("Camera position"), self.ask_lens, "camera",
                   enabled=self.lens_works),
            Action("paint-new", tr("Paint a new style"), self.paint_new, "brush"),
            Action("recapture", tr("Capture the full range"), self.recapture, "camera", "",
                   self._clipped),
            Action("best-turn", tr("Back to the best turn"), self.go_best, "restore", "",
                   has_light),
            Action("turn-anyway", tr("Turn to the shown angle"), self.turn, "turn", "", has_light),
            *files.actions(),
        )  # fmt: skip

    # -- what the view calls -------------------------------------------------------------------

    def sized(self, sizes: Sizes) -> None:
        """Learn how large pictures are on the screen; they are made again when it changes.

        Args:
            sizes: Device pixels.
        """
        if sizes != self._pictures.sizes:
            self._pictures.sized(sizes)
            self._refresh()

    def choose(self, key: str) -> None:
        """Bring a style to the front, at its best turn."""
        if self._snapshot is not None and key in self._snapshot.styles:
            self._services.model.choose(key)

    def choose_next(self) -> None:
        """Bring the next card's style to the front; after the last comes the first."""
        keys = [card.key for card in self._shown_cards() if card.damaged is None]
        front = self._pictures.front
        if keys:
            place = keys.index(front) + 1 if front in keys else 0
            self.choose(keys[place % len(keys)])

    def open(self, key: str) -> None:
        """Choose a style and do what the main button does, as on a double click."""
        self.choose(key)
        self.main()

    def swap(self, swapped: bool) -> None:
        """Let targets and pictures here change places on all cards, and in the detail."""
        if swapped != self._swapped:
            self._swapped = swapped
            self._refresh(detail=False)

    def mark(self, key: str) -> None:
        """Mark a style to be compared, or no longer; "" takes all marks away.

        A fifth takes the place of the first: more do not fit beside each other.
        """
        marks = tuple(one for one in self._marked if key not in (one, ""))
        self._marked = marks if key in (*self._marked, "") else (*marks[1 - _MOST :], key)
        self._refresh(detail=False)

    def compare(self) -> None:
        """Show the marked styles beside each other, each at its best turn."""

        def show(states: tuple[DetailState, ...]) -> None:
            if self._view is not None and self._in_front:
                self._view.show_compared(states)

        if len(self._marked) > 1 and not self._pictures.stale:
            self._pictures.compare(self._marked, show)

    def expose_alike(self) -> None:
        """Give all pictures here the selected style's exposure, or each its own."""
        model = self._services.model
        model.set("same_exposure", not model.settings.same_exposure)

    def set_card_width(self, width: int) -> None:
        """Make cards at least so wide, logical pixels at scale 1; 0 leaves it to the window."""
        self._services.model.set("card_width", width)

    def set_filter(self, key: str) -> None:
        """Show other cards; see `Filter`."""
        self._filter = Filter(key)
        self._refresh(detail=False)

    def set_sort(self, key: str) -> None:
        """Show them in another order; see `Sort`."""
        self._sort = Sort(key)
        self._refresh(detail=False)

    def look_at(self, turn_deg: float) -> None:
        """Move the needle: pictures, background, weights and numbers follow."""
        best = self._best()
        if best is None:
            return
        at_best = abs(wrap(turn_deg - best)) < _SAME_DEG
        self._services.model.update(needle_deg=None if at_best else self._counted(turn_deg))

    def take_peak(self, index: int) -> None:
        """Move the needle to a second peak."""
        result = self._result()
        peaks = () if result is None else result.peaks[1:]
        if 0 <= index < len(peaks):
            self.look_at(peaks[index].turn_refined_deg)

    def go_best(self) -> None:
        """Put the needle back to the best turn."""
        self._services.model.update(needle_deg=None)

    def main(self) -> None:
        """Do what the main button says."""
        if not self._main_works():
            return
        does = self._main()
        if does == "turn":
            self.turn()
        else:
            step = Step.LIGHT if does == "lamp" else Step.PROBE
            self._services.model.update(chosen=self._pictures.front, step=step, painting=None)

    def recapture(self) -> None:
        """Capture this spot once more with the full range, and come back to this style."""
        self._services.model.update(
            chosen=self._pictures.front, step=Step.PROBE, painting=None, recapture=True
        )

    def _clipped(self) -> bool:
        """Whether three frames left lamps clipped that more would hold; none holds the sun."""
        place = self._services.model.place
        capture = None if place is None or place.location.sun else place.capture
        share = 0.0 if capture is None or capture.plan != "paper" else capture.clipped_share or 0.0
        return share >= _CLIPPED

    def turn(self) -> None:
        """Go to the shown turn, whether the style is in reach or not."""
        best, needle = self._best(), self._pictures.needle_deg
        if best is not None and not self._pictures.stale:
            goal = self._counted(best if needle is None else needle)
            self._services.model.update(
                chosen=self._pictures.front, goal_deg=goal, plan=None, step=Step.TURN
            )

    def paint(self) -> None:
        """Paint on the style in front."""
        key = self._pictures.front
        if key is not None:
            self._services.model.update(painting=key)

    def paint_new(self) -> None:
        """Paint a style from nothing."""
        self._services.model.update(painting="")

    def prepare_lamps(self) -> None:
        """Get ready for every size and every ratio that are one click away."""
        now = self.lamps()
        pairs = [(now.size, ratio) for ratio in RATIO_CHOICES]
        pairs += [(size, now.ratio) for size in SIZE_CHOICES]
        self._place_controller.prepare_lamps([_studio(*pair) for pair in pairs], self._lamps_of())

    def choose_lamps(self, size: str, ratio: str) -> None:
        """Light the targets by other lamps; keys as in `LampsState`."""
        self._place_controller.choose_lamps(_studio(size, ratio), self._lamps_of())

    def _lamps_of(self) -> str:
        """The style that has lamps of its own and is in front, "" for all others."""
        return self._pack_style if self.lamps().only else ""

    @property
    def _pack_style(self) -> str:
        """Name under which the pack knows the style in front."""
        snapshot, front = self._snapshot, self._pictures.front or ""
        return front if snapshot is None else snapshot.source(front)

    def keep_lamps_to_style(self, only: bool) -> None:
        """Give the style in front lamps of its own, or those of all others again."""
        model, style = self._services.model, self._pack_style
        if style:
            now = model.studios.get("", AS_PUBLISHED)
            self._place_controller.choose_lamps(now if only else None, style)

    def ask_lens(self) -> None:
        """Let the place of the lens be chosen."""
        if self._view is not None:
            self._view.ask_lens()

    def lens_works(self) -> bool:
        """Whether a place is open, and the head is known from aside."""
        model = self._services.model
        return model.place is not None and model.head is not None and bool(model.head.views)

    def choose_lens(self, key: str) -> None:
        """Say how the face is turned to the lens; keys of `LENS_CHOICES`."""
        yaw: YawAsked = float(key) if key.lstrip("-").isdigit() else cast("YawWord", key)
        self._place_controller.choose_lens(replace(self._services.model.lens, yaw=yaw))

    def choose_background(self, middle_deg: float | None, width_deg: float = 20.0) -> None:
        """Ask for what is behind the sitter, by its azimuth in the panorama; None for anything.

        Straight in front of the face there is only one: the lens is set free for others.
        """
        lens = self._services.model.lens
        if middle_deg is None:
            self._place_controller.choose_lens(replace(lens, background=None))
            return
        ends = wrap(middle_deg - width_deg), wrap(middle_deg + width_deg)
        yaw: YawAsked = "auto" if lens == STRAIGHT else lens.yaw
        self._place_controller.choose_lens(LensWish(yaw, ends))

    def background_now(self) -> float:
        """Azimuth in the panorama of what is behind the sitter for the style in front, deg."""
        result = self._result()
        return wrap(self._services.model.front_deg + (result.background_deg if result else 180.0))

    # -- resolving -----------------------------------------------------------------------------

    def resolve(self) -> StylesState:
        """Work out what the screen shows now."""
        self._pictures.resolve()
        return self._state()

    def _state(self) -> StylesState:
        snapshot = self._snapshot
        measured = self._services.model.light is not None
        if snapshot is None:
            return StylesState(
                filter=self._filter,
                sort=self._sort,
                busy=True,
                measured=measured,
                detail=DetailState(main_works=False),
            )
        stale = self._pictures.stale
        cards, detail = self._shown_cards(), self._pictures.detail_state
        if stale:
            cards = tuple(map(stale_card, cards))
            detail = replace(detail, stale=True, main_works=False, numbers=COMPUTING)
        if self._swapped:
            tags = {"target_tag": detail.here_tag, "here_tag": detail.target_tag}
            exposed = {"target_exposed": detail.here_exposed, "here_exposed": ""}
            detail = _exchanged(detail, **tags, **exposed)
        return StylesState(
            cards=cards,
            filters=tuple((key.value, words) for key, words in filters_of(snapshot, stale)),
            filter=self._filter,
            sort=self._sort,
            empty="" if cards else COMPUTING if stale else self._empty_words(measured),
            measured=measured,
            busy=self._pictures.busy,
            stale=stale,
            clipped=self._clipped(),
            lamps=self.lamps(),
            lens=self.lens(),
            rules="" if stale else rules_words(snapshot),
            card_width=self._services.model.settings.card_width,
            same_exposure=self._services.model.settings.same_exposure,
            marked=len(self._marked),
            swapped=self._swapped,
            detail=detail,
        )

    def lamps(self) -> LampsState:
        """What is chosen of the photographer's lamps."""
        model, snapshot, style = self._services.model, self._snapshot, self._pack_style
        studios = model.studios
        studio = studios.get(style, studios.get("", AS_PUBLISHED))
        size, ratio = choice_keys(studio)
        sizes = SIZE_CHOICES if size in SIZE_CHOICES else {**SIZE_CHOICES, size: f"{size}°"}
        return LampsState(
            words=tr("Lamps: {lamps}", lamps=studio_words(studio)),
            sizes=tuple(sizes.items()),
            size=size,
            ratio=ratio,
            only=style in studios,
            own=snapshot is not None and style not in snapshot.asking,
            works=model.place is not None,
        )

    def lens(self) -> LensState:
        """What is chosen of where the lens stands."""
        model = self._services.model
        lens, light = model.lens, model.light
        key = lens.yaw if isinstance(lens.yaw, str) else f"{lens.yaw:g}"
        name = LENS_CHOICES.get(key) or aside_words(float(key))
        middle, width = None, 20.0
        if lens.background is not None:
            start, end = lens.background
            width = (end - start) % 360.0 / 2.0
            middle = wrap(start + width)
        return LensState(
            short=tr("Lens: {lens}", lens=_LENS_SHORT.get(key, _ASIDE)),
            words=tr("Lens: {lens}", lens=name),
            key=key,
            background=middle,
            width=width,
            panorama=None if light is None else light.display,
            works=self.lens_works(),
        )

    def _empty_words(self, measured: bool) -> str:
        if not measured and self._filter is not Filter.MINE:
            return _NOT_MEASURED
        return _EMPTY[self._filter]

    def _shown_cards(self) -> tuple[CardState, ...]:
        if self._snapshot is None:
            return ()
        key = (self._filter, self._sort, self._pictures.front)
        whole = (*key, self._snapshot.version, self._marked, self._swapped)
        if whole != self._cards_key:
            self._cards_key = whole
            self._marked = tuple(one for one in self._marked if one in self._snapshot.styles)
            cards = cards_of(self._snapshot, *key)
            cards = tuple(replace(one, marked=one.key in self._marked) for one in cards)
            self._cards = cards
            if self._swapped:
                self._cards = tuple(_exchanged(one, swapped=True) for one in cards)
        return self._cards

    def _counted(self, turn_deg: float) -> float:
        """Count a turn on the screen from where the photographer stands by now."""
        return wrap(turn_deg - self._pictures.moved_deg)

    @property
    def _snapshot(self) -> Snapshot | None:
        return self._pictures.snapshot

    def _result(self) -> StyleResult | None:
        """Answer for the style in front."""
        snapshot, front = self._snapshot, self._pictures.front
        return None if snapshot is None else snapshot.results.get(front or "")

    def _best(self) -> float | None:
        result = self._result()
        return None if result is None else result.turn_refined_deg

    def _has_light(self) -> bool:
        return self._best() is not None and not self._pictures.stale

    def _main(self) -> Main | None:
        """Return what the main button does; None while nothing can be done."""
        if self._snapshot is None or self._pictures.front is None or self._pictures.stale:
            return None
        if self._snapshot.question.light is None:
            return "probe"
        result = self._result()
        return None if result is None else "turn" if self._snapshot.within(result) else "lamp"

    def _main_works(self) -> bool:
        return self._main() is not None

    def _front(self) -> tuple[Snapshot | None, DetailState]:
        if self._view is None or not self._in_front:
            self._pictures.resolve()
        detail_state = self._pictures.detail_state
        return self._snapshot, replace(
            detail_state, stale=True
        ) if self._pictures.stale else detail_state

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & _GALLERY:
            self._pictures.ask()
        if names & (_GALLERY | _SELECTED):
            self._refresh(detail=False)
        if names & {"chosen", "settings"}:
            self._pictures.expose()
        if names & _FIELDS:
            self._refresh()

    def _refresh(self, detail: bool = True) -> None:
        if self._view is None or not self._in_front:
            return
        if detail:
            self._pictures.resolve()
        self._view.show_state(self._state())


def _exchanged(state: T, **more: Any) -> T:
    return replace(state, target=state.here, here=state.target, **more)


def _studio(size: str, ratio: str) -> Studio:
    return Studio(parse_softness(size), parse_ratio(ratio))
