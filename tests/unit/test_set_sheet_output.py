"""The files of a set sheet: a PDF that other programs open, a PNG, and no halves of either."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.core.base.errors import CoreError
from app.export.set_page import draw, write_pdf, write_png
from tests.helpers.pdf import pdf_objects, pdf_text
from tests.unit.test_set_sheet_page import sheet_of, written

pytestmark = pytest.mark.usefixtures("qapp")


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory, qapp: object) -> bytes:
    """The PDF of a sheet whose names hold what could break it."""
    file = tmp_path_factory.mktemp("sheet") / "sheet.pdf"
    write_pdf(file, sheet_of(title=">> endobj (%\\)", place="Café Žižkov, 東京 \U0001f600"))
    return file.read_bytes()


def test_the_pdf_is_one_a4_page_of_outlines(data: bytes) -> None:
    found = pdf_objects(data)
    pages = [content for content in found.values() if re.search(rb"/Type /Page\b", content)]
    assert len(pages) == 1
    box = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pages[0])[0]
    # A4 in points.
    assert [float(side) for side in box] == pytest.approx([595.28, 841.89], abs=0.5)
    # The three pictures and the panorama, at 192 pixels per inch, and no picture of the page.
    widths = {int(side) for side in re.findall(rb"/Subtype /Image\n/Width (\d+)", data)}
    assert widths == {448, 1412}


def test_its_fonts_come_with_it(data: bytes) -> None:
    found = pdf_objects(data)
    fonts = [content for content in found.values() if b"/FontName" in content]
    names = {re.findall(rb"/FontName /\w+\+([\w-]+)", content)[0] for content in fonts}
    weights = {b"Inter-Regular", b"Inter-Medium", b"Inter-SemiBold", b"Inter-Bold"}
    assert weights <= names
    for content in fonts:
        (file,) = re.findall(rb"/FontFile2 (\d+) 0 R", content)
        assert b"stream" in found[int(file)]


def test_its_words_can_be_found(data: bytes) -> None:
    words = pdf_text(data)
    expected = [" ".join(line[0].split()) for line in written(sheet_of())]
    # The title and the place are the fixture's; the rest stands as the picture has it.
    missing = [line for line in expected if line not in words]
    assert missing == ["Rembrandt", "North studio"]
    for text in (">> endobj (%\\)", "Café Žižkov,", "96°", "−180°", "21 Nov 2026, 14:05"):
        assert text in words


def test_files_are_written_whole(tmp_path: Path) -> None:
    sheet = sheet_of()
    write_pdf(tmp_path / "sheet.pdf", sheet)
    assert pdf_objects((tmp_path / "sheet.pdf").read_bytes())
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
    with pytest.raises(CoreError, match="does not exist"):
        write(tmp_path / "missing" / "sheet.pdf", sheet_of())
    assert not list(tmp_path.iterdir())
