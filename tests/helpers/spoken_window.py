"""Walks through the demo window in the language "test", and says what is not translated or cut off.

Run as a program of its own, since tables of words are translated when their module is imported:
``python -m tests.helpers.spoken_window FOLDER``. One JSON object on standard output.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.core.text import set_language

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

UNITS = ("EV", "GB", "ISO", "MB", "cm", "h", "lx", "m", "min", "s", "kB", "Mbit/s", "stops")
"""Symbols that are the same in every language."""

KEYS = ("Alt", "Backspace", "Ctrl", "Del", "End", "Enter", "Esc", "Home", "PgDn", "PgUp", "Shift",
        "Space", "Tab")  # fmt: skip
"""As they are printed on keyboards; Qt translates those that it writes."""

OWN = ("Turnlight", "turnlight", "RICOH", "THETA", "Theta", "EXR", "HDR", "JPEG", "PNG", "PDF")
"""Names of the program, of products and of formats."""

NUMBER = re.compile(r"[A-Z]|[+−-]?\d[\d.,:/]*\w?")  # a lamp's letter; numbers as 1/250 or 4:1
WORD = re.compile(r"[^\W\d_]+")
TAG = re.compile(r"<[^<>]*>")
# Every letter that the language "test" writes with an accent.
ENGLISH = re.compile(r"[ACDEGHIJKLNORSTUWYZacdeghijklnorstuwyz]")


def untranslated(text: str, names: Iterable[str]) -> str:
    """Return the words of a text that are still English; names from outside are left out."""
    text = " ".join(TAG.sub(" ", text).split())  # tool tips are wrapped
    for name in sorted(names, key=len, reverse=True):
        text = text.replace(name, " ")
    words = [word for word in WORD.findall(text) if ENGLISH.search(word)]
    kept = {*UNITS, *KEYS, *OWN}
    return " ".join(word for word in words if word not in kept and not NUMBER.fullmatch(word))


def without_end(line: str, names: Iterable[str]) -> str:
    """Return a painted line without the end of a name that began on the line above."""
    ends = (name.partition(" ")[2] for name in names)
    return line.removeprefix(max((end for end in ends if line.startswith(f"{end} ")), default=""))


SAID = ("accessibleName", "accessibleDescription", "placeholderText", "statusTip", "text", "title",
        "toolTip", "whatsThis", "windowTitle")  # fmt: skip
"""What a widget may say of itself."""


def texts(root: QWidget) -> Iterator[tuple[str, str]]:
    """Give every text of what is in sight: where it is, and what it says."""
    from PySide6.QtGui import QAction
    from PySide6.QtWidgets import QWidget

    for widget in (root, *root.findChildren(QWidget)):
        if widget.isVisible():
            kind = type(widget).__name__
            values = ((what, getattr(widget, what, str)) for what in SAID)
            yield from ((f"{kind}.{what}", said()) for what, said in values if callable(said))
            yield from ((f"{kind} item", text) for text in items(widget))
    for action in root.findChildren(QAction):
        if type(action.parent()).__module__.startswith("pyqtgraph"):
            continue  # Its own menu is never shown.
        yield "QAction", action.text()
        yield "QAction.toolTip", action.toolTip()


def items(widget: QWidget) -> Iterator[str]:
    """Give the rows of a list or box."""
    from PySide6.QtCore import Qt
    from PySide6.QtWidgets import QAbstractItemView, QComboBox

    if isinstance(widget, (QAbstractItemView, QComboBox)):
        model = widget.model()
        roles = (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole)
        for row in range(model.rowCount()):
            yield from (str(model.index(row, 0).data(role) or "") for role in roles)


def cut(root: QWidget) -> Iterator[str]:
    """Give the texts that have less room than they need, and whose tool tip does not say them."""
    from PySide6.QtWidgets import QAbstractButton

    from app.ui.widgets.buttons import Button
    from app.ui.widgets.labels import Text
    from app.ui.widgets.paint import text_width
    from tests.ui.test_window_reach import in_sight, said, short_of_room

    for widget in in_sight(root):
        need = widget.minimumSizeHint()
        if isinstance(widget, Text):
            trouble = short_of_room(widget)
            if trouble and widget.toolTip() != widget.text():
                yield f"{said(widget)}: {trouble}"
        elif isinstance(widget, Button):
            wide = text_width(widget.font(), widget.text())
            if widget.room() < wide and (
                widget.room() < 0.6 * wide or widget.text() not in widget.whole_tip()
            ):
                yield f"{said(widget)} has room for {widget.room()} of {wide}"
        elif isinstance(widget, QAbstractButton) and (
            widget.width() < need.width() or widget.height() < need.height()
        ):
            yield f"{said(widget)} is {widget.size()}, needs {need}"


class Listener:
    """Notes what is painted word by word, which no widget tells."""

    def __init__(self) -> None:
        from PySide6.QtGui import QPainter, QPainterPath, QStaticText

        self.heard: set[str] = set()
        for kind, name in ((QPainter, "drawText"), (QPainterPath, "addText")):
            self._listen(kind, name)
        plain = QPainter.drawStaticText

        def draw(painter: Any, *args: Any) -> Any:
            self.heard |= {one.text() for one in args if isinstance(one, QStaticText)}
            return plain(painter, *args)

        QPainter.drawStaticText = draw  # type: ignore[method-assign]

    def _listen(self, kind: Any, name: str) -> None:
        plain = getattr(kind, name)

        def draw(painter: Any, *args: Any) -> Any:
            self.heard |= {one for one in args if isinstance(one, str)}
            return plain(painter, *args)

        setattr(kind, name, draw)


def main(folder: Path) -> int:
    """Walk, look and tell."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    os.environ["TURNLIGHT_HOME"] = str(folder / "home")
    set_language("test")
    from app.core.base.paths import resources
    from app.core.storage.settings import Settings
    from app.core.storage.settings_file import FILE, write_settings
    from app.core.styles.styles import load_styles
    from app.devices.clock import SystemClock
    from app.devices.device_sets import DemoDevices
    from app.ui.shell.launch_options import LaunchOptions
    from app.ui.shell.start import App, run
    from app.ui.shell.window import SMALLEST
    from benchmarks.ui.screenshots.command import Walk
    from tests.ui.test_window_reach import OVERLAYS

    listener = Listener()
    names: set[str] = {"Window"}  # the lamp that the walk makes
    for style in load_styles():
        names |= {style.title, style.title.lower()}
    english: dict[str, str] = {}
    clipped: dict[str, None] = {}

    def look(name: str, root: QWidget, app: App) -> None:
        listener.heard.clear()
        root.grab()
        model, camera = app.model, app.model.camera
        known = {*names, *(title for _, title in app.place_controller.heads.titles())}
        known |= {model.place.name} if model.place is not None else set()
        known |= {camera.device.name, camera.device.model} if camera is not None else set()
        # What ends in an ellipsis was cut off in painting: its widget says the whole.
        painted = (
            ("painted", without_end(line, known))
            for line in listener.heard
            if not line.endswith("…")
        )
        for where, text in (*texts(root), *painted):
            if words := untranslated(str(text or ""), known):
                english.setdefault(f"{words!r} of {text[:90]!r} ({where})", name)
        size = root.window().size().toTuple()
        clipped.update(dict.fromkeys(f"{name} {size}: {trouble}" for trouble in cut(root)))

    class Look(Walk):
        """The walk of ``--screenshots``, with eyes instead of a camera."""

        def _shoot(self, name: str) -> None:
            self._robot.settle()
            if name == "lost":
                told = [message.text for message in self._app.notify.messages]
                print("told:", *told, sep="\n", file=sys.stderr)
                self._robot.picture(folder / "lost.png")
            overlay = self._app.commands.overlay
            look(name, self._app.window if overlay is None else overlay, self._app)

        def _others(self) -> None:
            for size in (self._app.window.size(), SMALLEST):
                self._app.window.resize(size)
                # The manual is a document, in the language of its file.
                for what in (one for one in OVERLAYS if one != "manual"):
                    self._app.commands.ask(what)
                    self._linger()
                    self._shoot(what)
                    self._app.commands.close_overlay()

    home = Path(os.environ["TURNLIGHT_HOME"])
    write_settings(home / FILE, Settings(tour_seen=True, sounds=False))
    clock = SystemClock()
    devices = DemoDevices(clock, resources() / "demo" / "cafe")
    options = LaunchOptions(demo=True)
    try:
        code = run(options, devices, clock, lambda app: Look(app, folder).run())
    finally:
        devices.close()
    facts = {"code": code, "english": english, "clipped": list(clipped)}
    print(json.dumps(facts, ensure_ascii=False))
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
