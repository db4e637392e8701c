"""The settings: one table that the dialog, the file and docs/settings.md all follow.

Each setting is a field of `Settings` with its words beside it; adding one is adding a field.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from app.core.base.errors import CoreError
from app.core.base.files import make_folder, os_errors_as
from app.core.solver.turn_choice import Objective
from app.core.storage.data_lock import writing
from app.core.storage.json_file import Facts, clean, keep_bad, keep_copy, read_json, write_json
from app.core.styles.lamps import (
    AS_PUBLISHED,
    RATIO_CHOICES,
    SIZE_CHOICES,
    Studio,
    parse_ratio,
    parse_softness,
)
from app.core.text import tr

Kind: TypeAlias = Literal["choice", "number", "toggle", "text", "folder"]
Value: TypeAlias = str | float | bool

_LONGEST_PATH: Final = 4096

_REMEMBERED: Final = tr("Remembered")
_SECTIONS: Final = {
    "theme": tr("Looks"),
    "head": tr("Sitter"),
    "paper_mode": tr("Answers"),
    "plan": tr("Capture"),
    "mode": tr("Turning"),
    "sounds": tr("Sound"),
    "places_folder": tr("Files"),
    "live_source": _REMEMBERED,
}
"""The first setting of each section, and its heading; the dialog does not show the last."""


class SettingsError(CoreError):
    """A setting is unknown, takes no such value, or cannot be kept."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One line of the table of settings."""

    key: str
    title: str
    section: str
    kind: Kind
    default: Value
    help: str
    # tuple of (str, str), values of a choice and the words for them; empty where `offers` says who
    # knows them
    choices: tuple[tuple[str, str], ...] = ()
    # whose values the dialog is to offer: "heads" for the heads that are there; "" for none
    offers: str = ""
    minimum: float = 0.0
    maximum: float = 0.0
    step: float = 1.0
    whole: bool = False
    # of a number, as written after it; a space goes in between unless it is "°" or "×"
    unit: str = ""
    longest: int = 80
    empty_means: str = ""
    # other words by which somebody may look for it
    also: str = ""
    shown: bool = True

    @property
    def searched(self) -> str:
        """All words by which it is found."""
        choices = (words for _, words in self.choices)
        return " ".join((self.title, self.section, self.help, self.also, *choices))

    def checked(self, value: object) -> Value:
        """Return a value as the program uses it.

        Raises SettingsError when the setting does not take this value; the sentence says which it
        takes.
        """
        if self.kind == "number":
            return self._number(value)
        if self.kind == "toggle":
            if isinstance(value, bool):
                return value
        elif isinstance(value, str):
            if self.kind == "choice" and self._is_choice(value):
                return value
            if self.kind != "choice":
                return self._text(value)
        raise SettingsError(self.takes())

    def takes(self) -> str:
        """Say which values the setting takes."""
        title = self.title
        if self.kind == "toggle":
            return tr("“{title}” is on or off.", title=title)
        if self.kind == "number":
            low, high = self.words(self.minimum), self.words(self.maximum)
            told = {"title": title, "low": low, "high": high}
            if self.whole:
                return tr("“{title}” goes from a whole number {low} to {high}.", **told)
            return tr("“{title}” goes from {low} to {high}.", **told)
        if self.kind == "choice" and self.choices:
            names = ", ".join(words for _, words in self.choices)
            return tr("“{title}” is one of: {names}.", title=title, names=names)
        if self.kind == "folder":
            return tr("“{title}” is a folder with its whole path, or empty.", title=title)
        return tr("“{title}” is a text of at most {most} letters.", title=title, most=self.longest)

    def words(self, value: Value) -> str:
        """Write a value as the dialog shows it.

        Examples:
            >>> Setting("k", "K", "S", "number", 1.8, "", minimum=1, maximum=9, unit="m").words(1.8)
            '1.8 m'
        """
        if isinstance(value, bool):
            return tr("on") if value else tr("off")
        if isinstance(value, str):
            return dict(self.choices).get(value, value) or self.empty_means
        # Rounded only to be shown; an exact whole number is written without a point.
        digits = f"{value:.2f}".rstrip("0").rstrip(".").replace("-", "−")
        return digits + ("" if self.unit in ("", "°", "×") else " ") + self.unit

    def _is_choice(self, value: str) -> bool:
        if self.choices:
            return any(value == key for key, _ in self.choices)
        # A head of one's own is named by its path.
        longest = _LONGEST_PATH if value.endswith(".npz") else self.longest
        return bool(value) and value == clean(value) and len(value) <= longest

    def _number(self, value: object) -> float:
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            inside = self.minimum <= value <= self.maximum and math.isfinite(value)
            if inside and (not self.whole or value == int(value)):
                return int(value) if self.whole else float(value)
        raise SettingsError(self.takes())

    def _text(self, value: str) -> str:
        line = clean(value)
        folder = self.kind == "folder"
        # A relative folder would mean another one at each start.
        fits = not line or _is_absolute(line) if folder else len(line) <= self.longest
        if not fits or len(line) > _LONGEST_PATH or (folder and line != value.strip()):
            raise SettingsError(self.takes())
        return line


