"""``turnlight styles``: list the styles and their lamps, or create a style from a photo."""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path

from app.commands.shared.arguments import add_json, argument
from app.commands.shared.printing import answer, fields
from app.core.base.errors import StyleError
from app.core.base.paths import user_data
from app.core.faces.finder import find_faces
from app.core.faces.light_from_face import read_light
from app.core.localization.photo_location import read_photo
from app.core.painting.photo_style import photo_lamps, photo_style
from app.core.painting.user_styles import add
from app.core.storage.item_library import one_line
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_pack_file import load_named_pack, load_transport_of
from app.core.styles.styles import load_styles
from app.core.text import tr
from app.words.styles import photo_note, photo_title, side_words


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``styles``."""
    parser.description = tr("List the lighting styles and the positions of their lamps.")
    add_json(parser, run)
    actions = parser.add_subparsers(metavar="ACTION", dest="action")
    words = tr("Create a style from the light on a face in a photo.")
    like = actions.add_parser(
        "add",
        help=tr("create a style from the light on a face in a photo"),
        description=tr(
            "{words} It is saved with your own styles. The photo stays on this computer "
            "and is not saved.",
            words=words,
        ),
    )
    argument(
        like,
        "--from PICTURE",
        tr("JPEG, PNG, TIFF or WebP; the largest face is used"),
        type=Path,
        required=True,
        dest="picture",
    )
    argument(
        like,
        "--mirrored",
        tr("the photo is mirrored, which is how some phones save selfies"),
        action="store_true",
    )
    argument(like, "--title TITLE", tr("title of the style (default: Like PICTURE)"), default="")
    add_json(like, run_add)


def run(args: argparse.Namespace) -> int:
    """Print the styles."""
    styles = load_styles(user_data() / "styles")
    return answer(args, as_json(styles), as_table(styles))


def run_add(args: argparse.Namespace) -> int:
    """Create a style from a photo, save the style and print it."""
    photo = read_photo(args.picture)
    photo = photo.flipped if args.mirrored else photo
    faces = find_faces(photo.picture)
    if not faces:
        raise StyleError(
            tr("No face in this photo can be read."),
            tr("Choose a photo of someone looking into the lens."),
        )
    light = read_light(photo.picture, faces[0], photo.focal_px)
    pack = load_named_pack("generic")
    transport = load_transport_of(pack, "generic")
    name = args.picture.stem
    title = one_line(args.title or "") or photo_title(one_line(name))
    style = photo_style(light, pack, transport, name, title, photo_note(photo_lamps(light)))
    own_style = add(user_data() / "styles", style)
    facts = {
        **fields(own_style, "name", "title", "side"),
        "side_words": side_words(own_style),
        "note": own_style.note,
        "lamps": [dataclasses.asdict(lamp) for lamp in photo_lamps(light)],
    }
    words = tr(
        "“{title}” was added to your styles. {note}", title=own_style.title, note=own_style.note
    )
    return answer(args, {"style": facts}, words)


def as_json(styles: Sequence[Style]) -> dict[str, list[dict[str, object]]]:
    """Return styles as JSON.

    Returns:
        ``{"styles": [{name, title, side, side_words, note, lamps, paper}]}``. Angles are in
        degrees, and azimuths are positive towards the sitter's left.
    """
    return {
        "styles": [
            {
                **fields(style, "name", "title", "side"),
                "side_words": side_words(style),
                "note": style.note,
                "lamps": [dataclasses.asdict(lamp) for lamp in style.lamps],
                "paper": style.paper,
            }
            for style in styles
        ]
    }


def as_table(styles: Sequence[Style]) -> str:
    """Format styles as a table, one line per lamp."""
    light, names = tr("light from"), (tr("azimuth"), tr("elev."), tr("size"), tr("power"))
    lines = ["{:<18}{:<32}{:>8}{:>7}{:>6}{:>7}".format(tr("name"), light, *names)]
    for style in styles:
        for index, lamp in enumerate(style.lamps):
            start = ("", "") if index else (style.name, side_words(style))
            lines.append(f"{start[0]:<18}{start[1]:<32}{_lamp_cells(lamp)}")
    lines.append("")
    lines.append(tr("Degrees from the face: azimuth + towards the sitter’s left, elevation + up."))
    return "\n".join(lines)


def _lamp_cells(lamp: StyleLamp) -> str:
    # Use the typographic minus, as on screen.
    azimuth = f"{lamp.azimuth_deg:+.0f}°".replace("-", "−") if lamp.azimuth_deg else "0°"
    elevation = f"{lamp.elevation_deg:+.0f}°".replace("-", "−") if lamp.elevation_deg else "0°"
    return f"{azimuth:>8}{elevation:>7}{lamp.diameter_deg:>5.0f}°{lamp.power:>7g}"
