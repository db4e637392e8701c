"""What the probe's screen shows, ready to be shown."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.measure.finish.findings import Findings
from app.core.text import tr
from app.ui.presenters.places_list import PlacesListRow

Tone: TypeAlias = Literal["advice", "error", "offer", "note"]


@dataclass(frozen=True, slots=True)
class ChoiceRow:
    """A line of the list before pressing, a plan ("Quick", "3 frames, 9 s"), or a camera."""

    key: str
    title: str
    second: str = ""


CHECKS = (
    ChoiceRow("head-height", tr("Camera where the head will be")),
    ChoiceRow("front-lens", tr("Front lens toward you")),
    ChoiceRow("kneel", tr("Kneel under the camera")),
    ChoiceRow("no-obstacle", tr("Nothing in front of the lights")),
)
"""The list before pressing."""


@dataclass(frozen=True, slots=True)
class Way:
    """How light is measured.

    Attributes:
        steps: What to do, in this order.
        button, files: Words of the button that asks for files, and which files; the camera's way
            has none.
        live: Words that begin what the camera sees and end it, and a tip; nothing without that.
    """

    title: str
    steps: tuple[str, ...] = ()
    button: str = tr("Choose photographs…")
    files: str = tr("Photographs (*.jpg *.jpeg *.png *.tif *.tiff *.dng)")
    live: tuple[()] | tuple[str, str, str] = ()


WAYS: Final = {
    "camera": Way(
        tr("Camera"),
        live=(
            tr("Live preview"),
            tr("Stop the preview"),
            tr("Walk with the camera; the best styles are named on the way"),
        ),
    ),
    "film": Way(
        tr("Film"),
        (
            tr("The sitter turns once on the spot, in 20 to 60 seconds."),
            tr("Walk around with them, a metre away, their face in the middle of the picture."),
            tr("Alone, hold your phone at arm’s length and turn with it."),
            tr("Choose the film here. It stays on this computer."),
        ),
        tr("Choose a film…"),
        tr("Films (*.mp4 *.mov *.m4v *.mkv *.avi *.webm *.mpg)"),
        (
            tr("Film with the live camera"),
            tr("Stop filming"),
            tr("The camera that the Turn step uses: a webcam, or a phone in your network"),
        ),
    ),
    "ball": Way(
        tr("Ball"),
        (
            tr("Put a chrome ball where the head will be. A garden or Christmas ball does."),
            tr("From where you will stand, let it fill a good part of the picture."),
            tr("Take three to seven exposures, two stops apart, without moving."),
            tr("Choose them here, or drop two folders: a second side shows what you hid."),
        ),
    ),
    "photos": Way(
        tr("Photos"),
        (
            tr("Stand where the sitter will be, and turn on the spot."),
            tr("Take 12 to 40 photographs that overlap by a third, level, up and down."),
            tr("Two or three exposures of each hold windows and lamps."),
            tr("Choose them here, or a phone’s panorama."),
        ),
    ),
    "file": Way(
        tr("File"),
        (
            tr("An HDR panorama, or the exposures of a bracket from any 360 camera."),
            tr("A single panorama without exposures gives a rough answer."),
        ),
        tr("Choose files…"),
        tr("Panoramas and photographs (*.exr *.hdr *.jpg *.jpeg *.insp *.png *.tif *.tiff *.dng)"),
    ),
}
"""The ways to measure, by the setting's key."""


@dataclass(frozen=True, slots=True)
class LampRow:
    """A lamp in the table and on the panorama.

    Attributes:
        letter, name: "A", "Window".
        azimuth, elevation, share: "47°", "30° up", "at least 64 %".
        azimuth_deg, elevation_deg: Of the panorama as captured, deg.
        spoken: The whole row, for a screen reader.
    """

    letter: str
    name: str
    where: str
    azimuth: str
    elevation: str
    share: str
    clipped: bool
    azimuth_deg: float
    elevation_deg: float
    spoken: str


@dataclass(frozen=True, slots=True)
class FrameTile:
    """One exposure.

    Attributes:
        ev, shutter, clipped: "+2 EV", "1/15 s", "41 % clipped"; empty where not known.
        picture: (h, 2 h, 3) uint8 or None. SRGB, small; not compared.
        arrived: Share of its file that is here, 0 to 1.
    """

    ev: str = ""
    shutter: str = ""
    clipped: str = ""
    clipped_brief: str = ""
    picture: NDArray[np.uint8] | None = field(default=None, compare=False, repr=False)
    arrived: float = 1.0
    spoken: str = ""


