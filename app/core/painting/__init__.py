"""Painting target weights on the head: brush, canvas, undo, live answers, and styles to keep."""

from app.core.painting.brush import Brush, Tool
from app.core.painting.canvas import (
    NOTHING_PAINTED,
    ONE_SIDED,
    Canvas,
    Region,
    advice,
    blank,
    canvas_size,
    make_canvas,
)
from app.core.painting.drafts import (
    Draft,
    bring_draft_back,
    find_draft,
    load_draft,
    put_draft_away,
    save_draft,
)
from app.core.painting.exchange import EXPORT_ENDING, export_style, import_style
from app.core.painting.gallery import (
    Asking,
    light_side,
    prepare_user_style,
    solve_user_styles,
    suggested_side,
    target_picture,
)
from app.core.painting.library import (
    CANNOT_READ,
    DamagedStyle,
    Trashed,
    delete,
    duplicate,
    list_user_styles,
    rename,
    restore,
    save_user_style,
    update_user_style,
)
from app.core.painting.session import Answer, PaintSession
from app.core.painting.start import from_style, from_user_style, from_weights
from app.core.painting.stroke import Stroke
from app.core.painting.tiles import TileChange, apply, cleared, difference, revert
from app.core.painting.user_style import UserStyle, read_user_style, text_path

__all__ = [
    "CANNOT_READ",
    "EXPORT_ENDING",
    "NOTHING_PAINTED",
    "ONE_SIDED",
    "Answer",
    "Asking",
    "Brush",
    "Canvas",
    "DamagedStyle",
    "Draft",
    "PaintSession",
    "Region",
    "Stroke",
    "TileChange",
    "Tool",
    "Trashed",
    "UserStyle",
    "advice",
    "apply",
    "blank",
    "bring_draft_back",
    "canvas_size",
    "cleared",
    "delete",
    "difference",
    "duplicate",
    "export_style",
    "find_draft",
    "from_style",
    "from_user_style",
    "from_weights",
    "import_style",
    "light_side",
    "list_user_styles",
    "load_draft",
    "make_canvas",
    "prepare_user_style",
    "put_draft_away",
    "read_user_style",
    "rename",
    "restore",
    "revert",
    "save_draft",
    "save_user_style",
    "solve_user_styles",
    "suggested_side",
    "target_picture",
    "text_path",
    "update_user_style",
]
