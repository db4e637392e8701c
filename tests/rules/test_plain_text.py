"""Nothing in the window reads markup: words come from files, cameras and networks.

Tool tips are made plain by the style, in one place; labels are `Text`, which is plain; buttons
and menus never were anything else. What Qt itself would read as HTML is not used.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "app").rglob("*.py"))
READS_MARKUP = {
    "QErrorMessage",
    "QGraphicsTextItem",
    "QMessageBox",
    "QStaticText",
    "QTextBrowser",
    "QTextDocument",
    "QTextEdit",
    "QWhatsThis",
    "setHtml",
    "setStatusTip",
    "setWhatsThis",
}


@cache
def trees() -> list[tuple[str, ast.Module]]:
    return [
        (file.relative_to(ROOT).as_posix(), ast.parse(file.read_text(encoding="utf-8")))
        for file in FILES
    ]


@cache
def names(tree: ast.Module) -> list[tuple[ast.AST, str]]:
    return [
        (node, node.id if isinstance(node, ast.Name) else node.attr)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Name, ast.Attribute))
    ]


def test_nothing_is_used_that_reads_markup() -> None:
    for file, tree in trees():
        used = {name for _, name in names(tree)}
        assert not used & READS_MARKUP, file
        formats = [node for node, name in names(tree) if name in {"RichText", "MarkdownText"}]
        assert not formats, file


def test_every_label_with_words_is_the_plain_one() -> None:
    derived, empty = [], []
    for file, tree in trees():
        for node in ast.walk(tree):
            match node:
                case ast.ClassDef(bases=[ast.Name(id="QLabel"), *_]):
                    derived.append(f"{file}:{node.name}")
                case ast.Call(func=ast.Name(id="QLabel")):
                    assert not node.args, file
                    empty.append(file)
    assert derived == ["app/ui/widgets/labels.py:Text"]
    # It only ever shows a sign.
    assert empty == ["app/ui/shell/window_frame.py"]
    source = (ROOT / "app/ui/shell/window_frame.py").read_text(encoding="utf-8")
    assert "_mark.setText" not in source


def test_tool_tips_and_labels_are_made_plain_once() -> None:
    plain = [file for file, tree in trees() for _, name in names(tree) if name == "PlainText"]
    assert plain == ["app/ui/theme/style.py", "app/ui/widgets/labels.py"]
    showing = [file for file, tree in trees() for _, name in names(tree) if name == "QToolTip"]
    assert set(showing) == {"app/ui/theme/style.py"}
    painted = [file for file, tree in trees() for _, name in names(tree) if name == "setTextFormat"]
    assert sorted(painted) == ["app/ui/theme/style.py", "app/ui/widgets/labels.py"]
