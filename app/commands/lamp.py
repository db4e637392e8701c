"""``turnlight lamp``: manage the library of lamps captured in a dark room."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any, TypeAlias

from app.commands.shared.arguments import add_json, argument
from app.commands.shared.printing import ProgressPrinter, answer, fields, say
from app.core.base.errors import CoreError
from app.core.measure.finish.masks import parse_mask
from app.core.measure.options import MeasureOptions
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, centroid
from app.core.second_light.captured_lamps.lamp_capture import capture_lamp
from app.core.second_light.captured_lamps.lamp_library import (
    add_lamp,
    check_distance,
    delete_lamp,
    lamps_folder,
    list_lamps,
    read_lamp,
    rename_lamp,
    restate_lamp,
    update_lamp,
)
from app.core.second_light.captured_lamps.lamp_mask import edit_mask
from app.core.second_light.place_brightness import compare, with_lux
from app.core.text import tr
from app.words.lamps import GUIDE, comparison_words, damage_words, mask_notes, mask_warnings
from app.words.remarks import sentences

_Box: TypeAlias = tuple[float, float, float, float]

_ANY_WHITE = 1.0  # placeholder for a known brightness when only the lamp is being checked


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``lamp``."""
    parser.description = tr(
        "Capture a lamp once in a dark room, then use it as a second light anywhere."
    )
    actions = parser.add_subparsers(metavar="ACTION", dest="action", required=True)
    _add_words(actions)
    guide = actions.add_parser("guide", help=tr("how to capture a lamp, step by step"))
    list_parser = actions.add_parser("list", help=tr("list the lamps"))
    change = actions.add_parser("change", help=tr("change a lamp’s title, distance or brightness"))
    argument(change, "name NAME", tr("a lamp in the library"))
    argument(change, "--title TITLE", tr("the new title"))
    _add_measures(change)
    mask = actions.add_parser("mask", help=tr("correct the lamp’s mask in its capture"))
    argument(mask, "name NAME", tr("a lamp in the library"))
    _add_masks(mask)
    remove_parser = actions.add_parser("remove", help=tr("move a lamp to the trash"))
    argument(remove_parser, "name NAME", tr("a lamp in the library"))
    jobs = (
        (guide, _guide),
        (list_parser, _list),
        (change, _change),
        (mask, _mask),
        (remove_parser, _remove),
    )
    for each, job in jobs:
        add_json(each, job)


def _add_measures(parser: argparse.ArgumentParser) -> None:
    argument(parser, "--distance M", tr("distance from the camera to the lamp, in metres"))
    argument(parser, "--lux E", tr("light meter reading at the camera"))


