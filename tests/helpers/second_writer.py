"""Another process that changes what the first one has open: python -m tests.helpers.second_writer.

place FOLDER NAME, settings FILE KEY VALUE, style FOLDER, draft FILE, add FOLDER TITLE COUNT.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from app.core.painting.canvas import Canvas, make_canvas
from app.core.painting.draft_file import Draft, save_draft
from app.core.painting.user_styles import list_user_styles, save_user_style, update_user_style
from app.core.places.place_folder import change_place
from app.core.storage.settings_file import read_settings, write_settings


def painted(value: float) -> Canvas:
    """Paint one value on one half of the face."""
    layer = np.zeros((256, 256), np.float32)
    layer[:, 128:] = value
    zero = np.zeros_like(layer)
    return make_canvas(layer, zero, zero, zero)


def main(what: str, where: Path, *words: str) -> None:
    """Change one thing."""
    if what == "place":
        change_place(where, name=words[0])
    elif what == "settings":
        settings, _ = read_settings(where)
        write_settings(where, settings.with_(words[0], words[1]), settings)
    elif what == "style":
        update_user_style(where, list_user_styles(where)[0][0], painted(0.5))
    elif what == "draft":
        save_draft(where, Draft(painted(0.5), title="theirs"))
    elif what == "add":
        for _ in range(int(words[1])):
            save_user_style(where, painted(float(words[2])), words[0])


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
