"""The models of the program's simulated camera, and models with an old firmware."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from app.devices.simulated import cameras
from app.devices.simulated.cameras import Personality, read_personalities

_FILE: Final = Path(__file__).with_name("firmwares.toml")
_OLD: Final = read_personalities(_FILE, {each.name: each for each in cameras.PERSONALITIES})

PERSONALITIES: Final = tuple(
    person
    for model in cameras.PERSONALITIES
    for person in (model, *(old for old in _OLD.values() if old.model == model.model))
)
"""All of them; an old firmware follows the current one."""


def personality_named(name: str) -> Personality:
    """Find a camera by name, "V-old" and "X-old" among them, see `cameras.personality_named`."""
    return cameras.personality_named(name, PERSONALITIES)


def user_name(person: Personality) -> str:
    """User name in somebody's network: "THETA" and the whole serial number."""
    return f"THETA{person.prefix}{person.serial}"
