"""A simulated webcam that is unplugged, frozen and covered, as a clumsy foot would."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.devices.webcam.protocol import no_webcam, unplugged
from app.devices.webcam.simulated import SimulatedWebcam

__all__ = ["FragileWebcam"]


class FragileWebcam(SimulatedWebcam):
    plugged = True
    frozen = black = False

    def connect(self) -> None:
        if not self.plugged:
            raise no_webcam()
        super().connect()

    def read(self) -> NDArray[np.uint8] | None:
        if not self.plugged:
            raise unplugged()
        picture = super().read()
        if self.frozen or picture is None:
            return None
        return np.zeros_like(picture) if self.black else picture
