"""The open place: how its light comes in, who is lit by it, what comes out, and that it is kept."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from app.core.angles import wrap
from app.core.errors import CoreError
from app.core.pack import load_named_pack, load_transport_of, pack_names
from app.core.painting import list_user_styles, solve_user_styles
from app.core.places import Asked, Place, read_place
from app.core.sheet.words import head_words
from app.core.solve import Objective, solve_all
from app.ui.presenters.in_turn import InTurn
from app.ui.presenters.intake import sort_out
from app.ui.presenters.keeping import Keeper
from app.ui.presenters.measuring import capture_facts, location_of, merged_light
from app.ui.presenters.model import Head, Step
from app.ui.presenters.opening import Opened, kept_anew, read_kept, take_anew
from app.ui.presenters.undo import Undoable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from app.core.light_here import LightHere
    from app.core.painting import UserStyle
    from app.core.progress import Report, Token
    from app.core.settings import Settings
    from app.core.solve import StyleResult
    from app.devices.capture.machine import CaptureResult
    from app.ui.presenters.services import Services

__all__ = ["Desk"]

_SOLVED_ANEW: Final = frozenset({"light", "head", "front_deg", "user_styles", "settings"})
_DEMO: Final = "Demo café at the court"
_KEPT: Final = frozenset(
    {"results", "front_deg", "chosen", "needle_deg", "goal_deg", "head", "place"}
)
_FALLBACK_HEAD: Final = "generic"


class Desk:
    """Opens places, has them solved, and keeps them.

    Parameters
    ----------
    services : Services
        The window's.

    Attributes
    ----------
    file_work : InTurn
        For whatever changes the user's files, on any screen.
    photo_taker : callable or None
        Takes files that may be photographs of the sitter, while a screen in front has a use for
        them; gives whether it did.
    """

    def __init__(self, services: Services) -> None:
        self._services = services
        self._asked: tuple[object, ...] = ()
        self._keeper = Keeper(services)
        self._arrivals = InTurn(services, "open-arrived")
        self.file_work = InTurn(services, "files")
        self.photo_taker: Callable[[Sequence[Path]], bool] | None = None
        services.model.changed.connect(self._model_changed)

    # -- start and end -------------------------------------------------------------------------

    def begin(self) -> None:
        """Load the head that is set and the user's own styles."""
        self.load_head(self._services.model.settings.head)
        self.refresh_user_styles()

    def keep_all(self) -> bool:
        """Write what is not yet on the disk, before going on.

        Returns
        -------
        bool
            Whether all of it is kept; why not has been told.
        """
        return self._keep_now()

    # -- who is lit ----------------------------------------------------------------------------

    def heads(self) -> tuple[tuple[str, str], ...]:
        """Name and title of every head there is."""
        return tuple((name, _title(name)) for name in pack_names())

    def load_head(self, name: str) -> None:
        """Light another head.

        Parameters
        ----------
        name : str
            Of `heads`; one that is gone gives way to the generic one.
        """
        known = pack_names()
        wanted = name if name in known or name.endswith(".npz") else _FALLBACK_HEAD
        self._services.runner.submit(
            "head",
            lambda token, report: _load_head(wanted),
            done=lambda head: self._services.model.update(head=head),
            failed=self._head_failed,
        )

    def _head_failed(self, error: Exception) -> None:
        self._services.notify.tell_error(error)
        # With the head that there is.
        self._solve()

    def refresh_user_styles(self) -> None:
        """Read the user's own styles again."""
        folder = self._services.folders.styles
        self._services.runner.submit(
            "user-styles",
            lambda token, report: list_user_styles(folder),
            done=lambda found: self._services.model.update(
                user_styles=found[0], damaged_styles=found[1]
            ),
        )

    # -- places --------------------------------------------------------------------------------

    def open_paths(self, paths: Sequence[Path]) -> None:
        """Open whatever it is: a place, a panorama, a bracket, or a folder with one of these.

        While the sitter turns, a photograph of them is looked at instead.

        Parameters
        ----------
        paths : sequence of Path
            As dropped or chosen.
        """
        if self.photo_taker is None or not self.photo_taker(paths):
            self.open_as_place(paths)

    def open_as_place(self, paths: Sequence[Path]) -> None:
        """Open a place, or make one of a panorama or a bracket.

        Parameters
        ----------
        paths : sequence of Path
            Nothing that a screen has another use for.
        """
        work, title = self._reading(paths)
        self._services.runner.submit("open", work, title=title, done=self._opened)

    def take_in(self, paths: Sequence[Path]) -> None:
        """Open what has arrived by itself; the next that arrives waits until this is done.

        Parameters
        ----------
        paths : sequence of Path
            As for `open_paths`.
        """
        work, title = self._reading(paths)
        self._arrivals.submit(work, title=title, done=self._opened)

    def open_demo(self) -> None:
        """Make a place of the demo location's panorama, without any camera."""
        work, title = self._reading([self._services.folders.demo / "probe-1.exr"], _DEMO)
        self._services.runner.submit("open", work, title=title, done=self._opened)

    def open_place(self, folder: Path) -> None:
        """Open a place that was kept.

        Parameters
        ----------
        folder : Path
            Of the place.
        """
        self._services.runner.submit(
            "open",
            lambda token, report: read_kept(folder, self._keeper.unkept(folder)),
            title="Opening the place",
            done=self._opened,
        )

    def take_capture(self, folder: Path, name: str, result: CaptureResult) -> None:
        """Make a place of what a camera measured; the originals are in its folder already.

        Parameters
        ----------
        folder : Path
            Of the capture's session.
        name : str
            Of the new place.
        result : CaptureResult
            What the capture gave.
        """
        now = self._services.today()
        head = self._services.model.settings.head

        def work(token: Token, report: Report) -> Opened:
            del token, report
            probe = result.probe
            light = merged_light(probe, name)
            place = replace(
                read_place(folder),
                measured_at=now,
                head=head,
                location=location_of(probe),
                capture=capture_facts(probe, result.profile.title, result.plan.kind),
            )
            return kept_anew(folder, place, light)

        # Nothing that is opened meanwhile takes its place: it would be measured, and not kept.
        self._arrivals.submit(work, title="Saving the place", done=self._opened)

    def close(self) -> None:
        """Keep the open place and put it away; none is open then."""
        self._keep_now()
        self._services.undo.clear()
        self._services.model.update(
            place_folder=None,
            place=None,
            light=None,
            front_deg=0.0,
            results=(),
            chosen=None,
            needle_deg=None,
            goal_deg=None,
            painting=None,
        )

    def rename(self, name: str) -> None:
        """Give the open place another name; can be undone."""
        model = self._services.model
        place = model.place
        if place is None or name == place.name:
            return
        before = place.name

        def call(text: str) -> None:
            if model.place is not None:
                model.update(place=replace(model.place, name=text))

        call(name)
        self._services.undo.push(
            Undoable("renaming", lambda: call(before), lambda: call(name), len(name))
        )

    def note(self, notes: str) -> None:
        """Keep the user's own words on the place."""
        place = self._services.model.place
        if place is not None and notes != place.notes:
            self._services.model.update(place=replace(place, notes=notes))

    # -- where the photographer stands ---------------------------------------------------------

    def move_front(self, front_deg: float) -> None:
        """Say that the photographer stands at another azimuth; can be undone.

        A goal that was set stays where it is in the place.

        Parameters
        ----------
        front_deg : float
            Azimuth in the panorama's file, deg.
        """
        model = self._services.model
        before, after = model.front_deg, wrap(front_deg)
        if before == after:
            return

        def move(by: float) -> None:
            turn = wrap(by - model.front_deg)
            model.update(
                front_deg=by,
                needle_deg=_moved(model.needle_deg, turn),
                goal_deg=_moved(model.goal_deg, turn),
            )

        move(after)
        self._services.undo.push(
            Undoable("move of the marker", lambda: move(before), lambda: move(after))
        )

    # -- opening and solving -------------------------------------------------------------------

    def _reading(
        self, paths: Sequence[Path], name: str = ""
    ) -> tuple[Callable[[Token, Report], Opened], str]:
        """Prepare to read what there is; give it with its title."""
        given, services = tuple(paths), self._services
        places, now = services.folders.places, services.today()
        head, unkept = services.model.settings.head, self._keeper.unkept

        def work(token: Token, report: Report) -> Opened:
            intake = sort_out(given)
            if name:
                intake = replace(intake, name=name)
            if intake.place is not None:
                return read_kept(intake.place, unkept(intake.place))
            return take_anew(intake, places, now, head, token, report)

        return work, f"Opening {name or (given[0].name if given else '')}"

    def _opened(self, opened: Opened) -> None:
        self._keep_now()
        place = opened.place
        self._services.undo.clear()
        self._asked = ()
        head = self._services.model.head
        if head is None or head.name != place.head:
            # Before the light is there: else it would be solved with the other head.
            self.load_head(place.head)
        self._services.model.update(
            place_folder=opened.folder,
            place=place,
            light=opened.light,
            front_deg=place.front_deg,
            results=place.results,
            chosen=place.chosen,
            needle_deg=place.needle_deg,
            goal_deg=place.goal_deg,
            painting=None,
            step=Step.PROBE,
        )
        for remark in place.remarks:
            self._services.notify.tell(remark, kind="warning")

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & _SOLVED_ANEW:
            self._solve()
        if names & _KEPT and "place_folder" not in names:
            self._keep()

    def _solve(self) -> None:
        model = self._services.model
        light, head, settings = model.light, model.head, model.settings
        if light is None or head is None:
            # What is being worked out is of a place that was closed.
            self._asked = ()
            self._services.runner.cancel("solve")
            return
        if self._services.runner.running("head"):
            # With the head that is on its way, as soon as it is there.
            return
        asked = (light, head, model.front_deg, model.user_styles, _solver_settings(settings))
        if self._asked[:2] == asked[:2] and self._asked[2:] == asked[2:]:
            return
        self._asked = asked
        styles, front = model.user_styles, model.front_deg
        self._services.runner.submit(
            "solve",
            lambda token, report: _solve_place(head, light, styles, settings, front),
            done=self._solved,
        )

    def _solved(self, results: tuple[StyleResult, ...]) -> None:
        model = self._services.model
        names = {result.name for result in results}
        if model.chosen in names:
            model.update(results=results)
        else:
            # Another style's goal is no goal for this one.
            model.update(results=results, chosen=_best(results), needle_deg=None, goal_deg=None)

    # -- keeping -------------------------------------------------------------------------------

    def _keep(self) -> None:
        kept = self._current()
        if kept is None:
            return
        folder, place = kept
        self._keeper.keep(folder, place)

    def _keep_now(self) -> bool:
        kept = self._current()
        if kept is None:
            return True
        try:
            self._keeper.keep_now(*kept)
        except (CoreError, OSError) as error:
            self._services.notify.tell_error(error)
            return False
        return True

    def _current(self) -> tuple[Path, Place] | None:
        model = self._services.model
        if model.place is None or model.place_folder is None or model.head is None:
            return None
        settings = model.settings
        place = replace(
            model.place,
            front_deg=model.front_deg,
            head=model.head.name,
            asked=Asked(
                model.head.name,
                "paper" if settings.objective == "paper" else "picture",
                settings.match_limit,
                settings.strength_limit,
            ),
            results=model.results,
            chosen=model.chosen,
            needle_deg=model.needle_deg,
            goal_deg=model.goal_deg,
        )
        return model.place_folder, place


