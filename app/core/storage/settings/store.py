"""The settings: their values, reading and writing them, and the page that describes them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from app.core.base.errors import CoreError
from app.core.solver.reach import LIMITS, Limits
from app.core.storage.settings.json_file import Facts, keep_bad, read_json, write_json
from app.core.storage.settings.setting import Setting, SettingsError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from app.core.storage.settings.json_file import JsonFile
    from app.core.storage.settings.setting import Value


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

    Raises SettingsError when there is none.
    """
    if key not in _BY_KEY:
        raise SettingsError(f"There is no setting {key!r}.")
    return _BY_KEY[key]


def _default(key: str) -> Any:
    return setting(key).default


@dataclass(frozen=True, slots=True)
class Settings:
    """A value for every line of `TABLE`; none that the table does not take.

    ``Settings()`` has all the defaults. `with_` changes one.

    Raises SettingsError when a value is not one that its setting takes.

    Examples
    --------
    >>> Settings().with_("text_scale", 1.5).text_scale
    1.5
    """

    theme: str = _default("theme")  # "system", "dark", "light" or "contrast"
    text_scale: float = _default("text_scale")
    reduce_motion: bool = _default("reduce_motion")
    head: str = _default("head")
    sitter_name: str = _default("sitter_name")
    objective: str = _default("objective")  # "picture" or "paper"
    match_limit: float = _default("match_limit")
    strength_limit: float = _default("strength_limit")
    plan: str = _default("plan")  # "paper" or "full"
    self_timer_s: int = _default("self_timer_s")
    watch_folder: str = _default("watch_folder")
    mode: str = _default("mode")  # "walk" or "selfie"
    # "ask" until the user has said it once, then "sitter" or "me"
    camera_looks: str = _default("camera_looks")
    webcam: int = _default("webcam")
    camera_distance_m: float = _default("camera_distance_m")
    sounds: bool = _default("sounds")
    volume: float = _default("volume")
    places_folder: str = _default("places_folder")
    live_source: str = _default("live_source")
    live_views: str = _default("live_views")
    last_place: str = _default("last_place")
    tour_seen: bool = _default("tour_seen")
    unknown: Mapping[str, Any] = field(default_factory=dict, repr=False, hash=False)

    def __post_init__(self) -> None:
        for entry in TABLE:
            object.__setattr__(self, entry.key, entry.checked(getattr(self, entry.key)))

    @property
    def limits(self) -> Limits:
        """Least match and strength of a style in reach."""
        return Limits(self.match_limit, self.strength_limit)

    def value(self, key: str) -> Value:
        """Return the value of a setting by its key.

        Raises SettingsError when there is no such setting.
        """
        value: Value = getattr(self, setting(key).key)
        return value

    def with_(self, key: str, value: object) -> Settings:
        """Change one setting.

        Raises SettingsError when there is no such setting, or it does not take the value.
        """
        changes: dict[str, Any] = {setting(key).key: setting(key).checked(value)}
        return replace(self, **changes)

    def reset(self, section: str = "") -> Settings:
        """Set a section back to its defaults, or all that the dialog shows."""
        changes: dict[str, Any] = {
            entry.key: entry.default
            for entry in TABLE
            if entry.shown and section in ("", entry.section)
        }
        return replace(self, **changes)


DEFAULTS: Final = Settings()
"""What counts until the user says otherwise."""


FILE: Final = "settings.json"
"""Name of the file in the user's folder."""

VERSION: Final = 1
"""Of the file's form."""

_VERSION_KEY: Final = "format_version"
_MOST_BYTES: Final = 1 << 20


def read_settings(path: Path) -> tuple[Settings, tuple[str, ...]]:
    """Read the settings; whatever is wrong with the file, there are settings afterwards.

    Returns `notes`: one sentence for each thing that was lost; then the bad file is kept as
    ``NAME.bak``.
    """
    found = read_json(path, _MOST_BYTES)
    if found.state == "missing":
        return Settings(), ()
    if found.state == "unreadable":
        return Settings(), (
            f"The settings in {path} cannot be read: {found.why}. Using default settings.",
        )
    notes = _about_file(found)
    values: dict[str, Any] = {}
    facts = dict(found.facts)
    newer = facts.pop(_VERSION_KEY, VERSION) != VERSION
    for entry in TABLE:
        if entry.key in facts:
            try:
                values[entry.key] = entry.checked(facts.pop(entry.key))
            except SettingsError as error:
                notes.append(f"{error.message} It is {entry.words(entry.default)} again.")
    settings = Settings(**values, unknown=facts)
    if notes or newer:
        kept = keep_bad(path, _MOST_BYTES)
        if kept is not None and notes:
            notes.append(f"The file as it was is kept as {kept.name}.")
    return settings, tuple(notes)


def _about_file(found: JsonFile) -> list[str]:
    if found.state == "whole":
        return []
    by_key = {entry.key: entry.title for entry in TABLE}
    lost = [f"“{by_key[key]}”" for key in found.lost if key in by_key]
    names = f" Lost: {', '.join(lost)}." if lost else ""
    if not found.facts:
        return [f"The settings could not be used: {found.why}. Using default settings."]
    return [f"A part of the settings could not be used: {found.why}.{names}"]


def write_settings(path: Path, settings: Settings) -> None:
    """Write the settings whole or not at all; only what differs from its default is in the file.

    Raises SettingsError when the disk refuses; the file is as it was.
    """
    facts: Facts = {_VERSION_KEY: VERSION}
    for entry in TABLE:
        value = settings.value(entry.key)
        if value != entry.default:
            facts[entry.key] = value
    facts |= {name: value for name, value in settings.unknown.items() if name not in facts}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, facts, _MOST_BYTES)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingsError(
            f"The settings were not saved in {path.parent}: {reason}.", "They count until you quit."
        ) from error
    except CoreError as error:
        raise SettingsError(
            f"The settings were not saved. {error.message}", "They count until you quit."
        ) from error


def document() -> str:
    """Write docs/settings.md."""
    lines = [
        "# Settings",
        "",
        "Everything here is in one dialog (Settings, at the foot of the rail) and in one file,",
        "`settings.json` in Turnlight's folder, which holds only what differs from the defaults.",
        "A field that cannot be used gets its default again, and the file is kept beside itself as",
        "`settings.json.bak`.",
    ]
    for section in SECTIONS:
        lines += ["", f"## {section}", "", "| setting | values | default | what it does | key |"]
        lines += ["|---|---|---|---|---|"]
        lines += [_row(entry) for entry in TABLE if entry.section == section]
    return "\n".join(lines) + "\n"


def _row(entry: Setting) -> str:
    cells = (entry.title, _values(entry), entry.words(entry.default), entry.help, f"`{entry.key}`")
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _values(entry: Setting) -> str:
    if entry.kind == "toggle":
        return "on, off"
    if entry.kind == "number":
        whole = "whole numbers, " if entry.whole else ""
        return f"{whole}{entry.words(entry.minimum)} to {entry.words(entry.maximum)}"
    if entry.kind == "choice":
        known = (f"{words} (`{value}`)" for value, words in entry.choices)
        return ", ".join(known) if entry.choices else f"one of the {entry.offers}"
    return "a folder" if entry.kind == "folder" else f"text, at most {entry.longest} letters"
