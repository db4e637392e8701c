"""The Styles screen: the cards in the gallery, and the details of the chosen style."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from app.core.base.angles import wrap
from app.core.styles.styles import mirror_name
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.services import Presenter, Services
from app.ui.presenters.window_model import COMPUTING, Step
from app.ui.screens.styles.cards import (
    CardGroup,
    CardState,
    Filter,
    Sort,
    filters_of,
    groups_of,
    rules_words,
    stale_group,
)
from app.ui.screens.styles.detail import DetailState, Main
from app.ui.screens.styles.files import StyleFiles, StyleFilesView
from app.ui.screens.styles.gallery import Sizes, Snapshot
from app.ui.screens.styles.lamps_and_lens import LampsChoice, LampsState, LensChoice, LensState
from app.ui.screens.styles.like_photo import LIKE_WORDS, LikePhoto, LikeState
from app.ui.screens.styles.pictures import StylesPictures

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController

T = TypeVar("T", CardState, DetailState)

_GALLERY: Final = frozenset({"head", "light", "results", "user_styles", "damaged_styles"})
_SELECTED: Final = frozenset({"front_deg", "settings", "place", "head_name"})
_FIELDS: Final = frozenset({"chosen", "needle_deg"})
_SAME_DEG: Final = 1e-6
_MOST: Final = 4  # maximum number of styles side by side
_MAIN_WORDS: Final[dict[Main | None, tuple[str, str]]] = {
    "turn": (tr("Turn to this style"), tr("turn")),
    "lamp": (tr("Try a lamp for this style"), tr("try a lamp")),
    "probe": (tr("Go to Probe"), tr("go to Probe")),
    None: (tr("Turn to this style"), ""),
}
"""Labels for the main button's action, for the list of actions and the foot of the window."""

_CLIPPED: Final = 0.01  # fraction of the light; a smaller fraction changes no turn


@dataclass(frozen=True, slots=True, eq=False)
class StylesState:
    """The state of the Styles screen.

    Attributes:
        groups: The cards in reading order, in groups with headings.
        filters: Key and label for each filter, such as ("mine", "Mine 2").
        stale: Whether the cards and the details are for another selection. If so, the headings show
            no counts.
        clipped: Whether a capture of the full range would record more of the light.
        rules: In paper mode, a sentence stating for how many styles our rule and the paper's
            disagree.
        card_width: Minimum width of a card, in logical pixels at scale 1, or 0 to choose it
            automatically.
        marked: Number of styles marked for comparison.
        numbers: Whether the match, the ratio and the curves of the chosen style are shown.
    """

    groups: tuple[CardGroup, ...] = ()
    filters: tuple[tuple[str, str], ...] = ()
    filter: Filter = Filter.ALL
    sort: Sort = Sort.MATCH
    measured: bool = False
    busy: bool = False
    stale: bool = False
    clipped: bool = False
    lamps: LampsState = field(default_factory=LampsState)
    lens: LensState = field(default_factory=LensState)
    rules: str = ""
    card_width: int = 0
    marked: int = 0
    swapped: bool = False
    same_exposure: bool = False
    numbers: bool = False
    detail: DetailState = field(default_factory=DetailState)

    @property
    def cards(self) -> tuple[CardState, ...]:
        """All cards in reading order."""
        return tuple(card for group in self.groups for card in group.cards)


class StylesView(StyleFilesView, Protocol):
    """A view that shows a `StylesState`."""

    def show_state(self, state: StylesState) -> None:
        """Show the state."""

    def show_compared(self, states: tuple[DetailState, ...]) -> None:
        """Show several styles side by side, each at its best turn."""

    def ask_lens(self) -> None:
        """Ask for the camera position."""

    def show_like(self, state: LikeState) -> None:
        """Show the light in a photo."""


