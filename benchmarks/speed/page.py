"""The tables of benchmarks/speed.md, from the results in benchmarks/results.

turnlight bench -o benchmarks/results turnlight bench --growth -o benchmarks/results python
benchmarks/speed/page.py
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"
PAGE = ROOT / "benchmarks" / "speed.md"
GROWN = ("styles", "turns", "light", "panorama", "frames")


def read(name: str) -> Any:
    return json.loads((RESULTS / name).read_text(encoding="utf-8"))


def ms(seconds: float) -> str:
    """Format milliseconds with three digits, or seconds from ten of them on."""
    if seconds >= 10:
        return f"{seconds:,.0f} s"
    value = 1e3 * seconds
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def times(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.2g}"


def machine(values: dict[str, Any]) -> str:
    one = values["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in one["versions"].items())
    load = [one[key] for key in ("load_before", "load_after") if one.get(key) is not None]
    return (
        f"{one['date']}, {one['processor']}, {one['cores']} cores, {one['memory_gib']} GiB, "
        f"{one['system']}, Python {one['python']}, {versions}. "
        f"Processes that wanted a core: {' to '.join(str(each) for each in load)}."
    )


def rows_table(values: dict[str, Any]) -> list[str]:
    lines = [
        "| row | here, ms | plain, ms | times faster | limit, ms | bar | plain is |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in values["rows"]:
        limit = ms(row["limit_seconds"])
        if row["limit"] != "memory traffic":
            limit += f" ({row['limit']})"
        lines.append(
            f"| `{row['name']}` | {ms(row['seconds'])} | {ms(row['baseline_seconds'])} | "
            f"{times(row['ratio'])} | {limit} | {row['bar'] or ''} | {row['baseline']} |"
        )
    missed = "; ".join(f"`{name}` {', '.join(words)}" for name, words in values["missed"].items())
    return [
        *lines,
        "",
        f"Memory: {values['bandwidth_bytes_per_s'] / 1e9:.1f} GB/s. "
        + (f"Bars missed in this run: {missed}." if missed else "All bars met in this run."),
    ]


def peers_table(values: dict[str, Any]) -> list[str]:
    lines = ["| row | here, ms | program | its time, ms | its result |", "|---|---|---|---|---|"]
    for row in values["rows"]:
        lines += [
            f"| `{row['name']}` | {ms(row['seconds'])} | {peer['name']} | "
            f"{ms(peer['seconds'])} | {peer['note']} |"
            for peer in row["peers"]
        ]
    return lines


def growth_table(values: dict[str, Any]) -> list[str]:
    lines = [
        "| grows | smallest | here, ms | largest | here, ms | power |",
        "|---|---|---|---|---|---|",
    ]
    for one in values["growth"]:
        sizes, own = one["sizes"], one["seconds"]["here"]
        lines.append(
            f"| {one['axis']} | {sizes[0]:g} | {ms(own[0])} | {sizes[-1]:g} | {ms(own[-1])} | "
            f"{one['power']:.2f} |"
        )
    return lines


def before_after_table(values: dict[str, Any]) -> list[str]:
    lines = ["| what | before, ms | after, ms | times |", "|---|---|---|---|"]
    for name, (before, after) in values["milliseconds"].items():
        lines.append(f"| `{name}` | {before:g} | {after:g} | {before / after:.2f} |")
    return lines


def tables() -> dict[str, list[str]]:
    """Return the contents of the page, by marker name."""
    speed, grown, changed = (read(f"{name}.json") for name in ("speed", "growth", "before-after"))
    return {
        "machine": [machine(speed)],
        "rows": rows_table(speed),
        "peers": peers_table(speed),
        "growth": [*growth_table(grown), "", machine(grown)],
        "before-after": before_after_table(changed),
    }


def filled(text: str) -> str:
    """Return the page with the current tables."""
    for name, lines in tables().items():
        block = f"<!-- {name} -->\n" + "\n".join(lines) + f"\n<!-- end of {name} -->"
        text, count = re.subn(
            rf"<!-- {name} -->.*?<!-- end of {name} -->",
            lambda _, block=block: block,  # type: ignore[misc]
            text,
            flags=re.DOTALL,
        )
        assert count == 1, name
    return text


def main() -> None:
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
