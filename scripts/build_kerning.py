"""Write resources/fonts/kerning.json: the kerning of the interface font, for plain text.

OpenCV draws OpenType glyphs but does not kern them. This reads the pairs from the fonts once, at
development time; the program only needs the table. Needs ``fonttools``, which the program does not.

    python scripts/build_kerning.py
"""

from __future__ import annotations

import json
import string
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fontTools.ttLib import TTFont

if TYPE_CHECKING:
    from collections.abc import Iterator

FONTS: Final = Path(__file__).resolve().parent.parent / "resources" / "fonts"
WEIGHTS: Final = {400: "Regular", 500: "Medium", 600: "SemiBold", 700: "Bold"}
CHARACTERS: Final = string.ascii_letters + string.digits + ".,:;!?'()/-+&’“”°−–… "
SMALLEST: Final = 0.008  # em; less is under a tenth of a pixel at 12 px


def main() -> None:
    """Write the table: by weight, pairs of characters and em."""
    table = {
        str(weight): kerning(TTFont(FONTS / f"Inter-{name}.otf"))
        for weight, name in WEIGHTS.items()
    }
    text = json.dumps(table, ensure_ascii=False, sort_keys=True, separators=(",", ":"))
    (FONTS / "kerning.json").write_text(text + "\n", encoding="utf-8")


def kerning(font: TTFont) -> dict[str, float]:
    """Pairs of characters with the distance that they move together, in em."""
    names = font.getBestCmap()
    glyphs = {
        character: names[ord(character)] for character in CHARACTERS if ord(character) in names
    }
    lookups = list(pair_lookups(font["GPOS"].table))
    em = font["head"].unitsPerEm
    result = {}
    for left, first in glyphs.items():
        for right, second in glyphs.items():
            units = sum(distance(lookup, first, second) for lookup in lookups)
            if abs(units) >= SMALLEST * em:
                result[left + right] = round(units / em, 4)
    return result


def pair_lookups(table: Any) -> Iterator[list[Any]]:
    """Subtables of every lookup of the default ``kern`` feature."""
    indices = {
        index
        for record in table.FeatureList.FeatureRecord
        if record.FeatureTag == "kern"
        for index in record.Feature.LookupListIndex
    }
    for index in sorted(indices):
        subtables = [
            getattr(subtable, "ExtSubTable", subtable)
            for subtable in table.LookupList.Lookup[index].SubTable
        ]
        yield [subtable for subtable in subtables if subtable.LookupType == 2]


def distance(subtables: list[Any], first: str, second: str) -> int:
    """Advance added to the first glyph by the first subtable that covers the pair."""
    for subtable in subtables:
        if first not in subtable.Coverage.glyphs:
            continue
        if subtable.Format == 1:
            pairs = subtable.PairSet[subtable.Coverage.glyphs.index(first)].PairValueRecord
            for pair in pairs:
                if pair.SecondGlyph == second:
                    return advance(pair.Value1)
            continue
        row = subtable.ClassDef1.classDefs.get(first, 0)
        column = subtable.ClassDef2.classDefs.get(second, 0)
        # The first subtable that covers the first glyph decides, even with nothing.
        return advance(subtable.Class1Record[row].Class2Record[column].Value1)
    return 0


def advance(value: Any) -> int:
    """Horizontal advance of a value record, which may be absent."""
    return int(getattr(value, "XAdvance", 0) or 0)


if __name__ == "__main__":
    main()
