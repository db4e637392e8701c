"""What webcams and HDMI capture devices are called.

Linux has the names beside the indices. macOS tells them in one list, which is in the order of the
indices once it is sorted as OpenCV sorts it. Windows tells names, but nothing of their order: there
a name is only used when there is a single one. A wrong name would be worse than none.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

LINUX: Final = Path("/sys/class/video4linux")
"""Where Linux lists what gives or takes pictures."""

_LONGEST: Final = 60
_ASKED: Final[dict[str, tuple[str, ...]]] = {
    "darwin": ("/usr/sbin/system_profiler", "-json", "SPCameraDataType"),
    "win32": (
        "powershell.exe",
        "-NoProfile",
        "-NonInteractive",
        "-Command",
        "Get-PnpDevice -PresentOnly -Class Camera,Image | Select-Object FriendlyName"
        " | ConvertTo-Json",
    ),
}
_PATIENCE_S: Final = 6.0
_MOST_CHARACTERS: Final = 200_000


def linux_names(folder: Path) -> tuple[tuple[int, str], ...]:
    """Read the list that Linux keeps; further nodes of one device carry no pictures.

    Returns
    -------
    tuple of (index, name)
        By index, no name twice.
    """
    found = []
    for node in folder.glob("video*"):
        number = node.name.removeprefix("video")
        if number.isdecimal() and _first_line(node / "index") in ("0", ""):
            # "HD Webcam: HD Webcam": the product and what of it this is.
            name = _tidy(_first_line(node / "name").partition(":")[0])
            found.append((int(number), name or f"Webcam {number}"))
    return _distinct(sorted(found))


def shown_names(
    indices: Sequence[int], system: str, ask: Callable[[Sequence[str]], str] | None = None
) -> tuple[tuple[int, str], ...]:
    """Name devices that were found by trying.

    Returns
    -------
    tuple of (index, name)
        "Webcam 1" and so on where the system does not tell, or may mean another one.
    """
    command = _ASKED.get(system) if indices else None
    told = (ask or _printed)(command) if command else ""
    names = _mac_names(told) if system == "darwin" else _windows_names(told)
    sure = len(names) == len(indices) and (system == "darwin" or len(names) == 1)
    if not sure:
        names = [f"Webcam {index + 1}" for index in indices]
    return _distinct(list(zip(indices, names, strict=True)))


def _mac_names(told: str) -> list[str]:
    table = _json(told)
    listed = table.get("SPCameraDataType") if isinstance(table, dict) else None
    rows = [row for row in listed if isinstance(row, dict)] if isinstance(listed, list) else []
    rows.sort(key=lambda row: str(row.get("spcamera_unique-id", "")))
    return [name for row in rows if (name := _tidy(str(row.get("_name", ""))))]


def _windows_names(told: str) -> list[str]:
    listed = _json(told)
    rows = listed if isinstance(listed, list) else [listed]
    names = [_tidy(str(row.get("FriendlyName") or "")) for row in rows if isinstance(row, dict)]
    return [name for name in names if name]


def _json(text: str) -> Any:
    try:
        return json.loads(text[:_MOST_CHARACTERS])
    except (ValueError, RecursionError):
        return None


def _printed(command: Sequence[str]) -> str:
    try:
        done = subprocess.run(  # noqa: S603 - commands of this file only
            command,
            capture_output=True,
            timeout=_PATIENCE_S,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.decode("utf-8", "replace")


def _distinct(found: list[tuple[int, str]]) -> tuple[tuple[int, str], ...]:
    """Tell apart the names that stand there more than once, by a number."""
    seen: dict[str, int] = {}
    shown = []
    for index, name in found:
        seen[name] = seen.get(name, 0) + 1
        shown.append((index, name if seen[name] == 1 else f"{name} ({seen[name]})"))
    return tuple(shown)


def _tidy(name: str) -> str:
    return "".join(sign for sign in name if sign.isprintable()).strip()[:_LONGEST]


def _first_line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")[:200].partition("\n")[0].strip()
    except OSError:
        return ""
