"""The panorama of the place: its exposure, layers, lamps and frames."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.findings import Findings
from app.core.places.files.frames import frame_pictures
from app.core.solver.place_light import PlaceLight
from app.ui.presenters.lamps_here import lamps_here
from app.ui.presenters.services import Services

LAYERS = frozenset({"clipped", "lamps", "grid"})
"""The layers that can be drawn over the panorama."""


class PlacePanorama:
    """The panorama of the open place.

    Attributes:
        picture: The panorama at the latest rendered exposure, (h, 2 h, 3) uint8 sRGB, or None if
            no place is open.
        findings: Lamps and clip mask, or None until they have been computed.
        frames: One picture per frame of the capture, each (h, 2 h, 3) uint8 sRGB, or None for a
            frame without a picture. The tuple is empty until the pictures are loaded.
        target_ev: Exposure chosen by the user, in stops.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        self._light: PlaceLight | None = None
        self._exposure_ev = 0.0
        self._exposing = False
        self.picture: NDArray[np.uint8] | None = None
        self.findings: Findings | None = None
        self.frames: tuple[NDArray[np.uint8] | None, ...] = ()
        self.target_ev = 0.0
        self.layers: frozenset[str] = LAYERS - {"grid"}

    def show_light(self) -> None:
        """Show the open place, and start jobs to find its lamps and load its frames."""
        model = self._services.model
        light, place, folder = model.light, model.place, model.place_folder
        self._light = light
        self.findings, self.frames = None, ()
        self._exposure_ev = self.target_ev = 0.0
        self.picture = None if light is None else light.display
        if light is None:
            return
        facts = None if place is None else place.capture
        self._services.runner.submit(
            "findings",
            lambda *_: lamps_here(light, facts),
            done=lambda findings: self._take_findings(light, findings),
            failed=lambda error: self._services.notify.tell_error(error),
        )
        if facts is not None and facts.frames:
            self._services.runner.submit(
                "frame-pictures",
                lambda *_: frame_pictures(folder, facts, light.environment.radiance),
                done=lambda pictures: self._take_frames(light, pictures),
                failed=lambda error: None,
            )

    def expose(self, stops: float) -> None:
        """Change the panorama's exposure by a number of stops. Positive numbers brighten it."""
        self.target_ev = stops
        self._expose()
        self._changed()

    def show_layer(self, name: str, on: bool) -> None:
        """Show or hide one of `LAYERS`."""
        self.layers = self.layers | {name} if on else self.layers - {name}
        self._changed()

    def _take_findings(self, light: PlaceLight, findings: Findings) -> None:
        if light is self._light:
            self.findings = findings
            self._changed()

    def _take_frames(
        self, light: PlaceLight, pictures: tuple[NDArray[np.uint8] | None, ...]
    ) -> None:
        if light is self._light:
            self.frames = pictures
            self._changed()

    def _expose(self) -> None:
        """Render the picture at the latest chosen exposure, running only one job at a time."""
        light, stops = self._light, self.target_ev
        if light is None or self._exposing or stops == self._exposure_ev:
            return
        if stops == 0.0:
            self._exposure_ev, self.picture = 0.0, light.display
            return
        self._exposing = True
        radiance, width = light.environment.radiance, light.display.shape[1]
        self._services.runner.submit(
            "exposure",
            lambda *_: display_panorama(radiance, stops, width),
            done=lambda picture: self._exposed(light, stops, picture),
            failed=lambda error: self._exposed(light, stops, light.display),
            cancelled=lambda: self._exposed(light, stops, light.display),
        )

    def _exposed(self, light: PlaceLight, stops: float, picture: NDArray[np.uint8]) -> None:
        self._exposing = False
        if light is self._light:
            self._exposure_ev, self.picture = stops, picture
        self._expose()
        self._changed()
