"""Adding one more of a kind touches few files; CONTRIBUTING.md says which."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from app.core.base.paths import resources
from app.core.solver import styles

ROOT = Path(__file__).resolve().parents[2]
MOST_FILES = 3


def files_with(pattern: str) -> list[str]:
    """Sources and pages that hold a pattern."""
    files = [*(ROOT / "app").rglob("*.py"), *(ROOT / "docs").glob("*.md")]
    return sorted(
        str(path.relative_to(ROOT))
        for path in files
        if re.search(pattern, path.read_text(encoding="utf-8"))
    )


# -- styles ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in styles.NAMES if name.startswith("left-")])
def test_a_style_is_named_in_few_files(name: str) -> None:
    # The files of packs and transports are baked from them, by a command.
    own = [path.name for path in (resources() / "styles").glob(f"{name}.toml")]
    sources = [file for file in files_with(f'"{name}"') if file.endswith(".py")]
    assert own
    assert "app/core/solver/styles.py" in sources
    assert len(own) + len(sources) <= MOST_FILES


def test_a_file_and_a_name_make_a_style_and_its_mirror_image(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(resources() / "styles", tmp_path / "styles")
    text = (tmp_path / "styles" / "left-loop.toml").read_text("utf-8")
    broad = text.replace("Loop", "Broad").replace("far cheek", "right cheek")
    (tmp_path / "styles" / "left-broad.toml").write_text(broad, "utf-8")
    monkeypatch.setattr(styles, "resources", lambda: tmp_path)
    monkeypatch.setattr(styles, "NAMES", (*styles.NAMES, "left-broad", "right-broad"))
    *others, left, right = styles.load_styles()
    assert len(others) == 18
    assert (left.name, right.name, right.title, right.side) == (
        "left-broad",
        "right-broad",
        "Broad",
        "right",
    )
    assert right.lamps[0].azimuth_deg == -left.lamps[0].azimuth_deg
    assert "toward the left cheek" in right.note
    assert styles.mirror(right) == left


# -- settings ----------------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["reduce_motion", "sitter_name", "self_timer_s", "places_folder"])
def test_a_setting_is_named_in_few_files(key: str) -> None:
    # Its field, its line on the page, and where it counts; dialog and file follow the field.
    files = files_with(rf"(?<!\w){key}(?!\w)")
    assert {"app/core/storage/settings.py", "docs/settings.md"} <= set(files)
    assert len(files) <= MOST_FILES, files
