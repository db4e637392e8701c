"""The sheet for choosing the live camera, its field of view and its resolution."""

from __future__ import annotations

from functools import partial
from typing import Final

from PySide6.QtCore import QEvent, QMargins, QObject, QSize, Qt
from PySide6.QtWidgets import QLineEdit, QSizePolicy, QWidget

from app.core.text import tr
from app.ui.screens.turn.live.source import VIDEO_FILES, SourcesPresenter, SourcesState
from app.ui.theme import px
from app.ui.widgets.accessibility import OwnKeys
from app.ui.widgets.buttons import Button
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import Sheet, ask_file
from app.ui.widgets.fields import IconLine, ListField, TextField
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import Item, add, column, row
from app.ui.widgets.surfaces import Scroll

_EXAMPLE: Final = "http://192.168.1.20:8080/video"
_FIELD_OF_VIEW_DEG: Final = (30.0, 120.0, 65.0, 1.0)  # minimum, maximum, default, step
NO_VIDEO: Final = tr("No video chosen yet.")
_RING: Final = 4


class SourceSheet(Sheet):
    """The sheet that shows a `SourcesState`."""

    def __init__(self, host: QWidget, presenter: SourcesPresenter) -> None:
        super().__init__(host, tr("Live camera"), 520)
        self._presenter = presenter
        self._state: SourcesState | None = None
        self.source = ListField(tr("Camera"))
        self.source.chosen.connect(self._on_choice)
        self.network = _NetworkPart(presenter)
        self.files = _FilePart()
        self.files.choose.clicked.connect(self.ask_file)
        self.lens = _LensPart(presenter)
        self._status = IconLine()
        inside = _SheetColumn(
            *(self.source, self.network, self.files, self.lens, self._status), gap=16
        )
        # leaves room for the focus ring and stays aligned with the title
        ring = px(_RING)
        inside.column.setContentsMargins(ring, ring, ring, ring)
        margins = self._column.contentsMargins()
        self._column.setContentsMargins(margins - QMargins(ring, 0, ring, 0))
        head = self._column.itemAt(0)
        if head is not None and (title := head.layout()) is not None:
            title.setContentsMargins(ring, 0, ring, 0)
        self._scroll = _Tall(inside)
        self.body.addWidget(self._scroll)
        self.closed.connect(partial(presenter.detach, self))
        self.destroyed.connect(partial(presenter.detach, self))
        presenter.attach(self)

    def show_state(self, state: SourcesState) -> None:
        """Show the changes, except in fields that are being edited."""
        before, self._state = self._state, state
        if state == before:
            return
        self.source.set_items(state.items)
        self.source.choose(state.key)
        self.network.setVisible(state.key == "network")
        self.network.show_state(state)
        self.files.setVisible(state.key == "video")
        self.files.show_state(state)
        self.lens.setVisible(state.adjustable)
        self.lens.show_state(state)
        self._status.say(state.status, state.status_icon)

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Move the focus on Tab, and scroll to the control that receives it."""
        handled = super().focusNextPrevChild(forward)
        there: QWidget | None = self.window().focusWidget()
        if there is not None and self._scroll.isAncestorOf(there):
            self._scroll.keep_visible(there)
        return handled

    @property
    def status(self) -> str:
        """The camera's state, as displayed."""
        return self._status.text()

    def ask_file(self) -> None:
        """Let the user choose a video."""
        video = ask_file(self, tr("Video"), VIDEO_FILES)
        if video is not None:
            self._presenter.choose_video(str(video))

    def _on_choice(self, key: str) -> None:
        self._presenter.show_kind(key)
        if key == "network":
            self.network.address.setFocus(Qt.FocusReason.OtherFocusReason)


class _SheetColumn(QWidget):
    """A group of controls."""

    def __init__(self, *items: Item, gap: float = 8) -> None:
        super().__init__()
        self.column = column(*items, into=self, gap=gap)


