"""The settings as the program uses them, each with its type."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from app.core.solver.reach import Limits
from app.core.storage.settings.table import TABLE, setting

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.core.storage.settings.setting import Value


def _default(key: str) -> Any:
    return setting(key).default


@dataclass(frozen=True, slots=True)
class Settings:
    """A value for every line of `TABLE`; none that the table does not take.

    ``Settings()`` has all the defaults. `with_` changes one.

    Attributes
    ----------
    theme : str
        "system", "dark", "light" or "contrast".
    objective : str
        "picture" or "paper".
    plan : str
        "paper" or "full".
    mode : str
        "walk" or "selfie".
    camera_looks : str
        "ask" until the user has said it once, then "sitter" or "me".

    Raises
    ------
    SettingsError
        When a value is not one that its setting takes.

    Examples
    --------
    >>> Settings().with_("text_scale", 1.5).text_scale
    1.5
    """

    theme: str = _default("theme")
    text_scale: float = _default("text_scale")
    reduce_motion: bool = _default("reduce_motion")
    head: str = _default("head")
    sitter_name: str = _default("sitter_name")
    objective: str = _default("objective")
    match_limit: float = _default("match_limit")
    strength_limit: float = _default("strength_limit")
    plan: str = _default("plan")
    self_timer_s: int = _default("self_timer_s")
    watch_folder: str = _default("watch_folder")
    mode: str = _default("mode")
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

        Raises
        ------
        SettingsError
            When there is no such setting.
        """
        value: Value = getattr(self, setting(key).key)
        return value

    def with_(self, key: str, value: object) -> Settings:
        """Change one setting.

        Raises
        ------
        SettingsError
            When there is no such setting, or it does not take the value.
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
