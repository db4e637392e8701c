"""Settings: one table that the dialog, the documentation and the file all follow."""

from app.core.storage.settings.setting import Kind, Setting, SettingsError, Value
from app.core.storage.settings.store import (
    DEFAULTS,
    FILE,
    Settings,
    read_settings,
    write_settings,
)
from app.core.storage.settings.table import SECTIONS, TABLE, setting

__all__ = [
    "DEFAULTS",
    "FILE",
    "SECTIONS",
    "TABLE",
    "Kind",
    "Setting",
    "Settings",
    "SettingsError",
    "Value",
    "read_settings",
    "setting",
    "write_settings",
]
