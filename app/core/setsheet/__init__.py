"""The set sheet: one printed page that says how to stand for one style at one place."""

from app.core.setsheet.assemble import assemble, lamps_of
from app.core.setsheet.data import SetSheet, SheetLamp
from app.core.setsheet.output import write_pdf, write_png
from app.core.setsheet.page import draw

__all__ = [
    "SetSheet",
    "SheetLamp",
    "assemble",
    "draw",
    "lamps_of",
    "write_pdf",
    "write_png",
]
