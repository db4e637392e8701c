"""The ways to measure light, and the requirements of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.core.text import tr


@dataclass(frozen=True, slots=True)
class Way:
    """A way to measure light.

    Attributes:
        steps: Instructions, in order.
        button, files: Label of the button that asks for files, and the filter for those files.
            Neither is used for the camera.
        live: Labels for starting and stopping the live camera, followed by the button's tooltip.
            The tuple is empty if this way does not use a live camera.
    """

    title: str
    steps: tuple[str, ...] = ()
    button: str = tr("Choose photos…")
    files: str = tr("Photos (*.jpg *.jpeg *.png *.tif *.tiff *.dng)")
    live: tuple[()] | tuple[str, str, str] = ()


WAYS: Final = {
    "camera": Way(
        tr("Camera"),
        live=(
            tr("Live preview"),
            tr("Stop the preview"),
            tr("Walk with the camera to see the best styles along the way"),
        ),
    ),
    "film": Way(
        tr("Film"),
        (
            tr("The sitter turns once on the spot, in 20 to 60 seconds."),
            tr("Walk around with them, a metre away, with their face in the middle of the frame."),
            tr("If you are alone, hold your phone at arm’s length and turn with it."),
            tr("Choose the film here. It stays on this computer."),
        ),
        tr("Choose a film…"),
        tr("Films (*.mp4 *.mov *.m4v *.mkv *.avi *.webm *.mpg)"),
        (
            tr("Film with the live camera"),
            tr("Stop filming"),
            tr("The camera that the Turn step uses: a webcam, or a phone on your network"),
        ),
    ),
    "ball": Way(
        tr("Ball"),
        (
            tr("Put a chrome ball where the head will be. A garden or Christmas ball will do."),
            tr("From where you will stand, fill a good part of the picture with the ball."),
            tr("Take three to seven exposures, two stops apart, without moving."),
            tr(
                "Choose the photos here, or drop two folders: photos from a second side fill in "
                "what you hid."
            ),
        ),
    ),
    "photos": Way(
        tr("Photos"),
        (
            tr("Stand where the sitter will be, and turn on the spot."),
            tr("Take 12 to 40 photos that overlap by a third: level, tilted up and tilted down."),
            tr("Take each at two or three exposures to capture windows and lamps."),
            tr("Choose the photos here, or a phone’s panorama."),
        ),
    ),
    "file": Way(
        tr("File"),
        (
            tr("An HDR panorama, or the exposures of a bracket from any 360 camera."),
            tr("A single panorama without exposures gives a rough answer."),
        ),
        tr("Choose files…"),
        tr("Panoramas and photos (*.exr *.hdr *.jpg *.jpeg *.insp *.png *.tif *.tiff *.dng)"),
    ),
}
"""The ways to measure, keyed by the value of the `measure_with` setting."""
