"""From the bracket to the turn: the loss by measured light, against the true light.

Every bundled scene is shown at a plausible brightness, metered and shot like a Theta V (JPEG frames
with curve, noise, clipping and EXIF), with the paper's three frames and with the full bracket. The
files go through the whole of `merge`; the turns chosen from the result are judged by the curves of
the true light.

    python benchmarks/light/probe_regret.py [-o FILE.json]
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from app.core.base.atomic_files import atomic_write_text
from app.core.environment.environment import read_environment, reduce_radiance
from app.core.measure.bracket.measure import measure
from app.core.measure.finish.clip_audit import audit
from app.core.measure.finish.corrections import still_clipped
from app.core.measure.finish.lamp_detection import light_grid
from app.core.measure.options import MeasureOptions
from app.core.measure.plan.planner import plan
from app.core.solver.turn_choice import OBJECTIVES
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack
from app.devices.simulated.cameras import THETA_V
from app.devices.simulated.optics import meter
from benchmarks.light.shots.brackets import write_bracket
from benchmarks.light.sun_restored import SUNS, load

ROOT = Path(__file__).resolve().parents[2]


from app.core.camera_catalogue import camera_facts  # noqa: E402
from app.core.measure.finish.clip_audit import given_up  # noqa: E402
from app.core.measure.finish.sunlight import SkyWord, direct_normal_lux  # noqa: E402
from benchmarks.speed.plain_search import choose  # noqa: E402

# Exposure value (ISO 100) that a meter would read in each scene without a sun.
EV100 = {"courtyard": 13.0, "forest": 11.0, "interior": 8.0, "night": 4.0, "studio": 9.0}
BAD = 0.10


def absolute(path: Path) -> tuple[np.ndarray[Any, Any], SkyWord]:
    """Return a scene in cd/m2, and a photographer's description of the sky."""
    if path.stem in SUNS:
        scene, word = load(path), SUNS[path.stem]
        lux = direct_normal_lux(scene.elevation_deg, word)
        return scene.radiance * np.float32(lux / scene.disc), word
    radiance = read_environment(path).radiance
    factor = meter(radiance, THETA_V).factor
    return radiance * np.float32(factor * 2.0 ** EV100[path.stem]), "clear"


def try_scene(path: Path, kind: str, pack: StylePack, folder: Path) -> dict[str, Any]:
    """Return the regret of every style in one scene and bracket."""
    light, word = absolute(path)
    model = camera_facts(THETA_V.model)
    assert model is not None
    wanted = plan(meter(light, THETA_V), model.limits, kind, model.max_shots)  # type: ignore[arg-type]
    place = folder / f"{path.stem}-{kind}"
    place.mkdir()
    write_bracket(place, light, THETA_V, [shot.exposure for shot in wanted.shots], seed=1)
    probe = measure([place], MeasureOptions(sun=word))
    true = reduce_radiance(light, pack.header.environment)
    held = reduce_radiance(probe.merged.radiance, pack.header.environment)
    remaining = still_clipped(probe.finished.lights, light_grid(probe.merged))
    row: dict[str, Any] = {
        "scene": path.stem,
        "plan": kind,
        "frames": len(wanted.shots),
        "clipped_energy": probe.finished.measured_clipped,
        "sun_restored": probe.finished.restoration is not None,
    }
    for objective in OBJECTIVES:
        lost = given_up(choose(pack, true, objective), choose(pack, held, objective).turns)
        done = probe.finished.restoration
        doubt = audit(probe.merged, remaining, pack, objective=objective, restoration=done).in_doubt
        bad = [s.name for s, value in zip(pack.styles, lost, strict=True) if value > BAD]
        row[objective] = {
            "mean": float(lost.mean()),
            "worst": float(lost.max()),
            "bad": bad,
            "bad_not_flagged": [name for name in bad if name not in doubt],
            "flagged": len(doubt),
            "given_up": {
                s.name: round(float(value), 4) for s, value in zip(pack.styles, lost, strict=True)
            },
        }
    return row


def summary(rows: list[dict[str, Any]], styles: int) -> dict[str, Any]:
    """Return shares of bad pairs by plan and objective."""
    found: dict[str, Any] = {}
    for kind in ("paper", "full"):
        part = [row for row in rows if row["plan"] == kind]
        for objective in OBJECTIVES:
            count = len(part) * styles
            found[f"{kind}.{objective}"] = {
                "pairs": count,
                "bad": sum(len(row[objective]["bad"]) for row in part) / count,
                "bad_not_flagged": sum(len(row[objective]["bad_not_flagged"]) for row in part),
                "flagged": sum(row[objective]["flagged"] for row in part) / count,
                "mean": float(np.mean([row[objective]["mean"] for row in part])),
            }
    return found


def main() -> None:
    """Try every bundled scene, write and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "-o", type=Path, default=ROOT / "benchmarks" / "results" / "probe-regret.json"
    )
    args = parser.parse_args()
    pack = load_named_pack("generic")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted((ROOT / "resources" / "demo" / "scenes").glob("*.exr")):
            for kind in ("paper", "full"):
                row = try_scene(path, kind, pack, Path(folder))
                rows.append(row)
                picture = row["picture"]
                print(
                    f"| {row['scene']} | {kind} | {row['frames']} | "
                    f"{100 * row['clipped_energy']:.1f} % | {100 * picture['mean']:.1f} % | "
                    f"{len(picture['bad'])} | {picture['flagged']} | "
                    f"{len(picture['bad_not_flagged'])} | {len(row['paper']['bad'])} | "
                    f"{'yes' if row['sun_restored'] else ''} |",
                    flush=True,
                )
    found = summary(rows, len(pack.styles))
    atomic_write_text(args.o, json.dumps({"summary": found, "rows": rows}, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
