"""The one table of settings. The dialog, docs/settings.md and reading a file all follow it."""

from __future__ import annotations

from typing import Final

from app.core.solver.reach import LIMITS
from app.core.storage.settings.setting import Setting, SettingsError

_LOOKS: Final = "Looks"
_SITTER: Final = "Sitter"
_ANSWERS: Final = "Answers"
_CAPTURE: Final = "Capture"
_TURNING: Final = "Turning"
_SOUND: Final = "Sound"
_FILES: Final = "Files"
_REMEMBERED: Final = "Remembered"

TABLE: Final[tuple[Setting, ...]] = (
    Setting(
        "theme",
        "Theme",
        _LOOKS,
        "choice",
        "dark",
        "High contrast is made for bright sun; “System” follows your operating system.",
        choices=(
            ("system", "System"),
            ("dark", "Dark"),
            ("light", "Light"),
            ("contrast", "High contrast"),
        ),
    ),
    Setting(
        "text_scale",
        "Size of text and controls",
        _LOOKS,
        "number",
        1.0,
        "Makes everything in the window larger.",
        minimum=1.0,
        maximum=2.0,
        step=0.05,
        unit="×",
    ),
    Setting(
        "reduce_motion",
        "Fewer animations",
        _LOOKS,
        "toggle",
        False,
        "Things change at once instead of gliding.",
    ),
    Setting(
        "head",
        "Head",
        _SITTER,
        "choice",
        "generic",
        "Head and skin tone that new places start with; the chip at the top changes it for one.",
        offers="heads",
    ),
    Setting(
        "sitter_name",
        "Sitter’s name",
        _SITTER,
        "text",
        "",
        "Printed on set sheets.",
        longest=80,
        empty_means="none",
    ),
    Setting(
        "objective",
        "Best turn by",
        _ANSWERS,
        "choice",
        "picture",
        "By picture: the turn at which the face looks most like the style’s own picture, where the "
        "pattern is deep enough. As in the paper: the largest quality C.",
        choices=(("picture", "Picture"), ("paper", "As in the paper")),
    ),
    Setting(
        "match_limit",
        "Least match",
        _ANSWERS,
        "number",
        LIMITS.match,
        "Below this a style counts as out of reach; 100 is the studio picture itself.",
        minimum=0.0,
        maximum=100.0,
    ),
    Setting(
        "strength_limit",
        "Least strength",
        _ANSWERS,
        "number",
        LIMITS.strength,
        "Below this the light is too soft for a style; 100 is as deep as in the studio.",
        minimum=0.0,
        maximum=100.0,
    ),
    Setting(
        "plan",
        "Bracket",
        _CAPTURE,
        "choice",
        "full",
        "Three frames are quick and clip lamps and the sun; the full range holds them.",
        choices=(("paper", "Three frames"), ("full", "Full range")),
    ),
    Setting(
        "self_timer_s",
        "Self-timer",
        _CAPTURE,
        "number",
        5,
        "Time to kneel under the camera before the first exposure.",
        minimum=0.0,
        maximum=10.0,
        whole=True,
        unit="s",
    ),
    Setting(
        "watch_folder",
        "Watched folder",
        _CAPTURE,
        "folder",
        "",
        "Brackets of any camera that arrive in this folder are offered for merging.",
        empty_means="none",
    ),
    Setting(
        "mode",
        "Who turns",
        _TURNING,
        "choice",
        "walk",
        "Either you walk around the sitter, who turns with you, or you are the sitter yourself.",
        choices=(("walk", "I walk around the sitter"), ("selfie", "I turn myself")),
    ),
    Setting(
        "camera_looks",
        "The live camera looks at",
        _TURNING,
        "choice",
        "ask",
        "A laptop’s own camera usually looks at you, a camera in your hand at the sitter.",
        choices=(("ask", "Ask me"), ("sitter", "The sitter"), ("me", "Me")),
    ),
    Setting(
        "webcam",
        "Webcam",
        _TURNING,
        "number",
        0,
        "Which of the cameras on this computer is the live one, counted from 0.",
        minimum=0.0,
        maximum=15.0,
        whole=True,
    ),
    Setting(
        "camera_distance_m",
        "Distance of the camera",
        _TURNING,
        "number",
        1.8,
        "From the sitter to the camera that takes the portrait.",
        minimum=0.5,
        maximum=10.0,
        step=0.1,
        unit="m",
    ),
    Setting(
        "sounds",
        "Sounds",
        _SOUND,
        "toggle",
        True,
        "A sound says when you may move, and when the turn is reached.",
    ),
    Setting(
        "volume",
        "Volume",
        _SOUND,
        "number",
        70.0,
        "Of these sounds.",
        minimum=0.0,
        maximum=100.0,
        step=5.0,
        unit="%",
    ),
    Setting(
        "places_folder",
        "Places are kept in",
        _FILES,
        "folder",
        "",
        "New places go here. Those that are in another folder stay there.",
        empty_means="Turnlight’s own folder",
    ),
    Setting(
        "live_source",
        "Live camera",
        _REMEMBERED,
        "text",
        "",
        "A network camera, a video or a folder in place of a webcam.",
        longest=2000,
        empty_means="the webcam",
        shown=False,
    ),
    Setting(
        "live_views",
        "Live cameras’ angles of view",
        _REMEMBERED,
        "text",
        "",
        "Angle of view and resolution of each live camera.",
        longest=4000,
        empty_means="estimated",
        shown=False,
    ),
    Setting(
        "last_place",
        "Last place",
        _REMEMBERED,
        "text",
        "",
        "The place that is opened at the next start.",
        longest=4096,
        empty_means="none",
        shown=False,
    ),
    Setting(
        "tour_seen",
        "Tour seen",
        _REMEMBERED,
        "toggle",
        False,
        "Off shows the tour at the next start.",
        shown=False,
    ),
)
"""Every setting there is, in the order of the dialog."""

SECTIONS: Final[tuple[str, ...]] = tuple(dict.fromkeys(entry.section for entry in TABLE))
"""Headings in the order of the dialog."""

_BY_KEY: Final = {entry.key: entry for entry in TABLE}


def setting(key: str) -> Setting:
    """Return the line of the table with a key.

    Raises
    ------
    SettingsError
        When there is none.
    """
    if key not in _BY_KEY:
        raise SettingsError(f"There is no setting {key!r}.")
    return _BY_KEY[key]
