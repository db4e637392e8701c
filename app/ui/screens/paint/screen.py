"""The Paint screen, which turns strokes into answers for this place while the pen moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

from app.core.painting.canvas import Canvas, Region
from app.core.painting.stroke import Tool
from app.core.painting.stroke_undo import TileChange, cleared
from app.core.painting.user_style import UserStyle
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services
from app.ui.presenters.undo_stack import Undoable
from app.ui.presenters.window_model import Step
from app.ui.screens.paint.canvas import CanvasLook, CanvasMode, CanvasState, Point
from app.ui.screens.paint.document import OpenedCanvas, PaintDocument
from app.ui.screens.paint.drafts import DraftKeeper
from app.ui.screens.paint.files import FilesView, PaintFiles, SaveState, save_why
from app.ui.screens.paint.live import LiveAnswer, LiveState
from app.ui.screens.paint.paintings import Paintings
from app.ui.screens.paint.tools import BrushBox, ToolsState, starts_of

_LOOK_JOB: Final = "paint-look"
_FIELDS: Final = frozenset({"results", "answered", "user_styles", "place", "head_name"})
_DRAFT_KEPT: Final = tr("Draft saved. Every stroke is kept.")


@dataclass(frozen=True, slots=True, eq=False)
class PaintState:
    """The state of the Paint screen, with one part per panel and without the canvas itself."""

    tools: ToolsState = field(default_factory=ToolsState)
    canvas: CanvasState = field(default_factory=CanvasState)
    live: LiveState = field(default_factory=LiveState)
    save: SaveState = field(default_factory=SaveState)


class PaintView(FilesView, Protocol):
    """A view that shows a `PaintState` and a canvas."""

    def show_state(self, state: PaintState) -> None:
        """Show the state."""

    def canvas_changed(self, canvas: Canvas, regions: tuple[Region, ...] | None) -> None:
        """Show the canvas.

        Args:
            regions: Parts that have changed since the last call, or None for everything.
        """


class PaintPresenter(Presenter[PaintView]):
    """Handles strokes and resolves the state of the Paint screen.

    It has four panels: `tools` for the brush, `look` for the contents of the canvas, `live` for the
    live column, and `files` for saving, renaming, duplicating, deleting, exporting and importing.
    """

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._document: PaintDocument | None = None
        self._keeper = DraftKeeper(services)
        self._paintings = Paintings(services, self._keeper)
        self.tools = BrushBox(self._refresh)
        self.look = CanvasLook(services, self._refresh)
        self.live = LiveAnswer(services, self._sync, self._refresh)
        self._state = PaintState()
        self._start_regions: tuple[Region, ...] = ()
        self.files = PaintFiles(services, place_controller, self._keeper, self._files_changed)
        services.model.changed.connect(self._model_changed)
        services.undo.changed.connect(self._refresh)
        services.undo.give_up = self.give_up
        place_controller.own_styles.leaving.connect(self._style_leaves)
        place_controller.own_styles.gone.connect(self._style_gone)
        place_controller.own_styles.back.connect(self._paintings.restored)
        place_controller.own_styles.renamed.connect(self._style_renamed)

    # -- what the frame calls ------------------------------------------------------------------

    def attach(self, view: PaintView) -> None:
        """Start showing the state in `view`."""
        self._view = view
        self.files.attach(view)
        self._sync()
        self._show_canvas(None)
        self._refresh()

    def detach(self) -> None:
        """Stop showing the state."""
        super().detach()
        self.files.attach(None)

    def enter(self) -> None:
        """Open the draft and prepare the light."""
        self._in_front = True
        self._sync()

    def leave(self) -> None:
        """Pause work on the canvas, but keep the canvas."""
        self._in_front = False
        self._put_away()

    def actions(self) -> Sequence[Action]:
        """Return the available actions, starting with those that have hints."""
        undo = self._services.undo
        take, larger, *brush = self.tools.actions()
        return (
            take,
            larger,
            Action("undo-here", tr("Undo"), undo.undo, "undo", "",
                   lambda: bool(undo.undo_words), tr("undo"), "Ctrl+Z", undo.undo_words),
            Action("paint-back", tr("Back to styles"), self.back, "styles", "Escape",
                   hint=tr("back to styles")),
            *brush,
            *self.look.actions(),
            Action("clear-strokes", tr("Clear strokes"), self.clear, "trash"),
            Action("save-style", tr("Save as my style"), self.files.ask_save, "save",
                   "Ctrl+S; Return; Enter", lambda: self.save_works),
            *self.files.actions(),
        )  # fmt: skip

    # -- start and size ------------------------------------------------------------------------

    def choose_start(self, key: str) -> None:
        """Start from another style or from nothing, keeping the current painting as a draft.

        The user can undo this.
        """
        document, model = self._document, self._services.model
        if document is None or key in (document.start, document.key):
            return

        def back() -> None:
            self._bring(document)

        model.update(painting=key)
        self._services.undo.push(
            Undoable(tr("start from another style"), back, lambda: model.update(painting=key))
        )

    def sized(self, rows: int, columns: int) -> None:
        """Set the size of the portrait, in pixels."""
        if self.live.set_size(rows, columns):
            self._refresh()

    # -- strokes -------------------------------------------------------------------------------

    def press(self, point: Point, eraser: bool = False) -> None:
        """Begin a stroke. A stroke with the pen's eraser restores the starting point.

        To avoid delaying the pen, the answer is updated only by the next `draw` or `lift`.
        """
        if self._document is not None:
            tool = Tool.RESTORE if eraser else self.tools.brush.tool
            brush = replace(self.tools.brush, tool=tool)
            self._start_regions = self._document.session.begin(brush, *point)
            self._show_canvas(self._start_regions)

    def draw(self, points: Sequence[Point]) -> None:
        """Extend the stroke through the points added since the last call, and update the answer."""
        document = self._document
        if document is None or not document.session.stroking:
            return
        regions, self._start_regions = [*self._start_regions], ()
        for point in points:
            regions += document.session.extend(*point)
        if not regions:
            return
        self._show_canvas(tuple(regions))
        if not self.live.follow():
            self._refresh()
        elif self._view is not None and self._in_front:
            # A move of the pen changes nothing else on the screen.
            self._state = replace(self._state, live=self.live.state)
            if self.look.mode is not CanvasMode.WEIGHTS and self.live.answer is not None:
                look = self.look.resolve(document, self.live.answer, self.tools.brush)
                self._state = replace(self._state, canvas=look)
            self._view.show_state(self._state)

    def lift(self, points: Sequence[Point] = ()) -> None:
        """End the stroke after the last points, and record it for undo."""
        document = self._document
        if document is None or not document.session.stroking:
            return
        self._start_regions = ()
        regions = [region for point in points for region in document.session.extend(*point)]
        self._show_canvas(tuple(regions))
        change = document.session.commit()
        self._look_soon()
        if change:
            self._done(document, change, tr("stroke on {title}", title=document.title))
        self._refresh()

    def give_up(self) -> bool:
        """Abort the current stroke, and return whether there was one."""
        document = self._document
        if document is None or not document.session.stroking:
            return False
        document.session.abort()
        self._changed(None)
        return True

    def dab(self, x: float, y: float) -> None:
        """Paint a dab of the brush at a position in canvas pixels."""
        self.press((x, y, 1.0))
        self.lift()

    def clear(self) -> None:
        """Remove all strokes. The user can undo this."""
        document = self._document
        if document is None:
            return
        self.give_up()
        _, change = cleared(document.session.canvas)
        if change:
            document.session.apply(change)
            self._changed(None)
            self._done(document, change, tr("clear the strokes on {title}", title=document.title))

    def undo(self) -> None:
        """Undo the last step in the window."""
        self._services.undo.undo()

    def redo(self) -> None:
        """Redo the last undone step."""
        self._services.undo.redo()

    def back(self) -> None:
        """Abort the current stroke, or return to the gallery."""
        if not self.give_up():
            self._services.model.update(painting=None)

    def measure(self) -> None:
        """Go to the Probe screen."""
        self._services.model.update(step=Step.PROBE, painting=None)

    # -- state ---------------------------------------------------------------------------------

    def resolve(self) -> PaintState:
        """Return the state of the screen, excluding the canvas."""
        self._state = self._resolved()
        return self._state

    def _resolved(self) -> PaintState:
        document, model, undo = self._document, self._services.model, self._services.undo
        answer, brush = self.live.answer, self.tools.brush
        tools = ToolsState(brush, undo=undo.undo_words, redo=undo.redo_words)
        if document is None or answer is None:
            words = tr("Loading the head…") if model.head is None else tr("Opening…")
            return PaintState(
                replace(tools, notice=words),
                CanvasState(notice=words, brush=brush, mode=self.look.mode),
                LiveState(sentence=words),
                SaveState(why=words),
            )
        starts = starts_of(document, model.user_styles)
        can_clear = document.session.canvas.touched
        return PaintState(
            replace(tools, starts=starts, start=document.start, can_clear=can_clear),
            self.look.resolve(document, answer, brush),
            self.live.state,
            self.files.resolve(document, answer.advice),
        )

    @property
    def canvas(self) -> Canvas | None:
        """The canvas, including the current stroke."""
        return None if self._document is None else self._document.session.canvas

    @property
    def save_works(self) -> bool:
        """Whether the painting can be saved now."""
        document, answer = self._document, self.live.answer
        if document is None or answer is None or self.files.saving:
            return False
        return not save_why(answer.advice, document)

    def _changed(self, regions: tuple[Region, ...] | None) -> None:
        """Show the changed canvas and the new answer."""
        self._show_canvas(regions)
        self.live.look()
        self._refresh()

    def _look_soon(self) -> None:
        """Solve the canvas after the current event, to avoid delaying the pen."""

        def done(_: None) -> None:
            self.live.look()
            self._refresh()

        self._services.runner.submit(_LOOK_JOB, lambda *_: None, done=done)

    def _show_canvas(self, regions: tuple[Region, ...] | None) -> None:
        if self._view is not None and self._document is not None:
            self._view.canvas_changed(self._document.session.canvas, regions)

    # -- undo ----------------------------------------------------------------------------------

    def _done(self, document: PaintDocument, change: TileChange, words: str) -> None:
        """Record a change to the canvas for undo, and save the draft."""
        self._paintings.add(document)
        self._services.undo.push(
            Undoable(
                words,
                lambda: self._exchange(document, change, back=True),
                lambda: self._exchange(document, change, back=False),
                change.nbytes,
            )
        )
        self._keeper.keep(document.path, document.draft())

    def _exchange(self, document: PaintDocument, change: TileChange, *, back: bool) -> None:
        self._bring(document)
        session = document.session
        regions = None if session.stroking else change.regions
        try:
            session.revert(change) if back else session.apply(change)
        except ValueError:
            # The canvas of another head has a different size.
            words = tr("This stroke was made on a different head.")
            self._services.notify.tell(words, kind="warning")
            return
        self._show_canvas(regions)
        self._look_soon()
        self._refresh()
        self._keeper.keep(document.path, document.draft())

    def _bring(self, document: PaintDocument) -> None:
        """Open a painting, whichever screen is visible."""
        if self._document is not document:
            self._put_away(quiet=True)
            self._take(document)
        self._services.model.update(step=Step.STYLES, painting=document.key)

    # -- opening, light, leaving ---------------------------------------------------------------

    def _model_changed(self, names: frozenset[str]) -> None:
        if not self._in_front:
            return
        if names & {"painting", "head", "settings", "light", "front_deg"}:
            self._sync(renew=bool(names & {"settings", "front_deg"}))
        if names & _FIELDS:
            self.live.look()
            self._refresh()

    def _sync(self, renew: bool = False) -> None:
        """Open or update the painting named by the model."""
        model = self._services.model
        key, head = model.painting, model.head
        if key is None or head is None:
            self._refresh()
            return
        document = self._document
        if document is None or document.key != key:
            self._open(key)
            return
        self._paintings.opening = None
        table = self.live.light.table()
        if renew or document.head is not head:
            self.give_up()
            document.renew(head, table, model.settings, model.front_deg)
            self._show_canvas(None)
        else:
            document.session.set_light(table, model.front_deg)
        self.live.look()
        self._refresh()

    def _open(self, key: str) -> None:
        if self._paintings.opening == key:
            return
        self._put_away()
        self._set_document(None)
        document = self._paintings.find(key)
        if document is not None:
            self._take(document)
            self._sync(renew=True)
            return
        self._refresh()
        self._paintings.open(key, self._opened)

    def _opened(self, document: PaintDocument, opened: OpenedCanvas) -> None:
        self._take(document)
        self._sync()
        tell = self._services.notify.tell
        for note in opened.notes:
            tell(note, kind="warning")
        if opened.restored and document.unsaved:
            tell(
                tr("Your draft of {title} was restored.", title=document.title),
                actions=((tr("Start over"), self.clear),),
            )

    def _set_document(self, document: PaintDocument | None) -> None:
        self._document = document
        self.look.take(document)
        self.live.take(document)

    def _take(self, document: PaintDocument) -> None:
        self._set_document(document)
        self._paintings.add(document)
        self._paintings.opening = None
        self.files.take(document)
        self.live.look()
        self._show_canvas(None)
        self._refresh()

    def _put_away(self, quiet: bool = False) -> None:
        """End the stroke, save the draft and report that the draft is saved."""
        document = self._document
        if document is None:
            return
        self.lift()
        is_saved = self._keeper.flush()
        if is_saved and document.unsaved and not quiet:
            key, model = document.key, self._services.model
            self._services.notify.tell(
                _DRAFT_KEPT,
                kind="done",
                actions=((tr("Continue"), lambda: model.update(step=Step.STYLES, painting=key)),),
            )

    # -- the painted style is deleted, restored or renamed -------------------------------------

    def _style_leaves(self, name: str) -> None:
        document = self._document
        if document is not None and document.key == name:
            self.lift()
        self._keeper.flush()

    def _style_gone(self, name: str) -> None:
        """Close a painting after its style and its draft have been deleted."""
        if self._document is not None and self._document.key == name:
            self._set_document(None)
        if self._services.model.painting == name:
            self._services.model.update(painting=None)

    def _style_renamed(self, style: UserStyle) -> None:
        self._paintings.renamed(style)
        self._refresh()

    def _files_changed(self) -> None:
        """Show the effect of saving, renaming or deleting a style."""
        document = self._document
        if document is not None:
            self._paintings.add(document)
        self._refresh()