@dataclass(frozen=True, slots=True)
class CameraBlock:
    """The camera, and the panel in which another one is chosen.

    Attributes:
        title, second: "RICOH THETA V", "Wi-Fi, battery 82 %, 1.9 GB free".
        missing: Whether there is no camera; `second` says what to do then.
    """

    title: str = tr("No camera")
    second: str = ""
    short: str = ""
    warning: str = ""
    busy: str = ""
    missing: bool = True
    open: bool = False
    rows: tuple[ChoiceRow, ...] = ()
    chosen: str = ""
    note: str = ""
    address_error: str = ""
    asks_password: bool = False
    user: str = ""
    password_error: str = ""
    password_hint: str = ""


@dataclass(frozen=True, slots=True)
class DistantSign:
    """What somebody who kneels under the camera, three metres away, has to know.

    Attributes:
        kind: Of its colours: "wait", "act" (kneel and stay) or "move".
        big, caption: "Frame 3 of 6", "Stay down".
        fraction: Of the exposures, 0 to 1; None while none is made.
        spoken: What a voice says when it has changed; empty for nothing.
        picture: (h, 2 h, 3) uint8 or None. What was metered, the first panorama; sRGB.
    """

    kind: Literal["wait", "act", "move"] = "wait"
    big: str = tr("Get ready")
    caption: str = ""
    fraction: float | None = None
    spoken: str = ""
    picture: NDArray[np.uint8] | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Running:
    """A capture that is under way.

    `stopping`: it was asked to stop and is giving the camera its settings back.
    """

    rough: str = ""
    stopping: bool = False
    sign: DistantSign = field(default_factory=DistantSign)


@dataclass(frozen=True, slots=True)
class Notice:
    """What is to be said in the right column, with what can be done about it.

    `buttons`: tuple of (str, str). Key for `ProbePresenter.press`, and words.
    """

    tone: Tone
    title: str
    body: str = ""
    buttons: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class RoughCard:
    """One of the best styles by the live preview.

    Attributes:
        title, side, turn, direction, grade: "Rembrandt", "sitter's left (camera right)", "96°",
            "clockwise", "in reach".
        arrow: Icon of the direction.
        note: "rough", and whether it needs the bracket.
        unsure: The turn depends on what the preview clips.
    """

    title: str
    side: str
    turn: str
    direction: str
    grade: str
    note: str
    arrow: str
    unsure: bool
    spoken: str


@dataclass(frozen=True, slots=True)
class Live:
    """The camera's live preview.

    `picture`: (h, 2 h, 3) uint8 or None. SRGB; None before there is one. `trouble`: `message` says
    what is wrong.
    """

    picture: NDArray[np.uint8] | None = field(default=None, compare=False, repr=False)
    cards: tuple[RoughCard, ...] = ()
    message: str = ""
    trouble: bool = False


LAYERS = frozenset({"clipped", "lamps", "grid"})
"""What can be drawn over the panorama."""


@dataclass(frozen=True, slots=True, eq=False)
class ProbeState:
    """Everything on the screen.

    Attributes:
        picture: (h, 2 h, 3) uint8 or None. Panorama at the chosen exposure, sRGB; None before there
            is one.
        findings: Its lamps and clip mask; None while they are looked for.
        front_deg: Azimuth at which the photographer stands, deg.
        exposure_ev: Of the picture, stops.
    """

    picture: NDArray[np.uint8] | None = field(default=None, repr=False)
    findings: Findings | None = None
    front_deg: float = 0.0
    marker_words: str = tr("Photographer stands here")
    exposure_ev: float = 0.0
    layers: frozenset[str] = LAYERS - {"grid"}
    lamps: tuple[LampRow, ...] = ()
    lamps_note: str = ""
    opening: str = ""
    recent: tuple[PlacesListRow, ...] = ()
    age: str = ""
    age_old: bool = False
    way: str = "camera"
    mirrored: bool = False
    watching: str = ""
    camera: CameraBlock = field(default_factory=CameraBlock)
    plans: tuple[ChoiceRow, ...] = ()
    plan: str = "paper"
    timer_s: int = 0
    ticked: frozenset[str] = frozenset()
    frames: tuple[FrameTile, ...] = ()
    frames_note: str = ""
    running: Running | None = None
    live: Live | None = None
    notice: Notice | None = None
    has_place: bool = False
    can_capture: bool = False
    why_not: str = ""


class ProbeView(Protocol):
    """Shows a `ProbeState`."""

    def show_state(self, state: ProbeState) -> None:
        """Show it; what is the same as before is left alone."""

    def zoom_by(self, steps: float) -> None:
        """Zoom the panorama, positive is nearer."""

    def take_marker(self) -> None:
        """Give the marker the keyboard."""

    def ask_folder(self) -> None:
        """Ask which folder is to be watched."""

    def ask_measured(self, way: str) -> None:
        """Ask for the files of one of `WAYS`."""
