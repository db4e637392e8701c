"""The state of the whole Turn screen, with one part per panel."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from app.core.guidance.walk_plan import PlanDrawing
from app.ui.screens.turn.background_strip import Scale
from app.ui.screens.turn.guidance import Guidance
from app.ui.screens.turn.live.alignment import AlignmentState
from app.ui.screens.turn.live.live import CameraMenu, LiveWords
from app.ui.screens.turn.photos.photos import ShotsState
from app.ui.screens.turn.pictures import Pictures, Size
from app.ui.screens.turn.portraits import StyleWords
from app.words.plan import PlanWords


@dataclass(frozen=True, slots=True)
class TurnSizes:
    """The sizes of the pictures in the view."""

    well: Size = (269, 404)
    strip: Size = (220, 824)
    portrait: Size = (136, 132)


@dataclass(frozen=True, slots=True, eq=False)
class TurnState:
    """The state of the whole screen.

    Attributes:
        empty, empty_action: The reason why there is no goal, and the label of a button. These are
            shown in place of everything else.
        mode: Who moves: ``walk`` or ``selfie``.
        stale: Whether the goal and the match are out of date and therefore dimmed under
            "Computing…".
        demo_deg: Turn of the demo's camera in whole degrees, or None for a real camera.
    """

    empty: str = ""
    empty_action: str = ""
    mode: str = "walk"
    stale: bool = False
    guidance: Guidance = field(default_factory=Guidance)
    style: StyleWords = field(default_factory=StyleWords)
    live: LiveWords = field(default_factory=LiveWords)
    menu: CameraMenu = field(default_factory=CameraMenu)
    alignment: AlignmentState = field(default_factory=AlignmentState)
    demo_deg: int | None = None
    scale: Scale = field(default_factory=Scale)
    plan: PlanDrawing = field(default_factory=PlanDrawing)
    plan_words: PlanWords = field(default_factory=PlanWords)
    shots: ShotsState = field(default_factory=ShotsState)
    pictures: Pictures = field(default_factory=Pictures)


class TurnView(Protocol):
    """A view that shows a `TurnState` and opens dialogs."""

    def show_state(self, state: TurnState) -> None:
        """Show the state."""

    def ask_photos(self) -> None:
        """Let the user choose photos to check."""

    def ask_folder(self) -> None:
        """Let the user choose a folder to watch for photos."""

    def ask_source(self) -> None:
        """Let the user choose another live camera."""
