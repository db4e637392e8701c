"""The models of the program's simulated camera, models with an old firmware, and an Insta360."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from app.devices.simulated import cameras
from app.devices.simulated.cameras import Personality, read_personalities

_FILE: Final = Path(__file__).with_name("firmwares.toml")
_OTHERS: Final = read_personalities(_FILE, {each.name: each for each in cameras.PERSONALITIES})
_OLD: Final = tuple(each for each in _OTHERS.values() if each.name.endswith("-old"))

PERSONALITIES: Final = (
    *(
        person
        for model in cameras.PERSONALITIES
        for person in (model, *(old for old in _OLD if old.model == model.model))
    ),
    _OTHERS["insta360"],
)
"""All of them; an old firmware follows the current one."""


def personality_named(name: str) -> Personality:
    """Find a camera by name, "V-old" and "X-old" among them, see `cameras.personality_named`."""
    return cameras.personality_named(name, PERSONALITIES)


def user_name(person: Personality) -> str:
    """User name in somebody's network: "THETA" and the whole serial number."""
    return f"THETA{person.prefix}{person.serial}"
