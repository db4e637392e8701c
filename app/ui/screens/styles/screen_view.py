"""The view of the Styles screen, with the gallery on the left and the details on the right."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from PySide6.QtCore import QEvent, QSize, QTimer
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import QApplication

from app.core.painting.user_styles import EXPORT_ENDING
from app.core.text import tr
from app.ui.screens.styles.cards_view import CompareSheet, HeldKey, compared_size
from app.ui.screens.styles.detail import DetailState
from app.ui.screens.styles.detail_view import StyleDetail, picture_sizes
from app.ui.screens.styles.files import FileWish
from app.ui.screens.styles.gallery import Sizes
from app.ui.screens.styles.gallery_view import Gallery, layout_for
from app.ui.screens.styles.lamps_and_lens import LampsState
from app.ui.screens.styles.lamps_and_lens_view import LampsSheet, LensSheet
from app.ui.screens.styles.like_photo import LikeState
from app.ui.screens.styles.like_photo_view import LikeSheet
from app.ui.screens.styles.screen import StylesPresenter, StylesState
from app.ui.theme import theme
from app.ui.widgets.dialogs import SheetHost, ask_file, ask_target, show_folder
from app.ui.widgets.layouts import row
from app.ui.widgets.surfaces import Room
from app.words.photos import PHOTO_FILTER

_DETAIL: Final = 456
_WIDEST: Final = 560
_COMPACT: Final = 344
_LEAST: Final = (528, 240)  # minimum size of the gallery
_WIDE_FROM: Final = 1832  # content width in a window 1920 pixels wide
_FIXED: Final = 460  # height of the detail without its pictures
_GROWTH: Final = 0.86  # increase in the pictures' height per pixel of width
_STYLE_FILES: Final = tr("Turnlight styles (*{ending})", ending=EXPORT_ENDING)


def detail_width(width: int, height: int, compact: bool) -> int:
    """Return the width of the details, which grow in wide windows as far as the height allows.

    Args:
        width, height: Size of the screen in logical pixels.

    Returns:
        The width, in logical pixels.
    """
    t = theme()
    if compact:
        return t.px(_COMPACT)
    if width < t.px(_WIDE_FROM):
        return t.px(_DETAIL)
    by_height = t.px(56) + int((height - t.px(_FIXED)) / _GROWTH)
    return max(min(t.px(_WIDEST), by_height), t.px(_DETAIL))


class StylesScreen(SheetHost):
    """The view of `app.ui.screens.styles.screen.StylesPresenter`."""

    def __init__(self, presenter: StylesPresenter, compact: bool) -> None:
        super().__init__()
        self._presenter = presenter
        self._compact = compact
        self._sizes = Sizes()
        self._logical: dict[str, QSize] = {}
        self._ready_for: LampsState | None = None
        self.setAccessibleName(tr("Styles"))
        self.gallery = Gallery(compact)
        self.detail = StyleDetail(compact, presenter.files.actions)
        row((Room(self.gallery, *_LEAST), 1), self.detail, into=self)
        # One resize changes several sizes, so render the pictures only after the last change.
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._set_sizes)
        self._connect()
        self._guess_sizes()

    def _guess_sizes(self) -> None:
        """Assume the usual window size. This avoids rendering most pictures twice."""
        t = theme()
        width, height = (952, 620) if self._compact else (1352, 804)
        detail = detail_width(t.px(width), t.px(height), self._compact)
        state = self._presenter.resolve()
        card = layout_for(t.px(width) - detail, self._compact, state.card_width)
        self._logical["card"] = card.picture
        self._logical["portrait"], self._logical["background"] = picture_sizes(
            detail, self._compact, numbers=state.numbers
        )
        self._set_sizes()

    def _connect(self) -> None:
        presenter, gallery, detail = self._presenter, self.gallery, self.detail
        gallery.chosen.connect(presenter.choose)
        gallery.opened.connect(presenter.open)
        gallery.filtered.connect(presenter.set_filter)
        gallery.sorted.connect(presenter.set_sort)
        gallery.paint_asked.connect(presenter.paint_new)
        gallery.lamps_asked.connect(self._ask_lamps)
        gallery.lens_asked.connect(self.ask_lens)
        gallery.exposed_alike.connect(presenter.expose_alike)
        gallery.marked.connect(presenter.mark)
        gallery.compare_asked.connect(presenter.compare)
        gallery.resized.connect(presenter.set_card_width)
        gallery.held.connect(presenter.swap)
        HeldKey(self).held.connect(presenter.swap)
        gallery.laid.connect(lambda size: self._resized("card", size))
        detail.looked.connect(presenter.look_at)
        detail.peak_taken.connect(presenter.take_peak)
        detail.best_asked.connect(presenter.go_best)
        detail.main_asked.connect(presenter.main)
        detail.recapture.clicked.connect(presenter.recapture)
        detail.turn_asked.connect(presenter.turn)
        detail.paint_asked.connect(presenter.paint)
        detail.numbers_asked.connect(presenter.show_numbers)
        detail.renamed.connect(presenter.files.rename)
        detail.laid.connect(self._detail_laid)

    def take_focus(self) -> None:
        """Focus the chosen card, or the screen if no card is chosen yet."""
        self.setFocus()
        self.gallery.focus_card()

    def show_state(self, state: StylesState) -> None:
        """Show a `StylesState`."""
        self.gallery.show_state(state)
        self.detail.show_state(state.detail)
        self.detail.show_clipped(state.clipped)
        self.detail.show_numbers(state.numbers)
        if isinstance(self.sheet, LensSheet):
            self.sheet.show_state(state.lens)
        if isinstance(self.sheet, LampsSheet):
            self.sheet.show_state(state.lamps)
            if not state.busy and state.lamps != self._ready_for:
                self._ready_for = state.lamps
                self._presenter.lamps.prepare()

    def show_compared(self, states: tuple[DetailState, ...]) -> None:
        """Show the marked styles side by side in a sheet over the screen."""
        sheet = CompareSheet(self.window(), states)
        sheet.opened.connect(sheet.shut)
        sheet.opened.connect(self._presenter.open)
        self.put_over(sheet)

    def ask_photo(self) -> None:
        """Ask for a photo whose light is to become a style."""
        path = ask_file(self, tr("Like this photo"), PHOTO_FILTER)
        if path is not None:
            self._presenter.like.take([path])

    def show_like(self, state: LikeState) -> None:
        """Show the light in a photo in a sheet over the screen."""
        if not isinstance(self.sheet, LikeSheet):
            self.put_over(LikeSheet(self.window(), self._presenter.like))
        if isinstance(self.sheet, LikeSheet):
            self.sheet.show_state(state)

    def ask_lens(self) -> None:
        """Open the sheet for the camera position below its button."""
        presenter = self._presenter
        lens, lamps = self.gallery.lens, self.gallery.lamps
        under = lens if lens.isVisible() else lamps
        sheet = LensSheet(self.window(), under, presenter.lens.background_now)
        sheet.chosen.connect(presenter.lens.choose)
        sheet.background_chosen.connect(presenter.lens.choose_background)
        self.put_over(sheet)
        self.show_state(presenter.resolve())

    def _ask_lamps(self) -> None:
        """Open the sheet for the lamps below its button."""
        sheet, self._ready_for = LampsSheet(self.window(), self.gallery.lamps), None
        sheet.chosen.connect(self._presenter.lamps.choose)
        sheet.kept_to_style.connect(self._presenter.lamps.keep_to_style)
        self.put_over(sheet)
        self.show_state(self._presenter.resolve())

    def ask_name(self, title: str) -> None:
        """Let the user edit the name of the style."""
        self.detail.ask_name(title)

    def show_trouble(self, sentence: str) -> None:
        """Show why the name is invalid, or close the field if the sentence is empty."""
        self.detail.show_trouble(sentence)

    def ask_file(self, what: FileWish, suggested: str) -> None:
        """Ask for a file, and pass it to the presenter."""
        files = self._presenter.files
        if what == "save_sheet":
            path = ask_target(self, tr("Save set sheet"), suggested, "PDF (*.pdf);;PNG (*.png)")
        elif what == "export":
            path = ask_target(self, tr("Export style"), suggested, _STYLE_FILES)
        else:
            path = ask_file(self, tr("Import style"), _STYLE_FILES)
        takers = {
            "save_sheet": files.save_sheet,
            "export": files.export,
            "import_style": files.import_style,
        }
        if path is not None:
            takers[what](path)

    def show_folder(self, folder: Path) -> None:
        """Open a folder in the system's file manager."""
        show_folder(folder)

    def copy(self, text: str) -> None:
        """Copy text to the clipboard."""
        QApplication.clipboard().setText(text)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Set the width of the details."""
        self.detail.setFixedWidth(detail_width(self.width(), self.height(), self._compact))
        super().resizeEvent(event)

    def showEvent(self, event: QShowEvent) -> None:
        """Focus the cards, unless another widget has the focus."""
        super().showEvent(event)
        focus = QApplication.focusWidget()
        if focus is None or not focus.isVisible():
            self.gallery.focus_card()

    def event(self, event: QEvent) -> bool:
        """Render the pictures again when the screen's pixel density changes."""
        if event.type() == QEvent.Type.DevicePixelRatioChange:
            self._later.start()
        return super().event(event)

    def _detail_laid(self, portrait: QSize, background: QSize) -> None:
        self._resized("portrait", portrait)
        self._resized("background", background)

    def _resized(self, what: str, size: QSize) -> None:
        if self._logical.get(what) != size:
            self._logical[what] = size
            self._later.start()

    def _set_sizes(self) -> None:
        dpr = self.devicePixelRatioF()

        def pixels(what: str, usual: tuple[int, int]) -> tuple[int, int]:
            size = self._logical.get(what)
            if size is None or size.isEmpty():
                return usual
            return round(size.height() * dpr), round(size.width() * dpr)

        compared = compared_size(self.window(), 2) * dpr
        usual = self._sizes
        self._sizes = Sizes(
            pixels("card", usual.card),
            pixels("portrait", usual.portrait),
            pixels("background", usual.background),
            (compared.height(), compared.width()),
        )
        self._presenter.sized(self._sizes)
