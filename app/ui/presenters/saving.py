"""Saves the open place after a short delay, at once, or in another folder if saving fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.core.base.atomic_files import DiskTrouble, disk_trouble, is_full
from app.core.base.errors import CoreError
from app.core.places.place import AnswerBasis, OpenPlace, Place, PlaceError
from app.core.places.place_folder import read_place, write_place
from app.core.places.save import (
    FolderState,
    folder_state,
    original_files,
    save_again,
    save_anywhere,
    save_new_place,
    save_place,
    with_light_of,
)
from app.core.portrait.ratio_and_glare import light_flow
from app.core.text import tr
from app.ui.presenters.autosave import Autosave, Conflicts
from app.ui.presenters.file_changes import SerialQueue
from app.ui.presenters.services import Services


def disk_words(error: BaseException) -> str:
    """Return the cause of a disk error, such as "the disk is full", or "" for other errors."""
    trouble = disk_trouble(error)
    return "" if trouble is None else TROUBLE_WORDS[trouble]


TROUBLE_WORDS: Final = {
    DiskTrouble.FULL: tr("the disk is full"),
    DiskTrouble.LOCKED: tr("its folder is write-protected"),
}


def _folder_words(state: FolderState, folder: Path) -> str:
    return {
        FolderState.THERE: "",
        FolderState.GONE: tr("its folder was deleted or moved"),
        FolderState.UNPLUGGED: tr("{folder} cannot be found", folder=folder.parent),
        FolderState.CLOSED: tr("its folder is write-protected"),
    }[state]


_ABOUT: Final = "keep"

_LOOK: Final = "place-folder"


class Saving:
    """Saves the open place, and reports an error if saving fails.

    Attributes:
        folder_asker: Asks the user for a folder and returns it, or returns None if the user
            cancels.
    """

    def __init__(self, services: Services, file_work: SerialQueue) -> None:
        self._services = services
        self._file_work = file_work
        self._keeper = Autosave(services, self._after_write, self._not_written)
        self._conflicting: set[Path] = set()
        self._away = False
        self._storing: dict[Path, OpenPlace] = {}
        self._files: tuple[Path, ...] = ()
        self.folder_asker: Callable[[str], Path | None] = lambda title: None

    # -- changes of a place --------------------------------------------------------------------

    def unkept(self, folder: Path) -> Place | None:
        """Return the unsaved state of a place, or None if everything is already on disk."""
        return self._keeper.unkept(folder)

    def keep(self) -> None:
        """Write the open place after a short delay."""
        current = self._current()
        if current is not None:
            self._keeper.keep(*current)

    def keep_now(self) -> bool:
        """Write the open place immediately, and return whether this succeeded."""
        current = self._current()
        if current is None:
            return True
        try:
            conflicts = self._keeper.keep_now(*current)
        except (CoreError, OSError) as error:
            self._not_written(error)
            return False
        self._after_write(conflicts)
        return True

    def keep_all(self) -> bool:
        """Write everything that is not on disk yet, and return whether this succeeded."""
        model = self._services.model
        folder, place, light = model.place_folder, self._now(), model.light
        waiting = dict(self._storing)
        if folder is not None and place is not None and light is not None and not place.environment:
            waiting[folder] = self._storing[folder] = OpenPlace(folder, place, light)
        try:
            for place_to_save in waiting.values():
                self._stored(save_place(place_to_save, open_since=True))
        except (CoreError, OSError) as error:
            self._not_kept(error)
            return False
        return self.keep_now() and not (folder is None and light is not None)

    # -- a new light ---------------------------------------------------------------------------

    def store(self, place_to_save: OpenPlace) -> None:
        """Save the newly measured light of a place that is already open."""
        assert place_to_save.folder is not None
        folder = place_to_save.folder
        self._storing[folder] = place_to_save

        def failed(error: Exception) -> None:
            self._storing.pop(folder, None)
            self._not_kept(error)

        # Do not show the progress, because nobody waits for this job and it cannot be stopped.
        self._file_work.submit(
            lambda *_: save_place(place_to_save, open_since=True), done=self._stored, failed=failed
        )

    def _stored(self, open_place: OpenPlace) -> None:
        folder, model = open_place.folder, self._services.model
        if folder is None or self._storing.pop(folder, None) is None:
            return
        if model.place_folder == folder and model.place is not None:
            model.update(place=with_light_of(model.place, open_place.place))
            self._note_saved()
            return

        # The place was saved again when another one was opened, so update only its light.
        self._file_work.submit(
            lambda *_: write_place(folder, with_light_of(read_place(folder), open_place.place))
        )

    # -- another folder ------------------------------------------------------------------------

    def hold(self, place_to_save: OpenPlace) -> None:
        """Remember the files of a newly opened place, and report any error in saving the place."""
        self._files = place_to_save.files
        if place_to_save.trouble is not None:
            self._not_kept(place_to_save.trouble)

    def ask_elsewhere(self) -> None:
        """Ask the user for another folder, and save the open place there."""
        root = self.folder_asker(tr("Choose a folder to save the place in"))
        if root is not None:
            self.save_in(root)

    def save_in(self, root: Path) -> None:
        """Save the open place in a new folder inside `root`."""
        model = self._services.model
        place, light, before = self._now(), model.light, model.place_folder
        if place is None or light is None:
            return
        files = self._files or original_files(before)

        def done(open_place: OpenPlace) -> None:
            if model.light is not light or model.place is None or open_place.folder is None:
                return
            self._files = ()
            if before is not None:
                self._keeper.forget(before)
            model.update(
                place_folder=open_place.folder,
                place=replace(
                    with_light_of(model.place, open_place.place), source=open_place.place.source
                ),
            )
            self._note_saved()
            self.keep()
            self._services.notify.tell(
                tr("Saved in {folder}.", folder=open_place.folder), kind="done"
            )

        self._file_work.submit(
            lambda token, report: save_new_place(root, place, light, files, token),
            done=done,
            failed=self._not_kept,
        )

    def look(self) -> None:
        """Check that the open place's folder still exists, and show an error if it does not."""
        folder, runner = self._services.model.place_folder, self._services.runner
        # A missing drive may never respond, so run only one check at a time.
        if folder is None or folder in self._storing or runner.running(_LOOK):
            return

        def done(where: FolderState) -> None:
            if folder != self._services.model.place_folder or folder in self._storing:
                return
            if where is FolderState.THERE and self._away:
                self.keep()
            elif where is not FolderState.THERE and not self._services.model.unkept:
                words = _folder_words(where, folder)
                self._not_kept(PlaceError(f"{words[:1].upper()}{words[1:]}."))
            self._away = where is not FolderState.THERE

        runner.submit(_LOOK, lambda *_: folder_state(folder), done=done, failed=self._not_kept)

    def rescue(self) -> bool:
        """Save the open place in any folder that works, and return whether this succeeded."""
        model, places = self._services.model, self._services.folders.places
        folder, place, light = model.place_folder, self._now(), model.light
        if place is None or light is None:
            return True
        try:
            save_anywhere(OpenPlace(folder, place, light, self._files), places)
        except (CoreError, OSError):
            return False
        return True

    def _again(self) -> None:
        """Try again to save the place in its own folder."""
        model = self._services.model
        folder, place, light = model.place_folder, self._now(), model.light
        if folder is None:
            self.save_in(self._services.folders.places)
        elif place is not None and light is not None and (folder_state(folder) is FolderState.GONE):
            place_to_save = self._storing[folder] = OpenPlace(folder, place, light)

            def failed(error: Exception) -> None:
                self._storing.pop(folder, None)
                self._not_kept(error)

            self._file_work.submit(
                lambda *_: save_again(place_to_save), done=self._stored, failed=failed
            )
        elif place is not None and light is not None and not place.environment:
            self.store(OpenPlace(folder, place, light))
        else:
            self.keep()

    def _after_write(self, conflicts: Conflicts) -> None:
        self._note_saved()
        for name, other in conflicts:
            folder = other.parent
            if folder in self._conflicting:
                continue
            self._conflicting.add(folder)
            self._services.notify.tell(
                tr(
                    "“{name}” was also changed in another window. Both versions are saved: the "
                    "other one is {file} in the same folder.",
                    name=name,
                    file=other.name,
                ),
                kind="warning",
                stay=True,
            )

    def _note_saved(self) -> None:
        model = self._services.model
        if model.place_folder is None or model.place is None or not model.place.environment:
            return
        self._services.model.update(unkept="")
        self._services.notify.mended(_ABOUT)

    def _not_written(self, error: Exception) -> None:
        folder = self._services.model.place_folder
        if folder is not None and self._keeper.unkept(folder) is None:
            # The error belongs to a previous place and was already reported.
            self._note_saved()
        else:
            self._not_kept(error)

    def _not_kept(self, error: Exception) -> None:
        """Report once that the place is not saved, with buttons for solving the problem."""
        model = self._services.model
        name = model.place.name if model.place is not None else tr("place")
        folder = model.place_folder
        where = FolderState.THERE if folder is None else folder_state(folder)
        why = disk_words(error)
        if folder is not None and where in (FolderState.GONE, FolderState.UNPLUGGED):
            why = _folder_words(where, folder)
        self._away = where is not FolderState.THERE
        model.update(unkept=why or tr("the last attempt failed"))
        new = model.place_folder is None or not (model.place and model.place.environment)
        mend = str(error)
        if why:
            what = tr("The last changes to “{name}” are not saved: {why}.", name=name, why=why)
            if new:
                what = tr("“{name}” is not saved: {why}.", name=name, why=why)
            mend = tr("Save it elsewhere.")
            if where is FolderState.GONE:
                what = tr("“{name}” is open but not on the disk: {why}.", name=name, why=why)
                mend = tr("Save it again, or save it elsewhere.")
            elif where is FolderState.UNPLUGGED:
                what = tr("“{name}” is open but not on the disk: {why}.", name=name, why=why)
                mend = tr("Connect the disk and try again, or save it elsewhere.")
            elif is_full(error):
                mend = tr("Free some space and try again, or save it elsewhere.")
        elif new:
            what = tr("“{name}” is not saved.", name=name)
        else:
            what = tr("The last changes to “{name}” are not saved.", name=name)
        self._services.notify.tell(
            f"{what} {mend}",
            kind="error",
            actions=[
                (tr("Save elsewhere…"), self.ask_elsewhere),
                (tr("Save again") if where is FolderState.GONE else tr("Try again"), self._again),
            ],
            about=_ABOUT,
        )

    # -- current data --------------------------------------------------------------------------

    def _current(self) -> tuple[Path, Place] | None:
        folder, place = self._services.model.place_folder, self._now()
        return None if folder is None or place is None else (folder, place)

    def _now(self) -> Place | None:
        """Return the open place, updated with the selected head and the current answers."""
        model = self._services.model
        if model.place is None or model.head is None:
            return None
        answered = model.answered
        basis = model.place.asked
        if answered is not None:
            basis = AnswerBasis(
                answered.head.name if answered.head is not None else model.head.name,
                answered.objective,
            )
        return replace(
            model.place,
            front_deg=model.front_deg,
            head=model.head_name,
            asked=basis,
            results=model.results,
            flow=model.place.flow
            if model.light is None
            else light_flow(model.light.searched, model.front_deg),
            chosen=model.chosen,
            needle_deg=model.needle_deg,
            # The lamp is not saved, and without it the goal would be wrong.
            goal_deg=model.goal_deg if model.lamp_plan is None else None,
        )
