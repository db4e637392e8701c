"""A minimal PDF of one page: a picture, and its words as invisible text to be searched.

Written after ISO 32000-1 (PDF 1.4 is enough): five or six objects, a cross-reference table, and
nothing else. Words are placed over their picture in rendering mode 3 (neither filled nor stroked).
Their letters are numbered as they occur and translated back to Unicode by a ToUnicode map, so that
names in any script can be found, without a font in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

_POINTS: Final = 0.75  # per logical pixel: 72 over 96
_FIRST: Final = 33
_LAST: Final = 254
_ADVANCE: Final = 600  # of every letter, thousandths: Courier's


@dataclass(frozen=True, slots=True)
class Word:
    """A line of text on the page.

    Attributes
    ----------
    x, y : float
        Start of its baseline from the page's upper left corner, logical pixels.
    size : float
        Logical pixels.
    width : float
        As drawn, logical pixels.
    """

    x: float
    y: float
    text: str
    size: float
    width: float


def page_of(
    jpeg: bytes,
    pixels: tuple[int, int],
    page: tuple[float, float],
    words: Sequence[Word],
    title: str,
) -> bytes:
    """Make a PDF of one page.

    Parameters
    ----------
    page : tuple of float
        Width and height of the page, logical pixels (96 per inch).
    """
    width, height = page[0] * _POINTS, page[1] * _POINTS
    codes = _codes(words)
    content = _content(words, codes, (width, height))
    body = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.2f} {height:.2f}] /Contents 4 0 R "
        "/Resources << /XObject << /Im0 5 0 R >> /Font << /F0 6 0 R >> >> >>".encode("ascii"),
        _stream(b"", content),
        _stream(
            f"/Type /XObject /Subtype /Image /Width {pixels[0]} /Height {pixels[1]} "
            "/ColorSpace /DeviceRGB /BitsPerComponent 8 /Filter /DCTDecode".encode("ascii"),
            jpeg,
        ),
        _font(),
        _stream(b"", _to_unicode(codes)),
        b"<< /Title " + _hex(title) + b" /Creator " + _hex("Turnlight") + b" >>",
    ]
    return _file(body)


def _file(body: Sequence[bytes]) -> bytes:
    """Put objects, cross-reference table and trailer together."""
    data = bytearray(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
    offsets = []
    for number, content in enumerate(body, start=1):
        offsets.append(len(data))
        data += f"{number} 0 obj\n".encode("ascii") + content + b"\nendobj\n"
    start = len(data)
    data += f"xref\n0 {len(body) + 1}\n0000000000 65535 f \n".encode("ascii")
    for offset in offsets:
        data += f"{offset:010d} 00000 n \n".encode("ascii")
    trailer = f"trailer\n<< /Size {len(body) + 1} /Root 1 0 R /Info {len(body)} 0 R >>\n"
    data += trailer.encode("ascii") + f"startxref\n{start}\n%%EOF\n".encode("ascii")
    return bytes(data)


def _stream(entries: bytes, data: bytes) -> bytes:
    head = b"<< " + entries + f" /Length {len(data)} >>\nstream\n".encode("ascii")
    return head + data + b"\nendstream"


def _hex(text: str) -> bytes:
    return b"<" + ("\ufeff" + text).encode("utf-16-be", "replace").hex().encode("ascii") + b">"


def _codes(words: Sequence[Word]) -> dict[str, int]:
    """Give letters numbers as they occur; beyond 221 different ones they become spaces."""
    codes: dict[str, int] = {" ": 32}
    for word in words:
        for letter in word.text:
            if letter not in codes and _FIRST + len(codes) - 1 <= _LAST:
                codes[letter] = _FIRST + len(codes) - 1
    return codes


def _content(words: Sequence[Word], codes: dict[str, int], page: tuple[float, float]) -> bytes:
    width, height = page
    lines = [f"q {width:.2f} 0 0 {height:.2f} 0 0 cm /Im0 Do Q", "BT 3 Tr"]
    for word in words:
        size = word.size * _POINTS
        natural = len(word.text) * size * _ADVANCE / 1000.0
        stretch = 100.0 * word.width * _POINTS / natural
        coded = bytes(codes.get(letter, 32) for letter in word.text).hex()
        x, y = word.x * _POINTS, height - word.y * _POINTS
        lines.append(f"/F0 {size:.2f} Tf {stretch:.2f} Tz 1 0 0 1 {x:.2f} {y:.2f} Tm <{coded}> Tj")
    lines.append("ET")
    return "\n".join(lines).encode("ascii")


def _font() -> bytes:
    widths = " ".join([str(_ADVANCE)] * (_LAST - 32 + 1))
    return (
        "<< /Type /Font /Subtype /Type1 /BaseFont /Courier /Encoding /WinAnsiEncoding "
        f"/FirstChar 32 /LastChar {_LAST} /Widths [{widths}] /ToUnicode 7 0 R >>"
    ).encode("ascii")


def _to_unicode(codes: dict[str, int]) -> bytes:
    """Map codes back to letters (Adobe Technical Note 5411)."""
    rows = [
        f"<{code:02x}> <{letter.encode('utf-16-be', 'replace').hex()}>"
        for letter, code in codes.items()
    ]
    blocks = []
    for start in range(0, len(rows), 100):
        part = rows[start : start + 100]
        blocks.append(f"{len(part)} beginbfchar\n" + "\n".join(part) + "\nendbfchar")
    return (
        "/CIDInit /ProcSet findresource begin\n12 dict begin\nbegincmap\n"
        "/CMapName /Turnlight def\n/CMapType 2 def\n"
        "1 begincodespacerange\n<20> <fe>\nendcodespacerange\n"
        + "\n".join(blocks)
        + "\nendcmap\nCMapName currentdict /CMap defineresource pop\nend\nend"
    ).encode("ascii")
