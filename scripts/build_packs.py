"""Make the style packs of all shipped heads again from their transports and the style files.

Usage::

    python scripts/build_packs.py [--head NAME ...] [--fresh]

Needed after a change of styles, signatures or areas. Baked target pictures are kept where a style's
lamps are as they were. A style without one gets a picture from the transport, its lamps far away
and of 10 degrees or more: smaller ones do not fill a texel, and need ``turnlight bake``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

_ROOT: Final = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(_ROOT))

from app.core.base.archive import read_sealed  # noqa: E402
from app.core.base.errors import CoreError  # noqa: E402
from app.core.base.paths import resources  # noqa: E402
from app.core.solver.head_shape import load_shape_of  # noqa: E402
from app.core.solver.transport import (  # noqa: E402
    Transport,
    load_transport,
    render,
    transport_names,
    transport_path,
)
from app.core.styles.lamps import far_lamp  # noqa: E402
from app.core.styles.style import Style, StyleLamp  # noqa: E402
from app.core.styles.style_pack import PACK_VERSION  # noqa: E402
from app.core.styles.style_pack_build import build_pack  # noqa: E402
from app.core.styles.style_pack_file import pack_path, restore, save_pack  # noqa: E402
from app.core.styles.styles import load_styles  # noqa: E402

if TYPE_CHECKING:
    from app.core.base.arrays import Float64

_LEAST_DEG: Final = 10.0


def rendered_target(transport: Transport, style: Style) -> Float64:
    """(P, 3) picture of a style on the head's pixels, under its lamps far away.

    Raises:
        CoreError: If a lamp is too small for the transport's texels.
    """
    if any(lamp.diameter_deg < _LEAST_DEG for lamp in style.lamps):
        raise CoreError(
            f"A lamp of {style.name} is smaller than {_LEAST_DEG:g} degrees.",
            "Bake the heads again with 'turnlight bake'.",
        )
    lamps = [far_lamp(lamp, transport.environment_shape) for lamp in style.lamps]
    light = np.sum(lamps, axis=0)
    return render(transport, np.repeat(light[..., None], 3, axis=2)).astype(np.float64)


def baked_targets(
    pack: Path, transport: Transport
) -> dict[str, tuple[tuple[StyleLamp, ...], Float64]]:
    """Lamps and (P, 3) target pictures in a pack, by style; of any version and any areas."""
    if not pack.is_file():
        return {}
    facts, arrays = read_sealed(pack, "style pack", "", PACK_VERSION, restore=restore)
    flat = arrays["targets"].reshape(len(facts["styles"]), -1, 3)[:, transport.pixels]
    return {
        entry["name"]: (tuple(StyleLamp(**lamp) for lamp in entry["lamps"]), picture)
        for entry, picture in zip(facts["styles"], flat.astype(np.float64), strict=True)
    }


def rebuild(head: str, *, fresh: bool = False) -> tuple[list[str], int]:
    """Make one head's pack again.

    Args:
        fresh: Whether all targets are rendered, for a look at how far that is from baked ones.

    Returns:
        The styles that were rendered, and the size of the pack, bytes.
    """
    path = transport_path(head)
    transport, styles, pack = load_transport(path), load_styles(), pack_path(path)
    known = {} if fresh else baked_targets(pack, transport)
    pictures, rendered = [], []
    for style in styles:
        lamps, picture = known.get(style.name, ((), None))
        if picture is None or lamps != style.lamps:
            picture = rendered_target(transport, style)
            rendered.append(style.name)
        pictures.append(picture)
    shape = load_shape_of(transport, head)
    save_pack(pack, build_pack(transport, styles, np.stack(pictures), shape))
    return rendered, pack.stat().st_size


def main() -> None:
    """Make the packs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--head", action="append", choices=transport_names())
    parser.add_argument("--fresh", action="store_true", help="render all targets")
    args = parser.parse_args()
    for head in args.head or transport_names():
        rendered, size = rebuild(head, fresh=args.fresh)
        told = ", ".join(rendered) or "none"
        sys.stdout.write(f"{head}: {size / 1e6:.2f} MB; rendered: {told}\n")
        sys.stdout.flush()
    total = sum(file.stat().st_size for file in (resources() / "transport").glob("*.npz"))
    sys.stdout.write(f"All transports and packs: {total / 1e6:.1f} MB\n")


if __name__ == "__main__":
    main()