def _is_absolute(path: str) -> bool:
    # Of either kind, so that settings can be carried from one computer to another.
    drive = len(path) > 2 and path[0].isalpha() and path[1] == ":" and path[2] in "\\/"
    return path.startswith(("/", "\\\\")) or drive


def _line(
    title: str,
    default: Value,
    help_words: str,
    kind: Kind = "text",
    *,
    choices: Mapping[str, str] | None = None,
    within: tuple[float, float] = (0.0, 0.0),
    **more: object,
) -> Any:
    """Declare a field of `Settings`; its kind follows from its default and its choices.

    `within`: least and largest number; `more` as in `Setting`.
    """
    if isinstance(default, bool):
        kind = "toggle"
    elif not isinstance(default, str):
        kind = "number"
    elif choices or "offers" in more:
        kind = "choice"
    about: dict[str, object] = {"title": title, "kind": kind, "default": default}
    about |= {"help": help_words, "choices": tuple((choices or {}).items())}
    about |= {"minimum": within[0], "maximum": within[1], "whole": type(default) is int}
    return field(default=default, metadata=about | more)


@dataclass(frozen=True, slots=True)
class Settings:
    """A value for every setting, in the order of the dialog; none that it does not take.

    ``Settings()`` has all the defaults. `with_` changes one.
    Raises SettingsError when a value is not one that its setting takes.

    Examples:
        >>> Settings().with_("text_scale", 1.5).text_scale
        1.5
    """

    theme: str = _line(
        tr("Theme"),
        "dark",
        tr("High contrast is made for bright sun; “System” follows your operating system."),
        choices={
            "system": tr("System"),
            "dark": tr("Dark"),
            "light": tr("Light"),
            "contrast": tr("High contrast"),
        },
        also=tr("colours dark mode night sunlight"),
    )
    text_scale: float = _line(
        tr("Size of text and controls"),
        1.0,
        tr("Makes everything in the window larger."),
        within=(1.0, 2.0),
        also=tr("font zoom scale bigger"),
        step=0.05,
        unit="×",
    )
    reduce_motion: bool = _line(
        tr("Fewer animations"), False, tr("Things change at once instead of gliding.")
    )
    head: str = _line(
        tr("Head"),
        "generic",
        tr(
            "Head and skin tone that new places start with; the chip at the top changes it for "
            "one. On dark skin, match reads about 6 points lower than on real faces."
        ),
        offers="heads",
    )
    hair: str = _line(
        tr("Hair"),
        "short",
        tr("Of the head in large pictures; it changes no answer."),
        choices={
            "short": tr("Short"),
            "long": tr("Long"),
            "plain": tr("None, bald and plain"),
        },
        also=tr("bald portrait brows"),
    )
    behind: str = _line(
        tr("Behind the head"),
        "place",
        tr("What is behind the head in pictures here; the place is blurred as at 85 mm, f/2."),
        choices={"place": tr("The place"), "grey": tr("Neutral grey")},
        also=tr("background bokeh blur"),
    )
    sitter_name: str = _line(
        tr("Sitter’s name"), "", tr("Printed on set sheets."), longest=80, empty_means=tr("none")
    )
    paper_mode: bool = _line(
        tr("Paper mode"),
        False,
        tr("Finds turns by the published rule: the largest quality C, of grey light on grey skin."),
        also=tr("objective best turn quality"),
    )
    lamp_size: str = _line(
        tr("Lamp size"),
        "paper",
        tr("Size of the lamps in your studio, for new places; the Styles step changes it for one."),
        choices=SIZE_CHOICES,
    )
    lamp_ratio: str = _line(
        tr("Lighting ratio"),
        "none",
        tr("Key and fill to fill alone in your studio, for new places."),
        choices=RATIO_CHOICES,
    )
    plan: str = _line(
        tr("Bracket"),
        "full",
        tr("Three frames are quick and clip lamps and the sun; the full range holds them."),
        choices={"paper": tr("Three frames"), "full": tr("Full range")},
        also=tr("exposures HDR quick"),
    )
    self_timer_s: int = _line(
        tr("Self-timer"),
        5,
        tr("Time to kneel under the camera before the first exposure."),
        within=(0.0, 10.0),
        unit="s",
        also=tr("countdown delay"),
    )
    measure_with: str = _line(
        tr("Measure with"),
        "camera",
        tr("What the Probe step measures the light with; it also says how photographs are read."),
        choices={
            "camera": tr("360 camera"),
            "film": tr("Film"),
            "ball": tr("Mirror ball"),
            "photos": tr("Photos"),
            "file": tr("File"),
        },
        also=tr("video chrome panorama phone"),
    )
    mirrored: bool = _line(
        tr("Mirrored"),
        False,
        tr("Films and photos are mirror images, as some phones save selfies."),
        also=tr("selfie front camera flip left right swap"),
    )
    watch_folder: str = _line(
        tr("Watched folder"),
        "",
        tr("Brackets of any camera that arrive in this folder are offered for merging."),
        "folder",
        empty_means=tr("none"),
    )
    mode: str = _line(
        tr("Who turns"),
        "walk",
        tr(
            "Either you walk around the sitter, who turns with you, or you are the sitter yourself."
        ),
        choices={"walk": tr("I walk around the sitter"), "selfie": tr("I turn myself")},
        also=tr("selfie alone"),
    )
    camera_looks: str = _line(
        tr("The live camera looks at"),
        "ask",
        tr("A laptop’s own camera usually looks at you, a camera in your hand at the sitter."),
        choices={"ask": tr("Ask me"), "sitter": tr("The sitter"), "me": tr("Me")},
    )
    webcam: int = _line(
        tr("Webcam"),
        0,
        tr("Which of the cameras on this computer is the live one, counted from 0."),
        within=(0.0, 15.0),
    )
    camera_distance_m: float = _line(
        tr("Distance of the camera"),
        1.8,
        tr("From the sitter to the camera that takes the portrait."),
        within=(0.5, 10.0),
        step=0.1,
        unit="m",
    )
    sounds: bool = _line(
        tr("Sounds"),
        True,
        tr("A sound says when you may move, and when the turn is reached."),
        also=tr("mute silent noise"),
    )
    volume: float = _line(
        tr("Volume"), 70.0, tr("Of these sounds."), within=(0.0, 100.0), step=5.0, unit="%"
    )
    voice: bool = _line(
        tr("Spoken voice"),
        False,
        tr("Says aloud when to kneel and which frame is taken, in this computer's own voice."),
    )
    places_folder: str = _line(
        tr("Places are kept in"),
        "",
        tr("New places go here. Those that are in another folder stay there."),
        "folder",
        empty_means=tr("Turnlight’s own folder"),
        also=tr("save storage disk"),
    )
    live_source: str = _line(
        tr("Live camera"),
        "",
        tr("A network camera or a video in place of a webcam."),
        longest=2000,
        empty_means=tr("the webcam"),
    )
    live_views: str = _line(
        tr("Live cameras’ angles of view"),
        "",
        tr("Angle of view and resolution of each live camera."),
        longest=4000,
        empty_means=tr("estimated"),
    )
    own_head: str = _line(
        tr("Head of your own"),
        "",
        tr("The head file that was chosen last."),
        longest=_LONGEST_PATH,
        empty_means=tr("none"),
    )
    last_place: str = _line(
        tr("Last place"),
        "",
        tr("The place that is opened at the next start."),
        longest=4096,
        empty_means=tr("none"),
    )
    card_width: int = _line(
        tr("Size of the cards"),
        0,
        tr("Least width of a style’s card; 0 leaves it to the window."),
        within=(0.0, 440.0),
    )
    same_exposure: bool = _line(
        tr("Same exposure"),
        False,
        tr("All pictures here use the exposure of the selected style."),
    )
    tour_seen: bool = _line(tr("Tour seen"), False, tr("Off shows the tour at the next start."))
    unknown: Mapping[str, Any] = field(default_factory=dict, repr=False, hash=False)

    def __post_init__(self) -> None:
        for entry in TABLE:
            object.__setattr__(self, entry.key, entry.checked(getattr(self, entry.key)))

    @property
    def objective(self) -> Objective:
        """The rule by which turns are found."""
        return "paper" if self.paper_mode else "picture"

    @property
    def studios(self) -> dict[str, Studio]:
        """Lamps that new places start with, as `Place.studios`."""
        studio = Studio(parse_softness(self.lamp_size), parse_ratio(self.lamp_ratio))
        return {} if studio == AS_PUBLISHED else {"": studio}

    @property
    def looks(self) -> tuple[str, bool]:
        """Hair of the head, and whether the place is shown behind it."""
        return self.hair, self.behind == "place"

    def value(self, key: str) -> Value:
        """Return the value of a setting by its key."""
        value: Value = getattr(self, setting(key).key)
        return value

    def with_(self, key: str, value: object) -> Settings:
        """Change one setting."""
        changes: dict[str, Any] = {setting(key).key: setting(key).checked(value)}
        return replace(self, **changes)

    def reset(self) -> Settings:
        """Set all that the dialog shows back to its defaults."""
        changes: dict[str, Any] = {each.key: each.default for each in TABLE if each.shown}
        return replace(self, **changes)