def _load_head(name: str) -> Head:
    pack = load_named_pack(name)
    # Tables for the search are made with the first question; better here than with the screen.
    _ = pack.tables
    return Head(name, _title(name), pack, load_transport_of(pack, name))


def _title(name: str) -> str:
    # Shipped heads whose name says no tone have the medium one.
    return f"{head_words(name)}, medium skin" if name.isalpha() else head_words(name)


def _solve_place(
    head: Head,
    light: LightHere,
    styles: Sequence[UserStyle],
    settings: Settings,
    front_deg: float,
) -> tuple[StyleResult, ...]:
    objective: Objective = "paper" if settings.objective == "paper" else "picture"
    built_in = solve_all(
        head.pack,
        light.searched,
        objective,
        epsilon=settings.match_limit,
        min_strength=settings.strength_limit,
        front_deg=front_deg,
    )
    own = solve_user_styles(
        head.transport,
        styles,
        light.searched,
        objective,
        epsilon=settings.match_limit,
        min_strength=settings.strength_limit,
        front_deg=front_deg,
    )
    return (*built_in, *own)


def _solver_settings(settings: Settings) -> tuple[object, ...]:
    return (settings.objective, settings.match_limit, settings.strength_limit)


def _best(results: Sequence[StyleResult]) -> str | None:
    within = [result for result in results if result.attainable] or list(results)
    return max(within, key=lambda result: result.match).name if within else None


def _moved(turn_deg: float | None, by_deg: float) -> float | None:
    return None if turn_deg is None else wrap(turn_deg - by_deg)
