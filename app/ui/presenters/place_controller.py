"""The controller that opens, changes, solves and saves places."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from app.core.base.angles import wrap
from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token
from app.core.environment.layers import LayerError
from app.core.measure.film.film import Film
from app.core.measure.film.measure import FilmOptions
from app.core.painting.user_styles import list_user_styles
from app.core.places.intake import Intake
from app.core.places.load_saved import NotFinished, last_opened, load_place
from app.core.places.open_files import OpenOptions, make_place, open_paths
from app.core.places.place import OpenPlace
from app.core.places.resume import UnfinishedPlace, finish_files
from app.core.portrait.head import with_lamps
from app.core.solver.lens.lens_wish import LensWish
from app.core.styles.lamps import Studio
from app.core.text import tr
from app.ui.presenters.file_changes import OwnStyles, SerialQueue
from app.ui.presenters.heads import HeadChoice
from app.ui.presenters.saving import Saving
from app.ui.presenters.services import Services, T
from app.ui.presenters.solving import SELECTION_FIELDS, Solving
from app.ui.presenters.undo_stack import Undoable
from app.ui.presenters.window_model import DEMO_SPOT, Event, Step
from app.words.remarks import remark_words

if TYPE_CHECKING:
    from app.devices.capture.place_capture import CapturedPlace

_DEMO: Final = tr("Demo café by the courtyard")
_SAVED_FIELDS: Final = frozenset(
    {"results", "front_deg", "chosen", "needle_deg", "goal_deg", "head", "place"}
)


class PlaceController:
    """Opens, solves and saves places.

    Attributes:
        photo_taker: Callable, or None if the current screen has no use for photos of the sitter. It
            is offered files that may be such photos, and returns whether it accepted them.
        layer_asker: Callable that asks the user which of `layers` to read, or None.
        layers: Layers of the panorama for which the user still has to choose one.
    """

    def __init__(self, services: Services) -> None:
        self._services = services
        self._arrivals = SerialQueue(services, "open-arrived")
        self.file_work = SerialQueue(services, "files")
        self.saving = Saving(services, self.file_work)
        self._solving = Solving(services)
        self.heads = HeadChoice(services, self._solving)
        self.own_styles = OwnStyles(services, self.file_work)
        self.places_changed = Event()
        self.photo_taker: Callable[[Sequence[Path]], bool] | None = None
        self.finisher: Callable[[UnfinishedPlace], None] | None = None
        self.layer_asker: Callable[[], None] | None = None
        self.layers: tuple[str, ...] = ()
        self._layered: tuple[Path, ...] = ()
        services.model.changed.connect(self._model_changed)

    # -- start and end -------------------------------------------------------------------------

    def begin(self, *, reopen: bool = False) -> None:
        """Load the selected head and the user's own styles.

        If `reopen` is true, the last place is also opened again.
        """
        self.heads.load(self._services.model.settings.head)
        self.refresh_user_styles()
        if reopen:
            self._reopen()

    def _reopen(self) -> None:
        services = self._services
        last, places = services.model.settings.last_place, services.folders.places
        unkept = self.saving.unkept

        def work(token: Token, report: Report) -> OpenPlace | None:
            folder = last_opened(last, places)
            return None if folder is None else load_place(folder, unkept(folder))

        services.model.update(opening=tr("the last place"))
        services.runner.submit(
            "open", work, done=self._reopened, failed=self._open_failed, cancelled=self._no_longer
        )

    def _reopened(self, new_place: OpenPlace | None) -> None:
        if new_place is None:
            self._no_longer()
            return
        # The user may have moved to another step in the meantime, so stay on that step.
        self._opened(new_place, self._services.model.step)

    def keep_all(self) -> bool:
        """Save everything that is not on disk yet, and return whether this succeeded."""
        return self.saving.keep_all()

    def refresh_user_styles(self) -> None:
        """Reload the user's own styles."""
        folder = self._services.folders.styles
        self._services.runner.submit(
            "user-styles",
            lambda *_: list_user_styles(folder),
            done=lambda styles: self._services.model.update(
                user_styles=styles[0], damaged_styles=styles[1]
            ),
        )

    # -- places --------------------------------------------------------------------------------

    def open_paths(self, paths: Sequence[Path]) -> None:
        """Open a place, a panorama, a bracket, or a folder that contains one of these.

        If the current screen accepts photos of the sitter, any such photos are checked instead of
        being opened.
        """
        if self.photo_taker is None or not self.photo_taker(paths):
            self.open_as_place(paths)

    def open_as_place(self, paths: Sequence[Path]) -> None:
        """Open a place, or create one from a panorama or a bracket."""
        self._layered = tuple(paths)
        self._open(*self._reading(paths))

    def choose_layer(self, layer: str) -> None:
        """Open one layer of the panorama for which a layer still had to be chosen."""
        self._open(*self._reading(self._layered, layer=layer))

    def _open(
        self, work: Callable[[Token, Report], OpenPlace], name: str, step: str = Step.PROBE
    ) -> None:
        self._services.model.update(opening=name)
        self._services.runner.submit(
            "open",
            work,
            title=tr("Opening {name}", name=name),
            done=lambda opened: self._opened(opened, step),
            failed=self._open_failed,
            cancelled=self._no_longer,
        )

    def _no_longer(self) -> None:
        # A newer job may have replaced the one that has ended.
        if not self._services.runner.running("open"):
            self._services.model.update(opening="")

    def _open_failed(self, error: Exception) -> None:
        self._no_longer()
        actions = []
        if isinstance(error, NotFinished):
            unfinished = error.unfinished
            actions.append((tr("Finish it"), lambda: self.finish(unfinished)))
        if isinstance(error, LayerError) and self.layer_asker is not None:
            self.layers = error.layers
            self.layer_asker()
            return
        self._services.notify.tell_error(error, actions=actions, about="open")

    def finish(self, unfinished: UnfinishedPlace) -> None:
        """Finish a place, either by merging the available photos or by resuming its capture."""
        if unfinished.session is not None:
            if self.finisher is not None:
                self._services.model.update(step=Step.PROBE)
                self.finisher(unfinished)
            return
        settings = self._services.model.settings
        self._open(
            lambda token, report: finish_files(unfinished, settings, token, report), unfinished.name
        )

    def take_in(self, paths: Sequence[Path]) -> None:
        """Open a bracket from a watched folder, after any brackets that arrived earlier."""
        work, name = self._reading(paths, way="camera")
        title = tr("Opening {name}", name=name)
        self._arrivals.submit(work, title=title, done=self._opened, failed=self._open_failed)

    def open_demo(self) -> None:
        """Create a place from the panorama of the demo location, without a camera."""
        read, name = self._reading([self._services.folders.demo / "probe.exr"], _DEMO)

        def work(token: Token, report: Report) -> OpenPlace:
            opened = read(token, report)
            return replace(opened, place=replace(opened.place, spot=DEMO_SPOT))

        self._open(work, name)

    def open_film(self, film: Film, video: Path, folder: TemporaryDirectory[str]) -> None:
        """Create a place from a new video, then remove the temporary `folder` that contains it."""
        own, options = FilmOptions(film), self._options()
        intake = Intake(tr("Filmed turn"), files=(video,), way="film", own=own)

        def work(token: Token, report: Report) -> OpenPlace:
            with folder:
                return make_place(intake, options, token, report)

        self._open(work, intake.name)

    def open_place(self, folder: Path, style: str = "", step: str = "") -> None:
        """Open a saved place, optionally with a style selected and on a given screen."""
        model = self._services.model
        fields: dict[str, Any] = {"chosen": style, "needle_deg": None, "goal_deg": None}
        if style and folder == model.place_folder:
            model.update(step=Step.STYLES, painting=None, **fields)
            return

        def work(token: Token, report: Report) -> OpenPlace:
            opened = load_place(folder, self.saving.unkept(folder))
            return replace(opened, place=replace(opened.place, **fields)) if style else opened

        self._open(work, tr("the place"), step or (Step.STYLES if style else Step.PROBE))

    def take_capture(self, capture: CapturedPlace) -> None:
        """Show a capture immediately, and save it in the background."""
        settings = self._services.model.settings
        place = replace(capture.place, head=settings.head, studios=settings.studios)
        new_place = OpenPlace(capture.folder, place, capture.light)
        self._opened(new_place)
        self.saving.store(new_place)

    def close(self) -> None:
        """Save and close the open place."""
        self.saving.keep_now()
        self._services.undo.forget_places()
        self._services.model.update(
            place_folder=None,
            place=None,
            light=None,
            unkept="",
            front_deg=0.0,
            results=(),
            chosen=None,
            needle_deg=None,
            goal_deg=None,
            painting=None,
        )

    def choose_lamps(self, studio: Studio | None, style: str = "") -> None:
        """Light the targets of the open place with different lamps. The user can undo this.

        Args:
            studio: The lamps, or None to return to the common lamps.
            style: The style to change together with its mirror image, or an empty string to change
                all styles.
        """
        model = self._services.model
        if model.place is not None:
            studios = with_lamps(model.studios, studio, style)
            self.change(tr("change the lamps"), studios=studios)

    def choose_lens(self, lens: LensWish) -> None:
        """Set the permitted camera positions. The user can undo this."""
        if self._services.model.place is not None:
            self.change(tr("change the camera position"), lens=lens)

    def prepare_lamps(self, choices: Sequence[Studio], style: str = "") -> None:
        """Render the targets for lamps that may be selected next."""
        head, studios = self._services.model.head, self._services.model.studios
        if head is None:
            return

        def work(token: Token, report: Report) -> None:
            for studio in choices:
                token.check()
                head.pack_in(with_lamps(studios, studio, style))

        self._services.runner.submit("lamps", work)

    def change(self, words: str, **changes: Any) -> None:
        """Change the open place. The user can undo this."""
        model = self._services.model
        before = {name: getattr(model.place, name) for name in changes}
        if before == changes:
            return

        def call(values: dict[str, Any]) -> None:
            if model.place is not None:
                model.update(place=replace(model.place, **values))

        self._do(words, call, before, changes, len(str(changes)))

    def _do(
        self, words: str, call: Callable[[T], None], before: T, after: T, size: int = 64
    ) -> None:
        call(after)
        place = self._services.model.place_folder
        step = Undoable(words, lambda: call(before), lambda: call(after), size, place)
        self._services.undo.push(step)

    # -- front of the place --------------------------------------------------------------------

    def move_front(self, front_deg: float) -> None:
        """Move the photographer to another azimuth. The user can undo this.

        The direction of the goal in the place does not change.

        Args:
            front_deg: Azimuth in the panorama file, in degrees.
        """
        model = self._services.model
        before, after = model.front_deg, wrap(front_deg)
        if before == after:
            return

        def move(by: float) -> None:
            turn = wrap(by - model.front_deg)
            model.update(
                front_deg=by,
                needle_deg=_shift_turn(model.needle_deg, turn),
                goal_deg=_shift_turn(model.goal_deg, turn),
            )

        self._do(tr("move the marker"), move, before, after)

    # -- opening and solving -------------------------------------------------------------------

    def _reading(
        self, paths: Sequence[Path], name: str = "", way: str = "", layer: str = ""
    ) -> tuple[Callable[[Token, Report], OpenPlace], str]:
        """Return a job that opens files, and the name to show while the job runs.

        Args:
            way: How the photos were taken, or an empty string to use the setting.
            layer: Layer to read from a panorama that has several.
        """
        files, unkept = tuple(paths), self.saving.unkept
        options = self._options(name=name, way=way, layer=layer)

        def work(token: Token, report: Report) -> OpenPlace:
            return open_paths(files, options, token, report, unkept)

        return work, name or (files[0].name if files else "")

    def _options(self, **more: str) -> OpenOptions:
        """Return the current options for opening files, plus any that are given."""
        services = self._services
        settings, now = services.model.settings, services.today()
        return OpenOptions(services.folders.places, now, settings, **more)

    def _opened(self, new_place: OpenPlace, step: str = Step.PROBE) -> None:
        if new_place.folder is not None and not new_place.folder.is_dir():
            # The place was deleted while it was being read.
            self._no_longer()
            return
        self.saving.keep_now()
        place, notify = new_place.place, self._services.notify
        self._services.undo.forget_places()
        self._solving.forget()
        self.heads.load_for_place(place.head)
        for about in ("open", "keep"):
            notify.mended(about)
        self._services.model.update(
            opening="",
            unkept="",
            place_folder=new_place.folder,
            place=place,
            light=new_place.light,
            front_deg=place.front_deg,
            results=place.results,
            answered=None,
            chosen=place.chosen,
            needle_deg=place.needle_deg,
            goal_deg=place.goal_deg,
            painting=None,
            step=step,
        )
        for remark in place.remarks:
            notify.tell(remark_words(remark), kind="warning")
        self._remember(new_place.folder)
        self.saving.hold(new_place)

    def _remember(self, folder: Path | None) -> None:
        """Remember which place to reopen when the app next starts."""
        model, last = self._services.model, "" if folder is None else str(folder)
        if last and last != model.settings.last_place:
            with suppress(CoreError):
                model.set("last_place", last)

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & SELECTION_FIELDS:
            self._solving.solve()
        if "settings" in names:
            self.heads.follow_looks()
        if names & _SAVED_FIELDS and "place_folder" not in names:
            self.saving.keep()


def _shift_turn(turn_deg: float | None, by_deg: float) -> float | None:
    return None if turn_deg is None else wrap(turn_deg - by_deg)
