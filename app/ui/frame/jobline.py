"""The line at the foot: what runs and how far it is, or what was last; and shortcuts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.theme import theme
from app.ui.theme.icons import icon_pixmap
from app.ui.widgets.accessibility import describe
from app.ui.widgets.buttons import Button
from app.ui.widgets.displays import Bar
from app.ui.widgets.labels import KeyHint, Text
from app.ui.widgets.layouts import clear, row
from app.ui.widgets.surfaces import Surface

if TYPE_CHECKING:
    from app.ui.shell.jobs import JobLine

_MOST_HINTS = 4


class JobLineBar(Surface):
    """The job line."""

    cancel_asked = Signal(str)
    """Key of the job."""
    messages_asked = Signal()

    def __init__(self, compact: bool) -> None:
        super().__init__("panel", ("top",))
        t = theme()
        self._compact = compact
        self._key = ""
        self.setFixedHeight(t.px(32 if compact else 40))
        self._mark = QLabel()
        self._mark.setFixedSize(t.px(16), t.px(16))
        self._words = Text("", 12, elide=True)
        self._words.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self._bar = Bar()
        self._left = Text("", 12, role="dim")
        self._cancel = Button(tr("Cancel"), size="small")
        self._hints = QWidget()
        self._hint_row = row(into=self._hints, gap=16)
        self._bell = Button("", "bell", kind="quiet", size="small")
        self._bell.clicked.connect(self.messages_asked)
        left = (self._mark, self._words, self._bar, self._left, self._cancel)
        row(*left, ..., self._hints, self._bell, into=self, gap=8, margins=(24, 0, 24, 0))
        self.show_unread(0)
        self._cancel.clicked.connect(lambda: self.cancel_asked.emit(self._key))
        self.show_job(None)

    def show_job(self, job: JobLine | None) -> None:
        """Show what runs; None goes back to the last words."""
        running = job is not None
        for widget in (self._bar, self._left, self._cancel):
            widget.setVisible(running)
        self._mark.setVisible(not running and bool(self._words.text()))
        if job is not None:
            self._key = job.key
            self._words.set_text(job.message or job.title)
            self._left.set_text(f"{round(100 * job.fraction)} %")
            self._bar.set(job.fraction)
            self._bar.setAccessibleName(f"{job.title}: {round(100 * job.fraction)} %")
            self._cancel.setAccessibleName(tr("Cancel: {title}", title=job.title))

    def show_idle(self, words: str, icon: str = "check") -> None:
        """Show the last result."""
        t = theme()
        colour = {"check": t.c.ok, "error": t.c.err}.get(icon, t.c.dim)
        self._mark.setPixmap(icon_pixmap(icon, t.px(16), colour, self.devicePixelRatioF()))
        self._words.set_text(words)
        self.show_job(None)

    def show_unread(self, count: int) -> None:
        """Say how many messages were not read yet; the bell opens all of them."""
        self._bell.set_text(str(count) if count else "")
        name = tr("Messages, {count} unread", count=count) if count else tr("Messages")
        describe(self._bell, name, tip=name)

    def show_hints(self, hints: Sequence[tuple[str, str]]) -> None:
        """Show the screen's shortcuts: keys and what they do, at most four."""
        clear(self._hint_row)
        for keys, words in hints[: _MOST_HINTS // (2 if self._compact else 1)]:
            self._hint_row.addWidget(KeyHint(keys, words))
