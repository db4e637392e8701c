"""The choice of the head that represents the sitter."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from app.core.base.errors import CoreError
from app.core.portrait.head import list_heads, load_head
from app.core.styles.style_pack_file import pack_names
from app.ui.presenters.services import Services
from app.ui.presenters.solving import Solving
from app.words.portrait.heads import head_title

_FALLBACK: Final = "generic"
_FOLDER: Final = "heads"


class HeadChoice:
    """Loads the selected head into the model."""

    def __init__(self, services: Services, solving: Solving) -> None:
        self._services = services
        self._solving = solving
        self._target = ""

    def titles(self) -> tuple[tuple[str, str], ...]:
        """Return the name and title of every head, built-in heads first.

        The user's own heads are those in the folder `heads`, next to the user's styles, and any
        files that the user has selected.
        """
        model, folder = self._services.model, self._services.folders.home / _FOLDER
        last, head = model.settings.own_head, model.head
        files = [model.settings.head, "" if head is None else head.name]
        files += [last] if Path(last).is_file() else []
        return tuple((name, head_title(name)) for name in list_heads(folder, *files))

    def choose(self, file: Path) -> None:
        """Load the user's own head from a file, and add the head to the list."""
        try:
            self._services.model.set("own_head", str(file))
        except CoreError as error:
            self._services.notify.tell_error(error)
        self.load(str(file))

    def load(self, name: str) -> None:
        """Select and load one of the heads in `titles`.

        If that head is missing, the generic head is loaded instead. Answers for the previous head
        are no longer valid.
        """
        self._target = name
        names = pack_names()
        head_name = name if name in names or name.endswith(".npz") else _FALLBACK
        looks = self._services.model.settings.looks
        self._solving.cancel()
        self._services.model.update(head_name=head_name)
        self._services.runner.submit(
            "head",
            lambda *_: load_head(head_name, *looks),
            done=lambda head: self._services.model.update(head=head),
            failed=lambda error: self._failed(error, head_name),
        )

    def load_for_place(self, name: str) -> None:
        """Load the head of a place, unless it is already loaded or loading.

        Call this method before setting the place's light, which would otherwise be solved for the
        wrong head.
        """
        model, runner = self._services.model, self._services.runner
        is_coming = runner.running("head") and self._target == name
        if not is_coming and (model.head is None or model.head.name != name):
            self.load(name)

    def follow_looks(self) -> None:
        """Reload the head after its appearance has changed in the settings."""
        head, looks = self._services.model.head, self._services.model.settings.looks
        if head is not None and (head.hair, head.in_place) != looks:
            self.load(head.name)

    def _failed(self, error: Exception, name: str) -> None:
        self._services.notify.tell_error(error)
        if name.endswith(".npz"):
            self.load(_FALLBACK)
            return
        head = self._services.model.head
        if head is not None:
            self._services.model.update(head_name=head.name)
        # The place is now solved with the head that is still loaded.
        self._solving.solve()
