"""Letters of a font as outlines: python3 letters.py FONT.ttf >DejaVuSans-letters.txt (needs fonttools).

The first line is the size of the type, in the font's unit. Each other line is a letter: its code, its advance and its outline of
M (move to x y), L (line to x y), Q (parabola by x y to x y) and Z (close). The first letter, of code 0, stands for those that the font has not.
"""

import sys

from fontTools.pens.basePen import decomposeQuadraticSegment
from fontTools.pens.recordingPen import DecomposingRecordingPen
from fontTools.ttLib import TTFont


def number(value):
    return f"{value:g}" if value % 1 else str(int(value))


def outline(glyphs, name):
    pen = DecomposingRecordingPen(glyphs)
    glyphs[name].draw(pen)
    for command, points in pen.value:
        match command:
            case "moveTo" | "lineTo":
                yield command[0].upper()
                yield from map(number, points[0])
            case "qCurveTo":
                assert points[-1] is not None, f"{name}: a contour without a point on it"
                for off, on in decomposeQuadraticSegment(points):
                    yield "Q"
                    yield from map(number, (*off, *on))
            case "closePath":
                yield "Z"
            case _:
                raise ValueError(f"{name}: {command}")


font = TTFont(sys.argv[1])
glyphs = font.getGlyphSet()
letters = {0: ".notdef"} | font.getBestCmap()
print(font["head"].unitsPerEm)
for code, name in sorted(letters.items()):
    print(" ".join([f"{code:x}", str(font["hmtx"][name][0]), *outline(glyphs, name)]))
