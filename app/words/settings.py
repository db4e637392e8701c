"""Text of the settings: titles, explanations and values in the dialog, and notes on losses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from app.core.storage.settings import Setting, SettingsNote, Value
from app.core.text import tr
from app.words.lamps import RATIO_CHOICES, SIZE_CHOICES

SECTIONS: Final = {
    "looks": tr("Looks"),
    "sitter": tr("Sitter"),
    "answers": tr("Answers"),
    "capture": tr("Capture"),
    "turning": tr("Turning"),
    "sound": tr("Sound"),
    "files": tr("Files"),
    "remembered": tr("Remembered"),
}
"""Headings of the dialog, in order. The last section is hidden from users."""


class SettingWords(NamedTuple):
    """Text of one setting.

    Attributes:
        choices: Labels of the permitted values, by value.
        empty_means: Meaning of an empty value.
        also: Additional search terms.
    """

    title: str
    explanation: str
    choices: Mapping[str, str] = {}
    empty_means: str = ""
    also: str = ""


WORDS: Final = {
    "theme": SettingWords(
        tr("Theme"),
        tr("Use High contrast in bright sun. “System” follows your operating system."),
        {
            "system": tr("System"),
            "dark": tr("Dark"),
            "light": tr("Light"),
            "contrast": tr("High contrast"),
        },
        also=tr("colours dark mode night sunlight"),
    ),
    "text_scale": SettingWords(
        tr("Text and control size"),
        tr("Scales everything in the window."),
        also=tr("font zoom scale bigger"),
    ),
    "reduce_motion": SettingWords(
        tr("Fewer animations"), tr("Changes appear at once instead of gliding.")
    ),
    "head": SettingWords(
        tr("Head"),
        tr(
            "Head and skin tone for new places; change them for one place at the top of "
            "the window. On dark skin, the match reads about 6 points low."
        ),
    ),
    "hair": SettingWords(
        tr("Hair"),
        tr("Hair of the head in large pictures. It does not affect the answers."),
        {"short": tr("Short"), "long": tr("Long"), "plain": tr("None")},
        also=tr("bald portrait brows"),
    ),
    "behind": SettingWords(
        tr("Behind the head"),
        tr("Background of the pictures here. The place is blurred as at 85 mm, f/2."),
        {"place": tr("The place"), "grey": tr("Neutral grey")},
        also=tr("background bokeh blur"),
    ),
    "sitter_name": SettingWords(
        tr("Sitter’s name"), tr("Printed on set sheets."), empty_means=tr("none")
    ),
    "paper_mode": SettingWords(
        tr("Paper mode"),
        tr("Chooses turns by the published rule: the largest quality C, without colour."),
        also=tr("objective best turn quality"),
    ),
    "lamp_size": SettingWords(
        tr("Lamp size"),
        tr("Size of your studio lamps, for new places. Change it for one place in Styles."),
        SIZE_CHOICES,
    ),
    "lamp_ratio": SettingWords(
        tr("Lighting ratio"),
        tr("Ratio of key plus fill to fill in your studio, for new places."),
        RATIO_CHOICES,
    ),
    "plan": SettingWords(
        tr("Bracket"),
        tr("Three frames are quick but clip lamps and the sun. Full range records them."),
        {"paper": tr("Three frames"), "full": tr("Full range")},
        also=tr("exposures HDR quick"),
    ),
    "self_timer_s": SettingWords(
        tr("Self-timer"),
        tr("Time to kneel below the camera before the first exposure."),
        also=tr("countdown delay"),
    ),
    "measure_with": SettingWords(
        tr("Measure with"),
        tr("How the Probe step measures light and reads photos."),
        {
            "camera": tr("360 camera"),
            "film": tr("Film"),
            "ball": tr("Mirror ball"),
            "photos": tr("Photos"),
            "file": tr("File"),
        },
        also=tr("video chrome panorama phone"),
    ),
    "mirrored": SettingWords(
        tr("Mirrored"),
        tr("Films and photos are mirrored, which is how some phones save selfies."),
        also=tr("selfie front camera flip left right swap"),
    ),
    "watch_folder": SettingWords(
        tr("Watched folder"),
        tr(
            "When a new bracket from any camera appears in this folder, Turnlight offers to "
            "merge it."
        ),
        empty_means=tr("none"),
    ),
    "mode": SettingWords(
        tr("Who turns"),
        tr("You walk around the sitter, or you are the sitter yourself."),
        {"walk": tr("I walk around the sitter"), "selfie": tr("I turn myself")},
        also=tr("selfie alone"),
    ),
    "camera_looks": SettingWords(
        tr("Live camera points at"),
        tr("A laptop’s own camera usually points at you; a camera in your hand, at the sitter."),
        {"ask": tr("Ask me"), "sitter": tr("The sitter"), "me": tr("Me")},
    ),
    "webcam": SettingWords(
        tr("Webcam"), tr("Number of the live camera on this computer, starting at 0.")
    ),
    "camera_distance_m": SettingWords(
        tr("Camera distance"), tr("From the sitter to the portrait camera.")
    ),
    "sounds": SettingWords(
        tr("Sounds"),
        tr("A sound signals when you may move and when you reach the turn."),
        also=tr("mute silent noise"),
    ),
    "volume": SettingWords(tr("Volume"), tr("Volume of these sounds.")),
    "voice": SettingWords(
        tr("Spoken voice"),
        tr("Announces when to kneel and which frame is being taken."),
    ),
    "places_folder": SettingWords(
        tr("Places folder"),
        tr("New places are saved here. Existing places stay where they are."),
        empty_means=tr("Turnlight’s own folder"),
        also=tr("save storage disk"),
    ),
    "live_source": SettingWords(
        tr("Live camera"),
        tr("A network camera or a video file instead of a webcam."),
        empty_means=tr("the webcam"),
    ),
    "live_views": SettingWords(
        tr("Live camera angles of view"),
        tr("Angle of view and resolution of each live camera."),
        empty_means=tr("estimated"),
    ),
    "own_head": SettingWords(
        tr("Your own head"), tr("The head file you chose last."), empty_means=tr("none")
    ),
    "last_place": SettingWords(
        tr("Last place"), tr("The place to open at the next start."), empty_means=tr("none")
    ),
    "card_width": SettingWords(
        tr("Card size"), tr("Minimum width of a style card; 0 fits it to the window.")
    ),
    "same_exposure": SettingWords(
        tr("Same exposure"), tr("All pictures here use the exposure of the selected style.")
    ),
    "show_numbers": SettingWords(
        tr("Numbers"), tr("Show the match, the ratio and the curve of the selected style.")
    ),
    "tour_seen": SettingWords(
        tr("Tour seen"), tr("Switch off to show the tour at the next start.")
    ),
}
"""Text of each setting, by key."""


def title(entry: Setting) -> str:
    """Return the label of a setting."""
    return WORDS[entry.key].title


def explanation(entry: Setting) -> str:
    """Return the explanation shown under a setting."""
    return WORDS[entry.key].explanation


def choices(entry: Setting) -> tuple[tuple[str, str], ...]:
    """Return a choice's values with their labels, or () if the program supplies the values."""
    words = WORDS[entry.key].choices
    return tuple((value, words[value]) for value in entry.choices)