class StylesPresenter(Presenter[StylesView]):
    """Resolves the gallery and the details, and handles the user's actions.

    It has four panels: `lamps` and `lens` for the photographer's set-up, `like` for turning a
    photo's light into a style, and `files` for saving, renaming, duplicating, deleting, exporting
    and importing.
    """

    drop_words = LIKE_WORDS

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._place_controller = place_controller
        self.files = StyleFiles(services, place_controller, self._front)
        self.like = LikePhoto(services, place_controller, self._show_like)
        self._pictures = StylesPictures(services, self._refresh)
        self.lamps = LampsChoice(services, place_controller, self._pictures)
        self.lens = LensChoice(services, place_controller, self._pictures)
        self._groups: tuple[CardGroup, ...] = ()
        self._groups_key: tuple[object, ...] = ()
        self._recent: tuple[str, ...] = ()
        self._filter, self._sort = Filter.ALL, Sort.MATCH
        self._marked: tuple[str, ...] = ()
        self._swapped = False
        services.model.changed.connect(self._model_changed)
        if services.model.results:
            # Render the pictures before the screen is shown.
            self._pictures.ask()

    # -- what the frame calls ------------------------------------------------------------------

    def attach(self, view: StylesView) -> None:
        """Start showing the state in `view`."""
        self._view = view
        self.files.attach(view)
        if self._snapshot is None and not self._pictures.has_asked:
            self._pictures.ask()
        self._refresh()

    def detach(self) -> None:
        """Stop showing the state."""
        super().detach()
        self.files.attach(None)

    def enter(self) -> None:
        """Show any changes made while the screen was hidden."""
        if not self._in_front:
            self._in_front = True
            self._refresh()
        self._place_controller.photo_taker = self.like.take

    def leave(self) -> None:
        """Stop rendering pictures while the screen is hidden."""
        self._in_front = False
        self._place_controller.photo_taker = None

    def _show_like(self, state: LikeState) -> None:
        if self._view is not None:
            self._view.show_like(state)

    def actions(self) -> Sequence[Action]:
        """Return the available actions, starting with those that have hints."""
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
            Action("swap-pictures", tr("Swap target and result"),
                   lambda: self.swap(not self._swapped), "mirror", keys="S"),
            Action("other-side", tr("Show the other side"), self.choose_other_side, "mirror",
                   "X", self._has_other_side),
            Action("compare-styles", tr("Compare the marked styles"), self.compare, "grid", "C",
                   lambda: len(self._marked) > 1 and not self._pictures.stale),
            Action("why", tr("Why? Numbers and curve"), self._switch_numbers, "", "W"),
            Action("same-exposure", tr("Same exposure"), self.expose_alike, "exposure", "E"),
            Action("lens", tr("Camera position"), self.ask_lens, "camera",
                   enabled=self.lens.works),
            Action("paint-new", tr("Paint a new style"), self.paint_new, "brush"),
            Action("recapture", tr("Capture the full range"), self.recapture, "camera", "",
                   self._clipped),
            Action("best-turn", tr("Back to the best turn"), self.go_best, "restore", "",
                   has_light),
            Action("turn-anyway", tr("Turn to the displayed angle"), self.turn, "turn", "",
                   has_light),
            *files.actions(),
        )  # fmt: skip

    # -- what the view calls -------------------------------------------------------------------

    def sized(self, sizes: Sizes) -> None:
        """Set the sizes of the pictures, and render the pictures again."""
        if sizes != self._pictures.sizes:
            self._pictures.sized(sizes)
            self._refresh()

    def choose(self, key: str) -> None:
        """Choose a style, and show it at its best turn."""
        if self._snapshot is not None and key in self._snapshot.styles:
            self._services.model.choose(key)

    def choose_next(self) -> None:
        """Choose the style on the next card, wrapping around after the last card."""
        cards = [card for group in self._shown_groups() for card in group.cards]
        keys = [card.key for card in cards if card.damaged is None]
        front = self._pictures.front
        if keys:
            place = keys.index(front) + 1 if front in keys else 0
            self.choose(keys[place % len(keys)])

    def choose_other_side(self) -> None:
        """Choose the current style's other side, if it has one."""
        front = self._pictures.front
        if front is not None and self._has_other_side():
            self.choose(mirror_name(front))

    def open(self, key: str) -> None:
        """Choose a style and perform its main action, as a double click does."""
        self.choose(key)
        self.main()

    def swap(self, swapped: bool) -> None:
        """Swap the targets and the pictures here on all cards and in the details."""
        if swapped != self._swapped:
            self._swapped = swapped
            self._refresh(detail=False)

    def mark(self, key: str) -> None:
        """Mark or unmark a style for comparison, or remove all marks if `key` is "".

        A fifth mark replaces the first, because only four styles fit side by side.
        """
        marks = tuple(one for one in self._marked if key not in (one, ""))
        self._marked = marks if key in (*self._marked, "") else (*marks[1 - _MOST :], key)
        self._refresh(detail=False)

    def compare(self) -> None:
        """Show the marked styles side by side, each at its best turn."""

        def show(states: tuple[DetailState, ...]) -> None:
            if self._view is not None and self._in_front:
                self._view.show_compared(states)

        if len(self._marked) > 1 and not self._pictures.stale:
            self._pictures.compare(self._marked, show)

    def expose_alike(self) -> None:
        """Use the chosen style's exposure for all pictures here, or expose each one separately."""
        model = self._services.model
        model.set("same_exposure", not model.settings.same_exposure)

    def show_numbers(self, numbers: bool) -> None:
        """Show or hide the match, the ratio and the curves of the chosen style."""
        self._services.model.set("show_numbers", numbers)

    def set_card_width(self, width: int) -> None:
        """Set the minimum width of a card, in logical pixels at scale 1, or 0 for automatic."""
        self._services.model.set("card_width", width)

    def set_filter(self, key: str) -> None:
        """Show only the cards that match a value of `Filter`."""
        self._filter = Filter(key)
        self._refresh(detail=False)

    def set_sort(self, key: str) -> None:
        """Sort the cards in the order given by a value of `Sort`."""
        self._sort = Sort(key)
        self._refresh(detail=False)

    def look_at(self, turn_deg: float) -> None:
        """Move the needle, and update the pictures, the background, the weights and the numbers."""
        best = self._best()
        if best is None:
            return
        at_best = abs(wrap(turn_deg - best)) < _SAME_DEG
        self._services.model.update(needle_deg=None if at_best else self._counted(turn_deg))

    def take_peak(self, index: int) -> None:
        """Move the needle to one of the other peaks."""
        result = self._pictures.result
        peaks = () if result is None else result.peaks[1:]
        if 0 <= index < len(peaks):
            self.look_at(peaks[index].turn_refined_deg)

    def go_best(self) -> None:
        """Return the needle to the best turn."""
        self._services.model.update(needle_deg=None)

    def main(self) -> None:
        """Perform the action of the main button."""
        if not self._main_works():
            return
        does = self._main()
        if does == "turn":
            self.turn()
        else:
            step = Step.LIGHT if does == "lamp" else Step.PROBE
            self._services.model.update(chosen=self._pictures.front, step=step, painting=None)

    def recapture(self) -> None:
        """Capture this spot again with the full range, and then return to this style."""
        self._services.model.update(
            chosen=self._pictures.front, step=Step.PROBE, painting=None, recapture=True
        )

    def _switch_numbers(self) -> None:
        self.show_numbers(not self._services.model.settings.show_numbers)

    def _clipped(self) -> bool:
        """Return whether a quick capture has clipped lamps that the full range would record."""
        place = self._services.model.place
        capture = None if place is None or place.location.sun else place.capture
        share = 0.0 if capture is None or capture.plan != "paper" else capture.clipped_share or 0.0
        return share >= _CLIPPED

    def turn(self) -> None:
        """Go to the displayed turn, whether or not the style is within reach."""
        best, needle = self._best(), self._pictures.needle_deg
        if best is not None and not self._pictures.stale:
            goal = self._counted(best if needle is None else needle)
            self._services.model.update(
                chosen=self._pictures.front, goal_deg=goal, plan=None, step=Step.TURN
            )

    def paint(self) -> None:
        """Paint on the current style."""
        key = self._pictures.front
        if key is not None:
            self._services.model.update(painting=key)

    def paint_new(self) -> None:
        """Paint a new style."""
        self._services.model.update(painting="")

    def ask_lens(self) -> None:
        """Ask for the camera position."""
        if self._view is not None:
            self._view.ask_lens()

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> StylesState:
        """Return the state of the screen."""
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
        groups, detail = self._shown_groups(), self._pictures.detail_state
        if stale:
            groups = tuple(map(stale_group, groups))
            detail = replace(detail, stale=True, main_works=False, numbers=COMPUTING)
        if self._swapped:
            tags = {"target_tag": detail.here_tag, "here_tag": detail.target_tag}
            exposed = {"target_exposed": detail.here_exposed, "here_exposed": ""}
            # The labels of the areas belong to the picture here.
            why = replace(detail.why, needs="")
            detail = _exchanged(detail, **tags, **exposed, why=why)
        return StylesState(
            groups=groups,
            filters=tuple((key.value, words) for key, words in filters_of(snapshot)),
            filter=self._filter,
            sort=self._sort,
            measured=measured,
            busy=self._pictures.busy,
            stale=stale,
            clipped=self._clipped(),
            lamps=self.lamps.resolve(),
            lens=self.lens.resolve(),
            rules="" if stale else rules_words(snapshot),
            card_width=self._services.model.settings.card_width,
            same_exposure=self._services.model.settings.same_exposure,
            numbers=self._services.model.settings.show_numbers,
            marked=len(self._marked),
            swapped=self._swapped,
            detail=detail,
        )

    def _shown_groups(self) -> tuple[CardGroup, ...]:
        snapshot, front = self._snapshot, self._pictures.front
        if snapshot is None:
            return ()
        whole = (
            *(self._filter, self._sort, front, snapshot.version),
            *(self._marked, self._swapped),
        )
        if whole != self._groups_key:
            self._groups_key = whole
            self._marked = tuple(one for one in self._marked if one in snapshot.styles)
            groups = groups_of(snapshot, self._filter, self._sort, front, self._recent)
            self._groups = tuple(
                replace(group, cards=tuple(map(self._with_mark, group.cards))) for group in groups
            )
        return self._groups

    def _with_mark(self, card: CardState) -> CardState:
        card = replace(card, marked=card.key in self._marked)
        return _exchanged(card, swapped=True) if self._swapped else card

    def _has_other_side(self) -> bool:
        front = self._pictures.front
        return front is not None and mirror_name(front) != front

    def _counted(self, turn_deg: float) -> float:
        """Convert a turn on the screen to a turn from the photographer's current position."""
        return wrap(turn_deg - self._pictures.moved_deg)

    @property
    def _snapshot(self) -> Snapshot | None:
        return self._pictures.snapshot

    def _best(self) -> float | None:
        result = self._pictures.result
        return None if result is None else result.turn_refined_deg

    def _has_light(self) -> bool:
        return self._best() is not None and not self._pictures.stale

    def _main(self) -> Main | None:
        """Return the main button's action, or None if it has none."""
        if self._snapshot is None or self._pictures.front is None or self._pictures.stale:
            return None
        if self._snapshot.question.light is None:
            return "probe"
        result = self._pictures.result
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
        chosen = self._services.model.chosen
        if "light" in names:
            # At another place, the other side may be the better one.
            self._recent = ()
        if "chosen" in names and chosen is not None:
            self._recent = (chosen, *(one for one in self._recent if one != chosen))
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
