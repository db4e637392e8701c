"""Settings: one table that the dialog, the documentation and the file all follow."""

from app.core.storage.settings.setting import Kind, Setting, SettingsError, Value
from app.core.storage.settings.store import (
    DEFAULTS,
    FILE,
    SECTIONS,
    TABLE,
    Settings,
    document,
    read_settings,
    setting,
    write_settings,
)

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
    "document",
    "read_settings",
    "setting",
    "write_settings",
]