def _table() -> Iterator[Setting]:
    section = ""
    for each in fields(Settings):
        section = _SECTIONS.get(each.name, section)
        if each.metadata:
            shown = section != _REMEMBERED
            yield Setting(each.name, section=section, shown=shown, **each.metadata)


TABLE: Final = tuple(_table())
"""Every setting there is, in the order of the dialog."""

SECTIONS: Final[tuple[str, ...]] = tuple(dict.fromkeys(entry.section for entry in TABLE))
"""Headings in the order of the dialog."""

_BY_KEY: Final = {entry.key: entry for entry in TABLE}


def setting(key: str) -> Setting:
    """Return the line of the table with a key; raises SettingsError when there is none."""
    if key not in _BY_KEY:
        raise SettingsError(tr("There is no setting {key!r}.", key=key))
    return _BY_KEY[key]


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
            tr(
                "The settings in {path} cannot be read: {why}. Using default settings.",
                path=path,
                why=found.why,
            ),
        )
    notes = []
    if found.state == "damaged":
        notes.append(
            tr("The settings could not be used: {why}. Using default settings.", why=found.why)
        )
    values: dict[str, Any] = {}
    facts = _renamed(found.facts)
    newer = facts.pop(_VERSION_KEY, VERSION) != VERSION
    for entry in TABLE:
        if entry.key in facts:
            try:
                values[entry.key] = entry.checked(facts.pop(entry.key))
            except SettingsError as error:
                notes.append(
                    tr(
                        "{message} It is {words} again.",
                        message=error.message,
                        words=entry.words(entry.default),
                    )
                )
    settings = Settings(**values, unknown=facts)
    if notes or newer:
        kept = keep_bad(path, _MOST_BYTES)
        if kept is not None and notes:
            notes.append(tr("The file as it was is kept as {name}.", name=kept.name))
    return settings, tuple(notes)


