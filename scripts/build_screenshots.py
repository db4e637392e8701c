"""Make the pictures of the app in docs/images/app and of its tour: walk through the demo.

python scripts/build_screenshots.py        takes about three minutes
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs" / "images" / "app"
QUALITY = 88
WANTED = {
    "dark": (
        "probe-empty",
        "probe",
        "styles",
        "styles-out-of-reach",
        "paint",
        "turn",
        "turn-in-the-light",
        "light",
        "places",
        "find",
        "styles-narrow",
    ),
    "light": ("styles",),
    "contrast": ("turn",),
}
"""Which pictures of which theme the documents show."""
TOUR = ROOT / "resources" / "tour"
STEPS = {"probe": "probe", "styles": "styles", "turn": "turn", "paint": "paint", "light": "light"}
"""Of the tour: its pictures by name, and the pictures of the walk that they are made from."""
TOUR_SIZE, TOUR_QUALITY = (1280, 800), 76


def walk(theme: str, folder: Path) -> None:
    """Make all pictures in one theme."""
    environment = {**os.environ, "TURNLIGHT_HOME": str(folder / "home")}
    command = [sys.executable, "-m", "app", "--demo", "--screenshots", str(folder)]
    subprocess.run([*command, "--theme", theme], cwd=ROOT, env=environment, check=True)


def keep(theme: str, name: str, folder: Path) -> None:
    """Keep one of them, compressed."""
    (found,) = folder.glob(f"[0-9][0-9]-{name}.png")
    picture = cv2.imread(str(found))
    assert picture is not None
    target = FOLDER / f"{name}-{theme}.webp"
    cv2.imwrite(str(target), picture, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size // 1024} KiB")


def keep_for_tour(theme: str, name: str, walked: str, folder: Path) -> None:
    """Keep one of them as a page of the tour."""
    (found,) = folder.glob(f"[0-9][0-9]-{walked}.png")
    picture = cv2.imread(str(found))
    assert picture is not None
    small = cv2.resize(picture, TOUR_SIZE, interpolation=cv2.INTER_AREA)
    target = TOUR / f"{name}-{theme}.webp"
    cv2.imwrite(str(target), small, [cv2.IMWRITE_WEBP_QUALITY, TOUR_QUALITY])
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size // 1024} KiB")


def main() -> None:
    """Make every picture of the documents and of the tour anew."""
    for made in (FOLDER, TOUR):
        made.mkdir(parents=True, exist_ok=True)
    for theme, names in WANTED.items():
        with tempfile.TemporaryDirectory() as folder:
            walk(theme, Path(folder))
            for name in names:
                keep(theme, name, Path(folder))
            for name, walked in STEPS.items():
                keep_for_tour(theme, name, walked, Path(folder))


if __name__ == "__main__":
    main()
