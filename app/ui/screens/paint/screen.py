"""The Paint screen: strokes in, the answer of this place out while the pen moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final
from weakref import WeakValueDictionary

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.painting.canvas import Canvas, Region
from app.core.painting.session import Answer, find_draft
from app.core.painting.stroke import TileChange, Tool, cleared
from app.core.painting.user_style import UserStyle
from app.core.solver.place_light import picture_at
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.model import Step
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Presenter, Services
from app.ui.presenters.undo_stack import Undoable
from app.ui.screens.paint.document import (
    DraftKeeper,
    LightOnHead,
    OpenedCanvas,
    PaintDocument,
    head_picture,
    live_state,
    open_canvas,
    picture_here,
    save_why,
    save_words,
    starts_of,
    status_of,
    turned_look,
)
from app.ui.screens.paint.files import PaintFiles
from app.ui.screens.paint.state import (
    TOOLS,
    BrushBox,
    CanvasMode,
    HeadLook,
    LiveState,
    PaintState,
    PaintView,
    Point,
)

_OPEN_JOB: Final = "paint-open"
_LARGER_JOB: Final = "paint-larger"
_TURN_JOB: Final = "paint-turn"
_LOOK_JOB: Final = "paint-look"
_PORTRAIT: Final = (232, 200)
_FIELDS: Final = frozenset({"results", "answered", "user_styles", "place", "head_name"})
_DRAFT_KEPT: Final = tr("Draft kept. Every stroke is still there.")


class PaintPresenter(Presenter[PaintView]):
    """Takes strokes and resolves everything the Paint screen shows.

    `tools` is the brush; `files` saves, names, copies, deletes, hands on and takes in.
    """

    def __init__(self, services: Services, place_controller: PlaceController) -> None:
        super().__init__(services)
        self._document: PaintDocument | None = None
        # As long as a stroke of theirs can be undone, easels live on in the undo list.
        self._documents: WeakValueDictionary[str, PaintDocument] = WeakValueDictionary()
        self._keeper = DraftKeeper(services)
        self.tools = BrushBox(self._refresh)
        self._mode = CanvasMode.WEIGHTS
        self._steps = 0  # of the head, that are under way
        self._size = _PORTRAIT
        self._answer: Answer | None = None
        self._live = LiveState()
        self._start_regions: tuple[Region, ...] = ()
        self._light = LightOnHead(services, self._sync)
        self._opening: str | None = None
        self.files = PaintFiles(services, place_controller, self._keeper, self._files_changed)
        services.model.changed.connect(self._model_changed)
        services.undo.changed.connect(self._refresh)
        services.undo.give_up = self.give_up
        place_controller.own_styles.leaving.connect(self._style_leaves)
        place_controller.own_styles.gone.connect(self._style_gone)
        place_controller.own_styles.back.connect(self._style_back)
        place_controller.own_styles.renamed.connect(self._style_renamed)

    # -- what the frame calls ------------------------------------------------------------------

    def attach(self, view: PaintView) -> None:
        """Show everything in `view` from now on."""
        self._view = view
        self.files.attach(view)
        self._sync()
        self._show_canvas(None)
        self._refresh()

    def detach(self) -> None:
        """Show nothing any more."""
        super().detach()
        self.files.attach(None)

    def enter(self) -> None:
        """Begin: find the draft, prepare the light."""
        self._in_front = True
        self._sync()

    def leave(self) -> None:
        """Pause; what is on the canvas is kept."""
        self._in_front = False
        self._put_away()

    def actions(self) -> Sequence[Action]:
        """List what can be done here; what has hints comes first."""
        tools, undo = self.tools, self._services.undo

        def brush(tool: Tool, key: str) -> Action:
            take = partial(tools.change, tool=tool)
            return Action(
                f"tool-{tool}", tr("Brush: {tool}", tool=TOOLS[tool]), take, tool.value, key
            )

        return (
            replace(brush(Tool.BRIGHTER, "B"), hint=tr("tools"), keys="B D I R"),
            Action("brush-larger", tr("Larger brush"), lambda: tools.resize(1), "plus", "]",
                   hint=tr("size"), keys="[ ]"),
            Action("undo-here", tr("Undo"), undo.undo, "undo", "",
                   lambda: bool(undo.undo_words), tr("undo"), "Ctrl Z", undo.undo_words),
            Action("paint-back", tr("Back to styles"), self.back, "styles", "Escape",
                   hint=tr("back to styles")),
            brush(Tool.DARKER, "D"),
            brush(Tool.IGNORE, "I"),
            brush(Tool.RESTORE, "R"),
            Action("brush-smaller", tr("Smaller brush"), lambda: tools.resize(-1), "minus", "["),
            Action("brush-mirror", tr("Mirror on or off"),
                   lambda: tools.flip("mirror"), "mirror", "M"),
            Action("brush-pressure", tr("Pen pressure on or off"),
                   lambda: tools.flip("pen_pressure"), "pen", "P"),
            Action("show-weights", tr("Show the weights"), lambda: self.show(CanvasMode.WEIGHTS),
                   "layers", "W"),
            Action("show-target", tr("Show the target"), lambda: self.show(CanvasMode.TARGET),
                   "target", "T"),
            Action("show-here", tr("Show the picture here"), lambda: self.show(CanvasMode.HERE),
                   "person", "H"),
            Action("head-left", tr("Turn the head to its left"), lambda: self.turn_head(1),
                   "chevron-right", "."),
            Action("head-right", tr("Turn the head to its right"), lambda: self.turn_head(-1),
                   "chevron-left", ","),
            Action("clear-strokes", tr("Clear strokes"), self.clear, "trash"),
            Action("save-style", tr("Save as my style"), self.files.ask_save, "save",
                   "Ctrl+S; Return; Enter", lambda: self.save_works),
            *self.files.actions(),
        )  # fmt: skip

    # -- what is painted from, and what is shown -----------------------------------------------

    def show(self, what: CanvasMode) -> None:
        """Show something else on the canvas."""
        if what is not self._mode:
            self._mode = what
            if self._document is not None and what is not CanvasMode.WEIGHTS:
                self._document.turned = None
            self._refresh()

    def turn_head(self, steps: int) -> None:
        """Look at the head from further round, and paint there; 0 looks from the front."""
        document = self._document
        if document is None or document.session.stroking:
            return
        yaw = document.turned.yaw_deg if steps and document.turned is not None else 0.0
        # Keys may come faster than views.
        steps = self._steps = self._steps + steps if steps else 0
        head, tell = document.head, self._services.notify.tell

        def done(look: HeadLook | None) -> None:
            self._steps = 0
            if self._document is document and document.head is head:
                document.turned, self._mode = look, CanvasMode.WEIGHTS
                self._refresh()

        def failed(_: Exception) -> None:
            self._steps = 0
            tell(tr("This head was baked from the front only."), kind="warning")

        self._services.runner.submit(
            _TURN_JOB, lambda *_: turned_look(head, yaw, steps), done=done, failed=failed
        )

    def choose_start(self, key: str) -> None:
        """Paint from another style, or from nothing; what was painted is kept as a draft.

        Can be undone.
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
        """Learn how large the portrait is to be, pixels."""
        if (rows, columns) != self._size and rows > 0 and columns > 0:
            self._size = (rows, columns)
            self._look()
            self._refresh()

    # -- strokes -------------------------------------------------------------------------------

    def press(self, point: Point, eraser: bool = False) -> None:
        """Begin a stroke where the pen comes down; its other end, the eraser, restores.

        What it comes to is shown by the next `draw` or `lift`: the hand does not wait for it.
        """
        if self._document is not None:
            tool = Tool.RESTORE if eraser else self.tools.brush.tool
            brush = replace(self.tools.brush, tool=tool)
            self._start_regions = self._document.session.begin(brush, *point)
            self._show_canvas(self._start_regions)

    def draw(self, points: Sequence[Point]) -> None:
        """Draw on through all points since the last call; everything follows."""
        document = self._document
        if document is None or not document.session.stroking:
            return
        regions, self._start_regions = [*self._start_regions], ()
        for point in points:
            regions += document.session.extend(*point)
        if regions:
            self._changed(tuple(regions))

    def lift(self, points: Sequence[Point] = ()) -> None:
        """End the stroke, after the last points; it can be undone from now on."""
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
        """Give up the stroke under way; returns whether there was one."""
        document = self._document
        if document is None or not document.session.stroking:
            return False
        document.session.abort()
        self._changed(None)
        return True

    def dab(self, x: float, y: float) -> None:
        """Paint one dab of the brush, canvas pixels."""
        self.press((x, y, 1.0))
        self.lift()

    def clear(self) -> None:
        """Take all strokes away; can be undone."""
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
        """Take back what was last done, wherever that was."""
        self._services.undo.undo()

    def redo(self) -> None:
        """Do the last undone step again."""
        self._services.undo.redo()

    def back(self) -> None:
        """Give up the stroke under way, else go back to the gallery."""
        if not self.give_up():
            self._services.model.update(painting=None)

    def measure(self) -> None:
        """Go to where light is measured."""
        self._services.model.update(step=Step.PROBE, painting=None)

    # -- what is shown -------------------------------------------------------------------------

    def resolve(self) -> PaintState:
        """Work out what the screen shows now, apart from the canvas."""
        document, model, undo = self._document, self._services.model, self._services.undo
        state = PaintState(
            brush=self.tools.brush, mode=self._mode, undo=undo.undo_words, redo=undo.redo_words
        )
        if document is None or self._answer is None:
            words = tr("Loading the head…") if model.head is None else tr("Opening…")
            return replace(state, notice=words, save_why=words, live=LiveState(sentence=words))
        why = save_why(self._answer.advice, document)
        return replace(
            state,
            title=document.title,
            status=status_of(document),
            head=document.turned or document.look,
            picture=self._picture(document, self._answer),
            starts=starts_of(document, model.user_styles),
            start=document.start,
            can_clear=document.session.canvas.touched,
            save_words=save_words(document),
            save_why=why,
            saving=self.files.saving,
            live=self._live,
        )

    @property
    def canvas(self) -> Canvas | None:
        """What is painted, with the stroke under way."""
        return None if self._document is None else self._document.session.canvas

    @property
    def save_works(self) -> bool:
        """Whether what is painted can be saved now."""
        document, answer = self._document, self._answer
        if document is None or answer is None or self.files.saving:
            return False
        return not save_why(answer.advice, document)

    def _picture(self, document: PaintDocument, answer: Answer) -> Bytes | None:
        if self._mode is CanvasMode.WEIGHTS:
            return None
        model, linear = self._services.model, answer.picture
        own = document.own_answer(model)
        if own is not None and model.light is not None:
            facing = wrap(own.nose_deg + model.front_deg)
            linear = picture_at(document.head.transport, model.light, facing)
        if self._mode is CanvasMode.TARGET or linear is None:
            linear, _ = document.target()
        return head_picture(linear, document.look.coverage)

    def _changed(self, regions: tuple[Region, ...] | None) -> None:
        """Show a canvas that changed, and what it comes to."""
        self._show_canvas(regions)
        self._look()
        self._refresh()

    def _look(self) -> None:
        """Work out what the canvas comes to."""
        document = self._document
        if document is None:
            return
        self._answer = document.session.answer()
        model, trouble = self._services.model, self._light.trouble
        self._live = live_state(document, self._answer, model, self._size, trouble)
        here = picture_here(document, self._answer, model, self._size)
        if here and document.head.may_be_full_at(self._size) and not document.session.stroking:
            done = partial(self._enlarge, self._live)
            self._services.runner.submit(_LARGER_JOB, lambda *_: here(quick=False), done=done)

    def _look_soon(self) -> None:
        """Work out what the canvas comes to after the present event: the hand does not wait."""

        def done(_: None) -> None:
            self._look()
            self._refresh()

        self._services.runner.submit(_LOOK_JOB, lambda *_: None, done=done)

    def _enlarge(self, live: LiveState, picture: Bytes) -> None:
        """Show the picture at full size, now that the hand rests."""
        if self._live is live:
            self._live = replace(live, picture=picture)
            self._refresh()

    def _show_canvas(self, regions: tuple[Region, ...] | None) -> None:
        if self._view is not None and self._document is not None:
            self._view.canvas_changed(self._document.session.canvas, regions)

    # -- undo ----------------------------------------------------------------------------------

    def _done(self, document: PaintDocument, change: TileChange, words: str) -> None:
        """Note a change of the canvas for undo, and for the draft."""
        self._documents[document.key] = document
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
            # Another head has another canvas.
            self._services.notify.tell(tr("This stroke belongs to another head."), kind="warning")
            return
        self._show_canvas(regions)
        self._look_soon()
        self._refresh()
        self._keeper.keep(document.path, document.draft())

    def _bring(self, document: PaintDocument) -> None:
        """Put an easel to the front, wherever the user is."""
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
            self._look()
            self._refresh()

    def _sync(self, renew: bool = False) -> None:
        """Bring the easel in line with the model."""
        model = self._services.model
        key, head = model.painting, model.head
        if key is None or head is None:
            self._refresh()
            return
        document = self._document
        if document is None or document.key != key:
            self._open(key)
            return
        self._opening = None
        table = self._light.table()
        if renew or document.head is not head:
            self.give_up()
            document.renew(head, table, model.settings, model.front_deg)
            self._show_canvas(None)
        else:
            document.session.set_light(table, model.front_deg)
        self._look()
        self._refresh()

    def _open(self, key: str) -> None:
        if self._opening == key:
            return
        self._put_away()
        self._document = self._answer = None
        document = self._documents.get(key)
        # One that was saved under a name of its own is no longer what the first one led to.
        if document is not None and document.key == key:
            self._take(document)
            self._sync(renew=True)
            return
        self._opening = key
        model, folder = self._services.model, self._services.folders.drafts
        head, own = model.head, model.user_styles
        assert head is not None
        self._refresh()
        self._services.runner.submit(
            _OPEN_JOB, lambda token, report: open_canvas(folder, key, head, own), done=self._opened
        )

    def _opened(self, opened: OpenedCanvas) -> None:
        model = self._services.model
        self._opening = None
        if model.painting != opened.key or model.head is None:
            return
        self._keeper.opened(opened.path, opened.version)
        document = PaintDocument(opened, model.head, None, model.settings, model.front_deg)
        self._take(document)
        self._sync()
        tell = self._services.notify.tell
        for note in opened.notes:
            tell(note, kind="warning")
        if opened.restored and document.unsaved:
            tell(
                tr("Your draft of {title} is back.", title=document.title),
                actions=((tr("Start afresh"), self.clear),),
            )

    def _take(self, document: PaintDocument) -> None:
        self._document = document
        self._documents[document.key] = document
        self._opening = None
        self.files.take(document)
        self._look()
        self._show_canvas(None)
        self._refresh()

    def _put_away(self, quiet: bool = False) -> None:
        """End the stroke, write the draft, and say that it is kept."""
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

    # -- the style that is painted on leaves, comes back, or has another name ------------------

    def _style_leaves(self, name: str) -> None:
        document = self._document
        if document is not None and document.key == name:
            self.lift()
        self._keeper.flush()

    def _style_gone(self, name: str) -> None:
        """Leave a canvas whose style was put away; its draft went with it."""
        if self._document is not None and self._document.key == name:
            self._document = self._answer = None
        if self._services.model.painting == name:
            self._services.model.update(painting=None)

    def _style_back(self, former: str, style: UserStyle) -> None:
        document = self._documents.pop(former, None)
        if document is not None:
            path, _, _ = find_draft(self._services.folders.drafts, style.name)
            document.saved_as(style, path)
            self._documents[style.name] = document

    def _style_renamed(self, style: UserStyle) -> None:
        document = self._documents.get(style.name)
        if document is not None:
            document.saved_as(style, document.path)
            # What is unsaved bears the style's title, too.
            self._keeper.keep(document.path, document.draft())
            self._refresh()
            return
        self._keeper.flush()
        path, draft, _ = find_draft(self._services.folders.drafts, style.name)
        if draft is not None:
            self._keeper.keep(path, replace(draft, title=style.title))

    def _files_changed(self) -> None:
        """Show what saving, naming or deleting changed."""
        document = self._document
        if document is not None:
            self._documents[document.key] = document
        self._refresh()
