"""The place's light on the head that is painted on, made once for both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.core.base.errors import CoreError
from app.core.solver.relighting_cache import LightTable, light_table

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.core.base.progress import Report, Token
    from app.core.solver.place_light import PlaceLight
    from app.core.solver.transport import Transport
    from app.ui.presenters.services import Services

_JOB: Final = "paint-light"


class LightOnHead:
    """Keeps one light table; has another made in a job when light or head are others."""

    def __init__(self, services: Services, ready: Callable[[], None]) -> None:
        self._services = services
        self._ready = ready
        self._made: LightTable | None = None
        self._of: tuple[PlaceLight, Transport] | None = None
        self.trouble = ""

    def table(self) -> LightTable | None:
        """Give the table of the model's light and head; None while there is none."""
        model = self._services.model
        if model.light is None or model.head is None:
            return None
        light, transport = model.light, model.head.transport
        known = self._of
        if known is None or known[0] is not light or known[1] is not transport:
            self._of, self._made, self.trouble = (light, transport), None, ""
            self._make(light, transport)
        return self._made

    def _make(self, light: PlaceLight, transport: Transport) -> None:
        wanted = self._of

        def work(token: Token, report: Report) -> LightTable:
            del report
            token.check()
            return light_table(transport, light.searched, pictures=True)

        def done(made: LightTable) -> None:
            if self._of is wanted:
                self._made = made
                self._ready()

        def failed(error: Exception) -> None:
            if self._of is wanted:
                said = error.message if isinstance(error, CoreError) else ""
                self.trouble = said or "The light of this place cannot be used."
                self._services.notify.tell_error(error)
                self._ready()

        self._services.runner.submit(_JOB, work, done=done, failed=failed)
