"""The set sheet: one printed page that says how to stand for one style at one place."""

from app.export.set_sheet.assemble import assemble, lamps_of
from app.export.set_sheet.data import SetSheet, SheetLamp
from app.export.set_sheet.output import write_pdf, write_png
from app.export.set_sheet.page import draw

__all__ = [
    "SetSheet",
    "SheetLamp",
    "assemble",
    "draw",
    "lamps_of",
    "write_pdf",
    "write_png",
]
