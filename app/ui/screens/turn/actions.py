"""What can be done on the Turn screen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.ui.presenters.actions import Action

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.ui.screens.turn.presenter import TurnPresenter


def turn_actions(p: TurnPresenter, empty_action: str, with_lamp: bool = False) -> Sequence[Action]:
    """Give what can be done now."""
    back, hint = ("Back to the lamp", "lamp") if with_lamp else ("Back to the styles", "styles")
    actions = [
        Action(
            "turn-align",
            "Lay the live picture over the goal",
            p.toggle_align,
            "layers",
            "Space",
            lambda: p.can_align,
            "align",
        ),
        Action("turn-sound", "Sound on or off", p.toggle_sounds, "sound", "M", hint="sound"),
        Action(
            "turn-selfie",
            "Selfie: I turn myself, or back",
            p.toggle_mode,
            "selfie",
            "S",
            hint="selfie",
        ),
        Action("turn-back", back, p.back, "light" if with_lamp else "styles", "Esc", hint=hint),
    ]
    if empty_action:
        return [Action("turn-fill", empty_action, p.fill, "", "Return; Enter"), *actions]
    actions.append(
        Action("turn-photo", "How was it? Open the photo you took…", p.ask_photos, "camera", "P")
    )
    actions.append(Action("turn-source", "Other camera, field of view…", p.ask_source, "webcam"))
    for index, name in p.webcams:
        actions.append(
            Action(
                f"turn-webcam-{index}",
                f"Webcam: {name}",
                lambda index=index: p.choose_webcam(index),  # type: ignore[misc]
                "webcam",
            )
        )
    return actions