def write_settings(path: Path, settings: Settings, saved: Settings | None = None) -> Path | None:
    """Write the settings whole or not at all; only what differs from its default is in the file.

    Args:
        saved: The settings as this process last read or wrote them. What another process has
            changed since stays, unless this one has changed the same setting.

    Returns the copy of a file that held another value of the same setting; None where none did.
    """
    refused = tr("The settings were not saved in {parent}: {reason}.")
    hint = tr("They count until you quit.")
    with os_errors_as(SettingsError, refused, hint, parent=path.parent):
        make_folder(path.parent, private=True)
        with writing(path.parent):
            merged, clash = (settings, False) if saved is None else _merged(path, settings, saved)
            copy = keep_copy(path, _MOST_BYTES, "conflict") if clash else None
            try:
                write_json(path, _facts_of(merged), _MOST_BYTES)
            except CoreError as error:
                message = tr("The settings were not saved. {message}", message=error.message)
                raise SettingsError(message, hint) from error
    return copy


def _merged(path: Path, ours: Settings, saved: Settings) -> tuple[Settings, bool]:
    """Take over what another process has changed; whether both have changed the same."""
    file = read_json(path, _MOST_BYTES)
    if file.state != "whole":
        return ours, False
    clash = False
    changes: dict[str, Any] = {}
    facts = _renamed(file.facts)
    for entry in TABLE:
        mine, before = ours.value(entry.key), saved.value(entry.key)
        theirs = entry.default
        with contextlib.suppress(SettingsError):
            theirs = entry.checked(facts.get(entry.key, entry.default))
        if mine == before:
            changes[entry.key] = theirs
        elif theirs not in (before, mine) and entry.key != "last_place":
            clash = True
    known = {_VERSION_KEY, *(entry.key for entry in TABLE)}
    unknown = {name: value for name, value in facts.items() if name not in known}
    return replace(ours, **changes, unknown={**unknown, **ours.unknown}), clash


def _renamed(facts: Facts) -> Facts:
    """Read the names of earlier versions."""
    current = dict(facts)
    objective = current.pop("objective", None)
    if objective == "paper":
        current.setdefault("paper_mode", True)
    return current


def _facts_of(settings: Settings) -> Facts:
    facts: Facts = {_VERSION_KEY: VERSION}
    for entry in TABLE:
        value = settings.value(entry.key)
        if value != entry.default:
            facts[entry.key] = value
    facts |= {name: value for name, value in settings.unknown.items() if name not in facts}
    return facts
