"""The result sheet: one picture that shows what a place can do, for print, mail and notebooks."""

from app.export.result_sheet.page import draw_sheet

__all__ = ["draw_sheet"]
