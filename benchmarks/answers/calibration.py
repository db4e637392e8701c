"""Attainable styles by place: a table and a contact sheet of every style in every scene.

    python benchmarks/answers/calibration.py --scenes FOLDER [-o PAGE.md]

Writes the table as Markdown and the pictures as ``results/calibration.png`` beside it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from app.core.base.atomic_files import atomic_write_text
from app.core.base.imaging.images import write_png
from app.core.environment.environment import Environment, read_environment, reduce
from app.core.portrait.display_pictures import greyed, panorama
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import load_named, render, to_image
from app.core.styles.style_pack_file import load_named_pack
from app.export.canvas import Page
from app.export.theme import Dark
from benchmarks.speed.plain_portrait import portrait

ROOT = Path(__file__).resolve().parents[2]

CELL, GAP, HEAD, LEFT = 62, 4, 30, 170
BEGIN, END = "<!-- table: benchmarks/answers/calibration.py -->", "<!-- end of table -->"


def solve_scenes(scenes: Path) -> dict[str, tuple[Environment, tuple[StyleResult, ...]]]:
    """Solve all panoramas in a folder for all styles."""
    pack = load_named_pack("generic")
    solved = {}
    for file in sorted([*scenes.glob("*.hdr"), *scenes.glob("*.exr")]):
        environment = read_environment(file)
        solved[file.stem.removesuffix("_1k")] = (
            environment,
            solve_all(pack, reduce(environment)),
        )
    return solved


def contact_sheet(solved: dict[str, tuple[Environment, tuple[StyleResult, ...]]]) -> np.ndarray:
    """Draw one row per scene: the panorama, then every style at its best turn, grey if out."""
    pack, transport = load_named_pack("generic"), load_named("generic")
    coverage = pack.coverage.astype(np.float32)
    styles = pack.styles
    canvas = Page(
        LEFT + len(styles) * (CELL + GAP) + 16,
        HEAD + (len(solved) + 1) * (CELL + GAP + 14) + 16,
        Dark.BG,
    )
    top = HEAD
    for column, style in enumerate(styles):
        x = LEFT + column * (CELL + GAP)
        words = style.name.replace("left-", "L ").replace("right-", "R ").replace("-", " ")
        canvas.text((x, HEAD - 10), words, 9, 400, Dark.TEXT)
        _put(canvas, (x, top), portrait(pack.target(style.name), coverage, (2 * CELL, 2 * CELL)))
    canvas.text((16, top + CELL / 2), "studio", 11, 400, Dark.TEXT)
    for name, (environment, results) in solved.items():
        top += CELL + GAP + 14
        canvas.text((16, top + 78), name.replace("_", " "), 9, 400, Dark.DIM)
        _put(canvas, (16, top), panorama(environment, 0.0, (2 * CELL, 4 * CELL)))
        for column, result in enumerate(results):
            light = reduce(environment, transport.environment_shape, result.turn_refined_deg)
            picture = to_image(transport, render(transport, light))
            shown = portrait(picture, coverage, (2 * CELL, 2 * CELL))
            x = LEFT + column * (CELL + GAP)
            _put(canvas, (x, top), shown if result.attainable else greyed(shown))
            words = f"{result.match:.0f} / {result.strength:.0f}"
            tone = Dark.TEXT if result.attainable else Dark.DIM
            canvas.text((x, top + CELL + 10), words, 9, 400, tone)
    return canvas.pixels


def _put(canvas: Page, at: tuple[float, float], display: np.ndarray) -> None:
    height, width = display.shape[0] / 2, display.shape[1] / 2
    canvas.picture((at[0], at[1], width, height), np.ascontiguousarray(display, np.float32))


def table(solved: dict[str, tuple[Environment, tuple[StyleResult, ...]]]) -> str:
    """Return a Markdown table of match / strength, in bold where attainable."""
    names = [result.name for result in next(iter(solved.values()))[1]]
    lines = ["| scene | " + " | ".join(names) + " | in reach |", "|---" * (len(names) + 2) + "|"]
    counts = np.zeros(len(names), int)
    for scene, (_, results) in solved.items():
        cells = []
        for number, result in enumerate(results):
            words = f"{result.match:.0f} / {result.strength:.0f}"
            cells.append(f"**{words}**" if result.attainable else words)
            counts[number] += result.attainable
        reach = sum(result.attainable for result in results)
        lines.append(f"| {scene} | " + " | ".join(cells) + f" | {reach} |")
    share = " | ".join(f"{count} of {len(solved)}" for count in counts)
    lines.append(f"| attainable | {share} | |")
    return "\n".join(lines)


def main() -> None:
    """Solve, draw, and insert the table into the page between its markers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, required=True)
    parser.add_argument("-o", type=Path, default=ROOT / "benchmarks" / "calibration.md")
    args = parser.parse_args()
    solved = solve_scenes(args.scenes)
    page = args.o.read_text(encoding="utf-8") if args.o.exists() else f"{BEGIN}\n{END}\n"
    before, rest = page.split(BEGIN)
    after = rest.split(END)[1]
    atomic_write_text(args.o, f"{before}{BEGIN}\n{table(solved)}\n{END}{after}")
    results = args.o.parent / "results"
    results.mkdir(exist_ok=True)
    sheet = contact_sheet(solved)
    write_png(results / "calibration.png", sheet)
    print(table(solved))


if __name__ == "__main__":
    main()
