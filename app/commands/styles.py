"""``turnlight styles``: which styles there are, and where their lamps stand."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence

from app.commands.arguments import add_json
from app.commands.printing import answer, fields
from app.core.base.paths import user_data
from app.core.solver.styles import Style, StyleLamp, load_styles
from app.core.text import tr


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``styles`` does and takes."""
    parser.description = tr("List the lighting styles and where their lamps stand.")
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Print the styles."""
    styles = load_styles(user_data() / "styles")
    return answer(args, as_json(styles), as_table(styles))


def as_json(styles: Sequence[Style]) -> dict[str, list[dict[str, object]]]:
    """Describe styles as plain data.

    Returns:
        ``{"styles": [{name, title, side, side_words, note, lamps, paper}]}``, angles in degrees,
        azimuth positive toward the sitter's left.
    """
    return {
        "styles": [
            {
                **fields(style, "name", "title", "side", "side_words", "note"),
                "lamps": [dataclasses.asdict(lamp) for lamp in style.lamps],
                "paper": style.paper,
            }
            for style in styles
        ]
    }


def as_table(styles: Sequence[Style]) -> str:
    """Lay styles out for reading, one line per lamp."""
    light, names = tr("light from"), (tr("azimuth"), tr("elev."), tr("size"), tr("power"))
    lines = ["{:<18}{:<32}{:>8}{:>7}{:>6}{:>7}".format(tr("name"), light, *names)]
    for style in styles:
        for index, lamp in enumerate(style.lamps):
            start = ("", "") if index else (style.name, style.side_words)
            lines.append(f"{start[0]:<18}{start[1]:<32}{_lamp_cells(lamp)}")
    lines.append("")
    lines.append(tr("Degrees from the face: azimuth + toward the sitter’s left, elevation + up."))
    return "\n".join(lines)


def _lamp_cells(lamp: StyleLamp) -> str:
    # Typographic minus, as on screen.
    azimuth = f"{lamp.azimuth_deg:+.0f}°".replace("-", "−") if lamp.azimuth_deg else "0°"
    elevation = f"{lamp.elevation_deg:+.0f}°".replace("-", "−") if lamp.elevation_deg else "0°"
    return f"{azimuth:>8}{elevation:>7}{lamp.diameter_deg:>5.0f}°{lamp.power:>7g}"
