"""Libraries in C and C++ are given names of files in one way only: by `native_path`.

Some end the process where a name is not UTF-8, others open another file.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "app").rglob("*.py"))
NAMES_FILE = "native_path"

TAKES_PATH = {
    *("cv2.VideoCapture", "cv2.VideoWriter", "oiio.ImageInput.open", "oiio.ImageOutput.create"),
    *("output.open", "mesh.write_ply"),
}
"""Calls whose first argument is the name of a file."""

NEVER = {
    *("imread", "imreadmulti", "imwrite", "haveImageReader", "FileStorage", "CascadeClassifier"),
    *("FaceDetectorYN", "FaceRecognizerSF", "ImageBuf", "ImageCache", "TextureSystem"),
    *("addApplicationFont", "QSettings", "QFile", "QSaveFile", "QImageReader", "QImageWriter"),
    *("QTemporaryFile", "QMovie", "QSoundEffect", "QMediaPlayer", "QFileInfo", "QLockFile"),
    *("fromLocalFile", "decode_file", "stream_file", "get_file_info", "mp3_get_file_info"),
    *("Bitmap", "load_file"),
}
"""What takes names of files and is not used: the bytes are read in Python."""

BYTES_ONLY = {"readNetFromONNX", "readNetFromTFLite", "readNet", "load_dict", "toLocalFile"}
"""Used in one place each, which is tested by itself."""

ONLY = {
    "app/core/base/imaging/networks.py": {"readNetFromONNX", "readNetFromTFLite"},
    "app/core/baking/scene.py": {"load_dict"},
    "app/ui/widgets/dialogs.py": {"toLocalFile"},  # Windows, where every name is text
}

OTHERWISE = {
    ("app/core/base/imaging/video.py", "open_url"): "its callers give an address or a native path",
    ("app/devices/webcam/opencv.py", "_open_index"): "a number",
}


def last_name(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def is_native(node: ast.expr, function: ast.AST) -> bool:
    """Whether an expression is what `native_path` gave, also by way of a variable."""
    if isinstance(node, ast.Call):
        return last_name(node.func) == NAMES_FILE
    return isinstance(node, ast.Name) and any(
        isinstance(each, ast.Assign)
        and isinstance(each.targets[0], ast.Name)
        and each.targets[0].id == node.id
        and is_native(each.value, function)
        for each in ast.walk(function)
    )


def functions(tree: ast.Module) -> list[ast.FunctionDef]:
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def wrong(source: str, file: str) -> list[str]:
    tree = ast.parse(source)
    used = {
        last_name(node) for node in ast.walk(tree) if isinstance(node, (ast.Name, ast.Attribute))
    }
    found = sorted(used & (NEVER | BYTES_ONLY - ONLY.get(file, set())))
    for function in functions(tree):
        for call in ast.walk(function):
            if not isinstance(call, ast.Call) or ast.unparse(call.func) not in TAKES_PATH:
                continue
            if (file, function.name) not in OTHERWISE and not is_native(call.args[0], function):
                found.append(f"{function.name}: {ast.unparse(call)}")
    return found


def test_libraries_get_names_from_one_function() -> None:
    found = {}
    for path in FILES:
        file = path.relative_to(ROOT).as_posix()
        if lines := wrong(path.read_text(encoding="utf-8"), file):
            found[file] = lines
    assert not found


@pytest.mark.parametrize(
    "line",
    [
        "cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)",
        "cv2.imread(str(path))",
        "QImageReader(str(path))",
        "oiio.ImageInput.open(os.fspath(path))",
        "QUrl.fromLocalFile(str(path))",
    ],
)
def test_rule_finds_plain_names(line: str) -> None:
    assert wrong(f"def read(path):\n    return {line}\n", "app/x.py")
    assert not wrong("def read(path):\n    cv2.VideoCapture(native_path(path))\n", "app/x.py")


def test_exceptions_of_the_rule_are_still_there() -> None:
    for file, name in OTHERWISE:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        assert name in {function.name for function in functions(tree)}
