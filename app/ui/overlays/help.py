"""The sheets with the help, the manual, the messages and the tour."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import chain, zip_longest
from typing import Final

import cv2
import numpy as np
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QAccessible, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QWidget

from app.core.base.paths import resources
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.shell.commands import Commands
from app.ui.shell.guided_demo import STEPS
from app.ui.shell.notify import Message
from app.ui.shell.shortcuts import key_text
from app.ui.theme import px, theme
from app.ui.widgets.accessibility import give_role
from app.ui.widgets.buttons import Button
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Icon, KeyHint, Text
from app.ui.widgets.layouts import column, grid, row, stacked
from app.ui.widgets.messages import KINDS
from app.ui.widgets.surfaces import Scroll
from app.words.explanations import EXPLANATIONS

_LINKS: Final = re.compile(r"!\[[^]]*\]\([^)]*\)|\[([^]]*)\]\([^)]*\)")
_BLOCKS: Final = re.compile(r"\n(?=\n|[*|]|\d\.)")
_BLOCK: Final = re.compile(r"(#*) ?(?:[*] |\d[.] )?(?:[*]{2}([^*]+)[.][*]{2})?(.*)")
"""Pattern for a block of the manual.

The groups are the heading marks, a bold term at the start and the rest of the text.
"""
_TOP: Final = Qt.AlignmentFlag.AlignTop
_INSIDE: Final = (0, 0, 16, 0)


def key_lines(actions: Sequence[Action]) -> list[tuple[str, str]]:
    """Return the shortcuts with the actions that they trigger, with one row per key."""
    lines: dict[str, str] = {}
    for one in actions:
        keys = key_text(one.shortcut) if one.shortcut else one.keys
        if keys:
            lines.setdefault(keys, one.words)
    return list(lines.items())


class HelpBody(QWidget):
    """The shortcuts for the current screen and for every screen, with explanations of terms."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        hints = [KeyHint(keys, words) for keys, words in key_lines(commands.all_actions())]
        rows = -(-len(hints) // 2)
        left, right = hints[:rows], hints[rows:]
        for side in (left, right):
            for hint in side:
                hint.align(max(one.cap() for one in side))
        pairs = chain.from_iterable(zip_longest(left, right, fillvalue=QWidget()))
        keys = grid(*((one, Qt.AlignmentFlag.AlignLeft) for one in pairs), across=2, gap=(32, 8))
        inside = QWidget()
        meanings: list[QBoxLayout] = [
            column(Text(word, 14, 600), Text(meaning, 14, role="dim", wrap=True), gap=2)
            for word, meaning in EXPLANATIONS.values()
        ]
        titles = Text(tr("Keys"), 16, 600), Text(tr("Terms"), 16, 600)
        manual = Button(tr("Read the manual"), "file", do=lambda: commands.ask("manual"))
        meanings.append(row(manual, ...))
        column(titles[0], keys, titles[1], *meanings, ..., into=inside, gap=16, margins=_INSIDE)
        column(Scroll(inside, height=440), into=self, gap=None)


class ManualBody(QWidget):
    """The manual supplied with the app, shown without its pictures and links."""

    def __init__(self, _commands: Commands) -> None:
        super().__init__()
        file = resources() / "manual.md"
        file = file if file.is_file() else resources().parent / "docs" / file.name
        words = _LINKS.sub(r"\1", file.read_text(encoding="utf-8")).replace("'", "’")
        self._leads: dict[str, Text] = {}
        lines: list[QBoxLayout] = []
        for block in _BLOCKS.split(words)[1:]:
            match = _BLOCK.fullmatch(" ".join(block.split()))
            marks, lead, rest = match.groups("") if match else ("", "", "")
            plain = re.sub(r"[*`]", "", rest).strip(" |").replace(" | ", ": ")
            size, weight = {0: (14, 400), 3: (16, 600)}.get(len(marks), (20, 600))
            body = Text(plain, size, weight, "text" if marks else "dim", wrap=True)
            if lead:
                self._leads[lead] = Text(lead, 14, 600)
                lines.append(column(self._leads[lead], body, gap=2))
            elif plain.strip("-|"):
                lines.append(column(body))
        inside = QWidget()
        column(*lines, ..., into=inside, gap=12, margins=(8, 4, 16, 4))
        self._area = Scroll(inside, height=560, name=tr("Manual"))
        self._area.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        give_role(self._area, QAccessible.Role.Document)
        self.setFocusProxy(self._area)
        column(self._area, into=self)

    def show_section(self, title: str) -> None:
        """Scroll to the section with this title as soon as the layout is complete."""
        lead, bar = self._leads.get(title), self._area.verticalScrollBar()
        if lead is not None:
            lead.set_role("amber")
            QTimer.singleShot(0, lead, lambda: bar.setValue(lead.y() - px(16)))


class MessagesBody(QWidget):
    """The messages reported since the app started."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        lines = [self._line(message) for message in reversed(commands.messages())]
        none = [] if lines else [Text(tr("No messages yet."), 14, role="dim")]
        inside = QWidget()
        column(*lines, *none, ..., into=inside, gap=16, margins=_INSIDE)
        column(Scroll(inside), into=self, gap=None)

    def _line(self, message: Message) -> QHBoxLayout:
        name, role, says = KINDS[message.kind]
        icon = Icon(name, 20, "dim" if message.kind == "info" else role, says=says)
        moment = Text(f"{message.moment:%H:%M}", 12, role="dim")
        texts = column(Text(message.text, 14, wrap=True), self._buttons(message), gap=8)
        return row((icon, 0, _TOP), (moment, 0, _TOP), (texts, 1), gap=12)

    def _buttons(self, message: Message) -> QHBoxLayout:
        """Create buttons for the message's actions."""
        buttons = []
        for words, do in message.actions:
            button = Button(words, size="small", do=lambda _on=False, do=do: self._act(do))
            button.setAccessibleName(f"{words}: {message.text}")
            buttons.append(button)
        return row(*buttons, ..., gap=8)

    def _act(self, do: Callable[[], None]) -> None:
        self._commands.close_overlay()
        QTimer.singleShot(0, do)


_PICTURE: Final = (640, 400)


class TourBody(QWidget):
    """A tour of five screens of the app, shown one at a time, with a button that opens the demo."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        self._pages = stacked(*(_Page(number) for number in range(len(STEPS))))
        self._count = Text("", 12, role="dim")
        self._back = Button(tr("Back"), do=lambda: self._go(-1))
        self._demo = Button(tr("Watch the two-minute demo"), "play", do=commands.guide)
        self._next = Button(tr("Next"), kind="primary", do=lambda: self._go(1))
        foot = row(self._count, ..., self._demo, self._back, self._next, gap=8)
        column((self._pages, 1), foot, into=self, gap=16)
        self.setFocusProxy(self._next)
        self._go(0)

    def _go(self, by: int) -> None:
        page = self._pages.currentIndex() + by
        if page >= len(STEPS):
            self._commands.close_overlay()
            return
        self._pages.setCurrentIndex(page)
        current = self._pages.currentWidget()
        assert isinstance(current, _Page)
        current.read()
        self._count.set_text(tr("{page} of {pages}", page=page + 1, pages=len(STEPS)))
        self._back.setEnabled(page > 0)
        self._next.set_text(tr("Begin") if page == len(STEPS) - 1 else tr("Next"))


class _Page(QWidget):
    """One step of the tour, with a picture of a screen, its title and instructions."""

    def __init__(self, number: int) -> None:
        super().__init__()
        name, title, words = STEPS[number]
        self.setAccessibleName(tr("Step {number}: {title}", number=number + 1, title=title))
        self._file = resources() / "tour" / f"{name}-{theme().name}.webp"
        self._picture = Picture(tr("Screen: {title}", title=title))
        # In a low window the picture shrinks to leave room for the text.
        self._picture.preferred_size = _PICTURE
        self._picture.setMaximumSize(*(px(side) for side in _PICTURE))
        texts = Text(title, 20, 600), Text(words, 16, role="dim", wrap=True)
        column((self._picture, 0, Qt.AlignmentFlag.AlignHCenter), 8, *texts, ..., into=self, gap=8)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Scale the picture to show the whole screen without distortion."""
        super().resizeEvent(event)
        self._picture.setMaximumWidth(self._picture.height() * _PICTURE[0] // _PICTURE[1])

    def read(self) -> None:
        """Load the picture when its page is shown."""
        encoded = np.fromfile(self._file, np.uint8)
        self._picture.set_picture(np.asarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR_RGB), np.uint8))
