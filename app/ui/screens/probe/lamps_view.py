"""The table of lamps."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.screens.probe.lamps import LampRow
from app.ui.theme import px
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import boxed, column, row
from app.ui.widgets.lists import Cell, Column, TableHead, TableRow
from app.ui.widgets.surfaces import Scroll

_ROW: Final = 44

_FULL: Final = (
    Column(tr("Lamps found"), 160),
    Column(tr("Where")),
    Column(tr("Azimuth"), 84),
    Column(tr("Elevation"), 88),
    Column(tr("Share of the light"), 120),
    Column("", 92),
)

_COMPACT: Final = (
    Column(tr("Lamps found")),
    Column(tr("Azimuth"), 68),
    Column(tr("Elevation"), 80),
    Column(tr("Share"), 128),
    Column("", 96),
)


class _WholeRows(Scroll):
    """A scroll area that shows only complete rows."""

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Hide a row that would be cut off."""
        high = px(_ROW)
        self.setViewportMargins(0, 0, 0, self.height() % high if self.height() > high else 0)
        super().resizeEvent(event)


class LampTable(QWidget):
    """A table with a row for each lamp, or a note explaining why there are no lamps."""

    def __init__(self, compact: bool) -> None:
        super().__init__()
        self._compact = compact
        self._columns = _COMPACT if compact else _FULL
        self._note = Text("", role="dim")
        self._note.setFixedHeight(px(_ROW))
        self._rows = column(self._note, ...)
        self.rows: list[TableRow] = []
        head = row(TableHead(self._columns), gap=None)
        scroll = _WholeRows(boxed(self._rows), name=tr("Lamps found"))
        # Keep the header aligned with the rows, which leave room for the scroll bar.
        scroll.bar_changed.connect(lambda width: head.setContentsMargins(0, 0, width, 0))
        column(head, (scroll, 1), into=self)

    def show_lamps(self, lamps: tuple[LampRow, ...], note: str) -> None:
        """Show the lamps, and the note if it is not empty."""
        while len(self.rows) > len(lamps):
            row = self.rows.pop()
            row.hide()
            row.deleteLater()
        while len(self.rows) < len(lamps):
            row = TableRow(self._columns, self._cells(lamps[len(self.rows)]))
            # The rows are for reading only and cannot be selected.
            row.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            row.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            self.rows.append(row)
            self._rows.insertWidget(self._rows.count() - 1, row)
        for row, lamp in zip(self.rows, lamps, strict=True):
            row.set(self._cells(lamp))
            row.setAccessibleName(lamp.spoken)
        self._note.say(note)

    def _cells(self, lamp: LampRow) -> tuple[Cell, ...]:
        where = () if self._compact else (Cell(lamp.where),)
        return (
            Cell(lamp.name, letter=lamp.letter, strong=True),
            *where,
            Cell(lamp.azimuth),
            Cell(lamp.elevation),
            Cell(lamp.share),
            Cell(tr("clipped"), "hatch") if lamp.clipped else Cell(""),
        )
