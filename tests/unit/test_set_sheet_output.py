"""The files of a set sheet: a PDF that other programs open, a PNG, and no halves of either."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.errors import CoreError
from app.export.set_sheet import draw, write_pdf, write_png
from app.export.set_sheet.output import pdf_bytes
from app.export.set_sheet.pdf import Word, page_of
from tests.unit.test_set_sheet_page import sheet_of

JPEG = cv2.imencode(".jpg", np.full((8, 6, 3), 200, np.uint8))[1].tobytes()


def objects(data: bytes) -> dict[int, bytes]:
    """Read a PDF by its cross-reference table, as a viewer does."""
    assert data.startswith(b"%PDF-1.")
    assert data.endswith(b"%%EOF\n")
    start = int(re.findall(rb"startxref\n(\d+)\n", data)[-1])
    table = data[start:]
    assert table.startswith(b"xref\n0 ")
    count = int(table.split(b"\n")[1].split()[1])
    rows = table.split(b"\n", 2)[2]
    entries = [rows[20 * k : 20 * k + 20] for k in range(count)]
    assert all(len(entry) == 20 and entry.endswith(b" \n") for entry in entries)
    found = {}
    for number, entry in enumerate(entries):
        if entry[17:18] == b"n":
            offset = int(entry[:10])
            head = f"{number} 0 obj\n".encode()
            assert data[offset : offset + len(head)] == head
            found[number] = data[offset + len(head) :].split(b"\nendobj", 1)[0]
    assert f"/Size {count}".encode() in table
    return found


def stream(content: bytes) -> bytes:
    length = int(re.findall(rb"/Length (\d+)", content)[0])
    start = content.index(b"stream\n") + len(b"stream\n")
    return content[start : start + length]


def text_of(data: bytes) -> str:
    """All words, through the map from codes to letters."""
    found = objects(data)
    table = stream(found[7]).split(b"beginbfchar", 1)[1]
    rows = re.findall(rb"<([0-9a-f]{2})> <([0-9a-f]+)>", table)
    letters = {int(code, 16): bytes.fromhex(to.decode()).decode("utf-16-be") for code, to in rows}
    shown = re.findall(rb"<([0-9a-f]+)> Tj", stream(found[4]))
    return "\n".join("".join(letters[c] for c in bytes.fromhex(s.decode())) for s in shown)


def test_the_pdf_is_one_a4_page_with_the_picture() -> None:
    sheet = sheet_of()
    data = pdf_bytes(sheet)
    found = objects(data)
    assert b"/Count 1" in found[2]
    box = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", found[3])[0]
    # A4 in points.
    assert [float(side) for side in box] == pytest.approx([595.28, 841.89], abs=0.5)
    packed = np.frombuffer(stream_image(found[5]), np.uint8)
    picture = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR))[..., ::-1]
    page = draw(sheet)
    assert picture.shape == page.shape
    assert float(np.abs(picture.astype(int) - page).mean()) < 1.5
    assert f"/Width {page.shape[1]} /Height {page.shape[0]}".encode() in found[5]


def stream_image(content: bytes) -> bytes:
    length = int(re.findall(rb"/Length (\d+) >>\nstream", content[:400])[0])
    start = content.index(b"stream\n") + len(b"stream\n")
    assert content[start + length :].strip() == b"endstream"
    return content[start : start + length]


def test_its_words_can_be_found() -> None:
    words = text_of(pdf_bytes(sheet_of(place="Café Žižkov, 東京")))
    for text in (
        "96°",
        "clockwise",
        "Light from the sitter’s left (camera right)",
        "Café Žižkov, 東京",
        "−180°",
        "Behind the sitter",
    ):
        assert text in words, text


def test_words_lie_over_their_picture() -> None:
    data = page_of(JPEG, (6, 8), (794.0, 1123.0), [Word(100.0, 200.0, "ab", 20.0, 30.0)], "x")
    content = stream(objects(data)[4]).decode()
    # 96 logical pixels and 72 points are an inch; y counts from the lower edge.
    assert "1 0 0 1 75.00 692.25 Tm" in content
    assert "/F0 15.00 Tf" in content
    # Two letters of 0.6 em are 18 pt; drawn they are 22.5.
    assert "125.00 Tz" in content
    assert "3 Tr" in content


def test_names_cannot_break_the_file() -> None:
    words = [
        Word(10.0, 20.0, ">> endobj (%\\)", 12.0, 50.0),
        Word(1.0, 2.0, "\U0001f600", 9.0, 9.0),
    ]
    data = page_of(JPEG, (6, 8), (794.0, 1123.0), words, ">> (\\) \U0001f600")
    found = objects(data)
    assert len(found) == 8
    assert ">> endobj (%\\)\n\U0001f600" in text_of(data)
    assert b"/Title <feff003e003e" in found[8]


def test_many_scripts_on_one_page_lose_letters_but_nothing_else() -> None:
    words = [Word(0.0, 9.0, chr(0x4E00 + k), 9.0, 9.0) for k in range(400)]
    data = page_of(JPEG, (6, 8), (794.0, 1123.0), words, "x")
    assert text_of(data).count("\n") == 399
    assert chr(0x4E00 + 100) in text_of(data)


def test_files_are_written_whole(tmp_path: Path) -> None:
    sheet = sheet_of()
    write_pdf(tmp_path / "sheet.pdf", sheet)
    assert len(objects((tmp_path / "sheet.pdf").read_bytes())) == 8
    write_png(tmp_path / "sheet.png", sheet)
    picture = np.asarray(cv2.imread(str(tmp_path / "sheet.png")))
    assert (picture[..., ::-1] == draw(sheet)).all()
    data = (tmp_path / "sheet.png").read_bytes()
    place = data.index(b"pHYs") + 4
    # 192 pixels per inch, in pixels per metre.
    assert int.from_bytes(data[place : place + 4], "big") == pytest.approx(7559, abs=2)
    assert {path.name for path in tmp_path.iterdir()} == {"sheet.pdf", "sheet.png"}


@pytest.mark.parametrize("write", [write_pdf, write_png])
def test_what_cannot_be_written_is_said(tmp_path: Path, write: object) -> None:
    assert callable(write)
    with pytest.raises(CoreError, match="no folder"):
        write(tmp_path / "missing" / "sheet.pdf", sheet_of())
    assert not list(tmp_path.iterdir())