def empty_means(entry: Setting) -> str:
    """Return the meaning of an empty value."""
    return WORDS[entry.key].empty_means


def search_words(entry: Setting) -> str:
    """Return all the search terms for a setting."""
    words = (title(entry), SECTIONS[entry.section], explanation(entry), WORDS[entry.key].also)
    return " ".join((*words, *(name for _, name in choices(entry))))


def value_words(entry: Setting, value: Value) -> str:
    """Format a value for the dialog.

    Examples:
        >>> value_words(Setting("k", "looks", "number", 1.8, maximum=9, unit="m"), 1.8)
        '1.8 m'
    """
    if isinstance(value, bool):
        return tr("on") if value else tr("off")
    if isinstance(value, str):
        return dict(choices(entry)).get(value, value) or empty_means(entry)
    # Rounded only for display; whole numbers are shown without a decimal point.
    digits = f"{value:.2f}".rstrip("0").rstrip(".").replace("-", "−")
    return digits + ("" if entry.unit in ("", "°", "×", "%") else " ") + entry.unit


def takes(entry: Setting) -> str:
    """Describe the values that a setting accepts."""
    name = title(entry)
    if entry.kind == "toggle":
        return tr("“{title}” must be on or off.", title=name)
    if entry.kind == "number":
        ends = {"low": value_words(entry, entry.minimum), "high": value_words(entry, entry.maximum)}
        if entry.whole:
            return tr("“{title}” must be a whole number from {low} to {high}.", title=name, **ends)
        return tr("“{title}” must be a number from {low} to {high}.", title=name, **ends)
    if entry.kind == "choice" and entry.choices:
        names = ", ".join(words for _, words in choices(entry))
        return tr("“{title}” must be one of: {names}.", title=name, names=names)
    if entry.kind == "folder":
        return tr("“{title}” must be empty or contain the full path of a folder.", title=name)
    return tr("“{title}” must be at most {most} characters long.", title=name, most=entry.longest)


def note_words(note: SettingsNote) -> str:
    """Describe what was lost when the settings were read."""
    if note.copy is not None:
        return tr("The original file was saved as {name}.", name=note.copy.name)
    if note.entry is not None:
        return tr(
            "{message} It was reset to {words}.",
            message=takes(note.entry),
            words=value_words(note.entry, note.entry.default),
        )
    if note.unreadable is not None:
        return tr(
            "The settings in {path} cannot be read: {why}. Using default settings.",
            path=note.unreadable,
            why=note.why,
        )
    return tr("The settings could not be used: {why}. Using default settings.", why=note.why)
