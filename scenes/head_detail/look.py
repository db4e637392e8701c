"""Render the detailed head to a PNG: ``python -m scenes.head_detail.look --help``."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

from app.core.baking.kernel_lanes import select_variant


def main() -> int:
    """Command line entry."""
    parser = argparse.ArgumentParser(description="Render a detailed head.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--head", default="generic", choices=("generic", "female", "male"))
    parser.add_argument("--hair", default="hair-short", help="hair-short, hair-long or none")
    parser.add_argument("--light", default="softbox", choices=("softbox", "cafe"))
    parser.add_argument("--height", type=int, default=640)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--beard", action="store_true", help="the shadow of a shaved beard")
    parser.add_argument("--turn", type=float, default=0.0, help="degrees to the head's left")
    args = parser.parse_args()
    mi = select_variant("llvm")
    from scenes.head_detail.scene import portrait_scene

    started = time.monotonic()
    hair = None if args.hair == "none" else args.hair
    scene = portrait_scene(
        args.head, hair, args.light, args.height, args.samples, beard=args.beard, turn=args.turn
    )
    built = time.monotonic()
    picture = np.array(
        mi.Bitmap(mi.render(scene)).convert(srgb_gamma=True, component_format=mi.Struct.Type.UInt8)
    )
    cv2.imwrite(str(args.out), picture[..., ::-1])
    print(f"built in {built - started:.0f} s, rendered in {time.monotonic() - built:.0f} s")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
