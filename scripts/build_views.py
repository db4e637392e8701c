"""Bake how shipped heads look from the side: ``resources/transport/NAME.views.npz``.

    python scripts/build_views.py [--heads NAME ...] [-o FOLDER]

Takes some ten minutes for each head and skin on two cores, and needs LLVM (see CONTRIBUTING).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Final

import numpy as np

_KINDS: Final = {"pixels": np.int32}
_ROOT: Final = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(_ROOT))

from app.core.baking.bake import bake_views  # noqa: E402
from app.core.baking.baked_view import BakedView, packed_views  # noqa: E402
from app.core.baking.kernel_lanes import select_variant  # noqa: E402
from app.core.baking.quality import QUALITIES  # noqa: E402
from app.core.baking.scene import load_head  # noqa: E402
from app.core.baking.skin import find_skin  # noqa: E402
from app.core.base.paths import resources  # noqa: E402
from app.core.base.progress import Token  # noqa: E402
from app.core.portrait.head_views import YAWS, save_views, views_path  # noqa: E402
from app.core.solver.transport import Transport, load_named, transport_names  # noqa: E402
from app.core.styles.styles import load_styles  # noqa: E402


def main() -> None:
    """Bake what is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--heads", nargs="+", default=transport_names())
    parser.add_argument("--quality", default="good", choices=QUALITIES)
    parser.add_argument("--work", type=Path, help="folder for whole matrices, kept and used again")
    parser.add_argument("-o", type=Path, default=resources() / "transport")
    args = parser.parse_args()
    select_variant("llvm")
    for name in args.heads:
        front = load_named(name)
        views = list(_baked(name, front, args))
        path = views_path(args.o / f"{name}.npz")
        save_views(path, front, *packed_views(views, front))
        print(f"{name}: {path.stat().st_size / 1e6:.2f} MB", flush=True)


def _baked(name: str, front: Transport, args: argparse.Namespace) -> Iterator[BakedView]:
    """Bake the views of a head, or take those that are kept."""
    header = front.header
    work = args.work or args.o / f"{name}.bake"
    kept = [work / f"{name}.yaw{yaw:g}.npz" for yaw in YAWS]
    if all(file.exists() for file in kept):
        for yaw, file in zip(YAWS, kept, strict=True):
            arrays = np.load(file, allow_pickle=False)
            yield BakedView(
                yaw,
                **{
                    each: arrays[each].astype(_KINDS.get(each, np.float32)) for each in arrays.files
                },
            )
        return
    files = (resources() / "heads" / f"{header.head}{end}.ply" for end in ("", "-eyes"))
    found = bake_views(
        load_head(header.head, *files),
        find_skin(header.skin),
        load_styles(),
        environment=header.environment,
        picture=header.picture,
        quality=QUALITIES[args.quality],
        seed=7,
        work=work,
        report=lambda share, what: print(f"{name} {share:.0%} {what}", flush=True),
        token=Token(),
        yaws=YAWS,
    )
    for view in found:
        arrays = {each.name: getattr(view, each.name) for each in fields(view)}
        del arrays["yaw_deg"]
        work.mkdir(parents=True, exist_ok=True)
        np.savez(
            work / f"{name}.yaw{view.yaw_deg:g}.npz",
            **(arrays | {"matrix": view.matrix.astype(np.float16)}),
        )
        yield view


if __name__ == "__main__":
    main()
