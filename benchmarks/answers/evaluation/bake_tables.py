"""Make the tables of the evaluation: sizes of the generic head, and heads that do not ship."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from app.core.baking.scene import load_head
from app.core.baking.skin import find_skin
from app.core.base.progress import span
from benchmarks.answers.evaluation.evaluate import ENVIRONMENTS, PICTURES
from benchmarks.answers.evaluation.preintegrate import Effort, preintegrate_styles
from benchmarks.answers.evaluation.tables import TableNote, Tables, styles_digest

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from app.core.base.progress import PhraseReport, Token
    from app.core.styles.style import Style

_OWN_ENVIRONMENT: Final = (32, 64)
_OWN_PICTURE: Final = 100
_SKIN: Final = "medium"
_SEED: Final = 1
_SIZES: Final = Effort()
# Few pixels: each counts, above all those with the catchlights.
_HEADS: Final = Effort(target_paths=128, paths=768, glints=8, shadows=2, block=1)


@dataclass(frozen=True, slots=True)
class HeadFiles:
    """The files of one head."""

    name: str
    skin: Path
    eyes: Path | None
    unit_mm: float = field(default=100.0)


def bake_tables(
    generic: HeadFiles,
    others: Sequence[HeadFiles],
    styles: Sequence[Style],
    *,
    report: PhraseReport,
    token: Token,
) -> Tables:
    """Make the tables of the evaluation.

    Raises:
        HeadError: If a head cannot be used.
        BakeError: If Mitsuba does not work here.
        Cancelled: If the token was cancelled.
    """
    parts = len(others) + 3  # the large one takes about as long as three others
    sizes, note = _table(
        generic, styles, ENVIRONMENTS[-1], PICTURES, _SIZES, span(report, 0.0, 3 / parts), token
    )
    heads: dict[str, NDArray[np.float32]] = {}
    notes: dict[str, TableNote] = {}
    for number, files in enumerate(others):
        part = span(report, (3 + number) / parts, (4 + number) / parts)
        rows, notes[files.name] = _table(
            files, styles, _OWN_ENVIRONMENT, (_OWN_PICTURE,), _HEADS, part, token
        )
        heads[files.name] = rows[0]
    return Tables(
        styles=tuple(style.name for style in styles),
        styles_sha256=styles_digest(styles),
        pictures=PICTURES,
        sizes=sizes,
        sizes_note=note,
        heads=heads,
        head_notes=notes,
    )


def _table(
    files: HeadFiles,
    styles: Sequence[Style],
    environment: tuple[int, int],
    pictures: Sequence[int],
    effort: Effort,
    report: PhraseReport,
    token: Token,
) -> tuple[NDArray[np.float32], TableNote]:
    head = load_head(files.name, files.skin, files.eyes, unit_mm=files.unit_mm)
    made = preintegrate_styles(
        head,
        find_skin(_SKIN),
        styles,
        environment=environment,
        pictures=pictures,
        effort=effort,
        seed=_SEED,
        report=report,
        token=token,
    )
    return made.rows, TableNote(
        head=files.name,
        skin=_SKIN,
        head_sha256=_hash(files),
        settings=_settings(effort, environment, max(pictures)),
        noise=made.noise,
    )


def _settings(effort: Effort, environment: tuple[int, int], picture: int) -> str:
    return (
        f"{picture} × {picture} pixels, {environment[1]} × {environment[0]} texels; "
        f"{effort.target_paths} paths a pixel for targets, {effort.paths} from one pixel in "
        f"{effort.block**2} for F; seed {_SEED}"
    )


def _hash(files: HeadFiles) -> str:
    total = hashlib.sha256(files.skin.read_bytes())
    if files.eyes is not None:
        total.update(files.eyes.read_bytes())
    return total.hexdigest()