def _add_words(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    words = tr("Create a lamp from a bracket shot in a dark room.")
    add = actions.add_parser(
        "add",
        help=tr("create a lamp from a bracket shot in a dark room"),
        description=f"{words} {' '.join(GUIDE)}",
    )
    argument(add, "name NAME", tr("name of the lamp"))
    argument(
        add,
        "images IMAGE",
        tr("the exposures, their folder, or a single .exr or .hdr file (channel A is the mask)"),
        nargs="+",
        type=Path,
    )
    _add_measures(add)
    argument(add, "--times T,...", tr("exposure times in seconds, in the order of the files"))
    argument(
        add,
        "--response",
        tr("camera curve (default: srgb, since frames of dark rooms are mostly noise)"),
        choices=("srgb", "recover", "auto"),
    )
    _add_masks(add)
    add_json(add, _add)


def _add_masks(parser: argparse.ArgumentParser) -> None:
    lamp_words = tr("add a box to the mask, such as box:-20,20,-10,30; may be repeated")
    dark = tr("remove a box from the mask, such as box:-20,20,-10,30; may be repeated")
    for option, words in (("--set", lamp_words), ("--clear", dark)):
        parser.add_argument(option, metavar="BOX", action="append", default=[], help=words)


def _add(args: argparse.Namespace) -> int:
    distance = _positive(args.distance, tr("a distance in metres"))
    if distance is not None:
        check_distance(distance)  # Check before merging the photos, which is slow.
    boxes = _boxes(args)
    lux = _positive(args.lux, tr("an illuminance in lux"))
    times = args.times and tuple(
        _positive(t, tr("an exposure time")) for t in args.times.split(",")
    )
    options = MeasureOptions(times=times or None, response=args.response, sun="leave")
    capture = capture_lamp(
        args.images,
        options,
        title=args.name,
        distance_m=distance,
        report=ProgressPrinter(),
    )
    lamp = _edit(capture.lamp, boxes)
    lamp = lamp if lux is None else with_lux(lamp, lux)
    warnings = [*sentences(capture.warnings), *mask_warnings(capture.mask)]
    verdict = compare(_ANY_WHITE, lamp)
    if not verdict.possible:
        warnings.append(comparison_words(verdict))
    if distance is None:
        warnings.append(tr("The distance of the lamp is unknown. Set it with --distance."))
    notes = mask_notes(capture.mask)
    say(*warnings, *notes)
    library_lamp = add_lamp(lamps_folder(), lamp)
    facts = {**_facts(library_lamp), "warnings": warnings, "notes": list(notes)}
    values = {"title": library_lamp.title, "name": library_lamp.name, "facts": _words(facts)}
    return answer(args, facts, tr("Saved “{title}” as {name}: {facts}.", **values))


def _guide(args: argparse.Namespace) -> int:
    steps = [f"{number}. {step}" for number, step in enumerate(GUIDE, 1)]
    last = tr("Then run: turnlight lamp add NAME IMAGE... --distance METRES")
    return answer(args, {"steps": list(GUIDE)}, "\n".join([*steps, "", last]))


def _list(args: argparse.Namespace) -> int:
    folder = lamps_folder()
    entries, damaged = list_lamps(folder)
    rows = [
        {
            **fields(each, "name", "title", "distance_m", "lux", "camera"),
            "picture": None if each.picture is None else str(each.picture),
            "remarks": [] if each.damage is None else [damage_words(each.damage)],
        }
        for each in entries
    ]
    lines = [f"{row['name']:<24}{row['title']:<32}{_words(row)}" for row in rows]
    # Print the full path, because the home folder itself may be unreadable.
    lines += [
        f"{folder if each.path == folder else each.path.name}: {each.reason}" for each in damaged
    ]
    bad = [{"file": str(each.path), "reason": each.reason} for each in damaged]
    return answer(args, {"lamps": rows, "damaged": bad}, "\n".join(lines) or tr("No lamps yet."))


def _change(args: argparse.Namespace) -> int:
    if not (args.title or args.distance or args.lux):
        raise CoreError(tr("There is nothing to change."), tr("Use --title, --distance or --lux."))
    distance = _positive(args.distance, tr("a distance in metres"))
    lux = _positive(args.lux, tr("an illuminance in lux"))
    folder = lamps_folder()
    lamp = restate_lamp(folder, args.name, distance_m=distance, lux=lux)
    if args.title:
        lamp = rename_lamp(folder, lamp.name, args.title)
    return _corrected(args, lamp)


def _mask(args: argparse.Namespace) -> int:
    lamp = read_lamp(lamps_folder(), args.name)
    edit = _edit(lamp, _boxes(args))
    if edit is lamp:
        raise CoreError(tr("There is nothing to change."), tr("Use --set or --clear."))
    update_lamp(lamps_folder(), edit)
    return _corrected(args, edit)


def _corrected(args: argparse.Namespace, lamp: CapturedLamp) -> int:
    facts = _facts(lamp)
    words = tr("Changed “{title}”: {facts}.", title=lamp.title, facts=_words(facts))
    return answer(args, facts, words)


def _remove(args: argparse.Namespace) -> int:
    trash_entry = delete_lamp(lamps_folder(), args.name)
    words = tr(
        "“{title}” was moved to the trash: {folder}",
        title=trash_entry.title,
        folder=trash_entry.folder,
    )
    facts = {"name": trash_entry.name, "title": trash_entry.title, "trash": str(trash_entry.folder)}
    return answer(args, facts, words)


def _edit(lamp: CapturedLamp, boxes: list[tuple[_Box, bool]]) -> CapturedLamp:
    for box, is_lamp in boxes:
        lamp = edit_mask(lamp, box, is_lamp=is_lamp)
    return lamp


def _boxes(args: argparse.Namespace) -> list[tuple[_Box, bool]]:
    """Parse the boxes to add to the lamp's mask (True) or to remove from it (False).

    Raises:
        CoreError: If a box is invalid.
    """
    return [
        *((_box(text), True) for text in args.set),
        *((_box(text), False) for text in args.clear),
    ]


def _box(text: str) -> _Box:
    spec = parse_mask(text)
    if spec.kind != "box":
        raise CoreError(
            tr("A lamp’s mask is corrected with boxes, not with “{mask}”.", mask=text.strip()),
            tr("Write box:from,to,low,high, or use the brush in Light."),
        )
    start, stop, low, high = spec.numbers
    return start, stop, low, high


def _facts(lamp: CapturedLamp) -> dict[str, Any]:
    azimuth, elevation = centroid(lamp.light)
    return {
        **fields(lamp, "name", "title", "distance_m", "lux", "white_cd_m2", "camera"),
        "solid_angle_sr": lamp.solid_angle_sr,
        "azimuth_deg": azimuth,
        "elevation_deg": elevation,
    }


def _words(facts: dict[str, Any]) -> str:
    lux, metres = facts["lux"], facts["distance_m"]
    light = tr("brightness unknown") if lux is None else tr("{lux:.3g} lux", lux=lux)
    if metres is None:
        return tr("{light}, distance unknown", light=light)
    return tr("{light} at {distance:g} m", light=light, distance=metres)


def _positive(text: str | None, what: str) -> float | None:
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise CoreError(tr("{text!r} is not {what}.", text=text.strip(), what=what))
    return value
