"""Reading a PDF as a viewer does: by its table of objects, and its words by their fonts' maps."""

from __future__ import annotations

import re
import zlib

__all__ = ["pdf_objects", "pdf_text"]


def pdf_objects(data: bytes) -> dict[int, bytes]:
    """Return the objects that the cross-reference table lists, without their first line."""
    assert data.startswith(b"%PDF-1.")
    assert data.rstrip().endswith(b"%%EOF")
    start = int(re.findall(rb"startxref\s+(\d+)", data)[-1])
    table = re.match(rb"xref\s+0 (\d+)\s+((?:\d{10} \d{5} [nf]\s+)+)", data[start:])
    assert table is not None
    found = {}
    for number, (offset, kind) in enumerate(re.findall(rb"(\d{10}) \d{5} ([nf])", table[2])):
        if kind == b"n":
            head = f"{number} 0 obj\n".encode()
            at = int(offset)
            assert data[at : at + len(head)] == head
            found[number] = data[at + len(head) :].split(b"\nendobj", 1)[0]
    assert int(table[1]) == max(found) + 1
    return found


def pdf_text(data: bytes) -> str:
    """Return the words on the page, as a search finds them, in the order of drawing."""
    found = pdf_objects(data)
    fonts = {
        name: _letters(found, int(number))
        for content in found.values()
        for name, number in re.findall(rb"/(F\d+) (\d+) 0 R", content)
    }
    (page,) = (content for content in found.values() if re.search(rb"/Type /Page\b", content))
    contents = re.search(rb"/Contents (\d+) 0 R", page)
    assert contents is not None
    words = []
    for block in re.findall(rb"\bBT\b(.*?)\bET\b", _stream(found, int(contents[1])), re.S):
        letters = fonts[re.findall(rb"/(F\d+)", block)[-1]]
        codes = re.findall(r"\w{4}", b" ".join(re.findall(rb"<(\w+)> Tj", block)).decode())
        words.append("".join(letters.get(int(code, 16), "?") for code in codes))
    return " ".join(words)


def _letters(found: dict[int, bytes], font: int) -> dict[int, str]:
    """Return what the codes of a font mean; Qt has no word for letters beyond 16 bits."""
    number = re.search(rb"/ToUnicode (\d+) 0 R", found[font])
    assert number is not None
    rows = re.findall(rb"<(\w{4})> <(\w{4})> (?:\[(.*?)\]|<(\w+)>)", _stream(found, int(number[1])))
    letters = {}
    for first, last, several, one in rows:
        texts = re.findall(rb"<(\w+)>", several) or [one]
        for code in range(int(first, 16), int(last, 16) + 1):
            text = texts[min(code - int(first, 16), len(texts) - 1)]
            letters[code] = bytes.fromhex(text.decode()).decode("utf-16-be")
    return letters


def _stream(found: dict[int, bytes], number: int) -> bytes:
    content = found[number]
    start = content.index(b"stream\n") + len(b"stream\n")
    data = content[start:]
    return zlib.decompress(data) if b"/FlateDecode" in content[:start] else data