class _Tall(Scroll):
    """A scroll area that is as tall as its content if there is room."""

    def __init__(self, content: QWidget) -> None:
        super().__init__(content)
        self._content = content
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)

    def heightForWidth(self, width: int) -> int:
        layout = self._content.layout()
        if layout is None or not layout.hasHeightForWidth():
            # Qt returns -1 when no text wraps.
            return self._content.sizeHint().height()
        return layout.totalHeightForWidth(width)

    def sizeHint(self) -> QSize:
        return self._content.sizeHint()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Update the sheet when the height of the content changes."""
        if event.type() == QEvent.Type.LayoutRequest:
            self.updateGeometry()
        return super().eventFilter(watched, event)


class _NetworkPart(_SheetColumn):
    """The address of a network camera, and its password if the camera requires one."""

    def __init__(self, presenter: SourcesPresenter) -> None:
        super().__init__()
        self._presenter = presenter
        self.address = TextField(tr("Address (HTTP, HTTPS or RTSP)"), _EXAMPLE, "wifi")
        self.connect_to = Button(tr("Connect"), do=lambda: presenter.connect(self.address.text()))
        self.user = TextField(tr("User name"), icon="person")
        self.password = TextField(tr("Password"))
        self.password.edit.setEchoMode(QLineEdit.EchoMode.Password)
        self.hint = Text("", 12, role="dim", wrap=True)
        self.give = Button(tr("Sign in"), do=self._sign_in)
        # aligned with the field, below its label
        beside = column(20, self.connect_to, ...)
        give = (self.give, 0, Qt.AlignmentFlag.AlignLeft)
        self._secret = _SheetColumn(self.user, self.password, self.hint, give)
        add(self.column, row((self.address, 1), beside, gap=8), self._secret)
        OwnKeys(self.address.edit, self.user.edit, self.password.edit)
        self.address.changed.connect(presenter.type_address)
        self.address.entered.connect(presenter.connect)
        self.user.entered.connect(lambda _text: self.password.setFocus())
        self.password.entered.connect(lambda _text: self._sign_in())

    def show_state(self, state: SourcesState) -> None:
        self.address.set_text(state.address)
        self.address.set_error(state.address_error)
        if not state.asks_password:
            self.password.set_text("")
        self._secret.setVisible(state.asks_password)
        self.password.set_error(state.password_error)
        self.hint.set_text(state.password_hint)

    def _sign_in(self) -> None:
        self._presenter.sign_in(self.user.text(), self.password.text())


class _FilePart(_SheetColumn):
    """The video in use, and the button for choosing another video."""

    def __init__(self) -> None:
        super().__init__()
        self.name = Text("", 14, 600, elide=True)
        how = tr("The video plays in a loop at its own speed.")
        self.how = Text(how, 12, role="dim", wrap=True)
        self.choose = Button(tr("Choose a video…"))
        self.trouble = IconLine()
        add(self.column, row((self.name, 1), self.choose, gap=8), self.how, self.trouble)

    def show_state(self, state: SourcesState) -> None:
        self.name.set_text(state.file or NO_VIDEO)
        self.trouble.say(state.file_error, "error")


class _LensPart(_SheetColumn):
    """The field of view and the resolution."""

    def __init__(self, presenter: SourcesPresenter) -> None:
        super().__init__()
        self._title = Text(tr("Field of view"), 12, 600, "dim")
        self.width_text = Text("", 14)
        items = (("estimate", tr("Estimate automatically")), ("set", tr("Set")))
        self.how = SegmentedChoice(items, tr("Field of view"))
        self.words = Text("", 14, role="dim", elide=True)
        edges = tr("From the left to the right edge")
        self.angle = LabelledSlider(edges, *_FIELD_OF_VIEW_DEG, lambda v: f"{v:.0f}°")
        self.resolution = ListField(tr("Resolution"))
        self._row = _SheetColumn(row(self.how, (self.words, 1), gap=8))
        add(self.column, self._title, self.width_text, self._row, self.angle, self.resolution)
        self.how.chosen.connect(lambda key: presenter.estimate(key == "estimate"))
        self.angle.settled.connect(presenter.set_fov)
        self.resolution.chosen.connect(presenter.set_width)

    def show_state(self, state: SourcesState) -> None:
        self.width_text.say(state.known_fov)
        self._row.setVisible(not state.known_fov)
        self.how.choose("estimate" if state.estimate else "set")
        self.words.set_text(state.fov_words if state.estimate else "")
        self.angle.setVisible(not state.estimate and not state.known_fov)
        if not self.angle.isSliderDown():
            self.angle.set_value(state.fov_deg)
        self.resolution.setVisible(bool(state.widths))
        self.resolution.set_items(state.widths)
        if state.width in dict(state.widths):
            self.resolution.choose(state.width)
