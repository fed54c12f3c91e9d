"""Colours of the viewer: Okabe's and Ito's for the colour-blind where they mean something, quiet greys for all else."""

from __future__ import annotations

from spacearm.view.nearest import Tone

Color = tuple[int, int, int]

GOOD: Color = (0, 145, 105)  # these can be read on white and on black
NEAR: Color = (184, 125, 0)
BAD: Color = (205, 88, 0)
PLAIN: Color = (110, 120, 131)
TONES: dict[Tone, Color] = {"good": GOOD, "near": NEAR, "bad": BAD, "plain": PLAIN}

LINKS: tuple[Color, Color] = (214, 218, 222), (138, 146, 154)
BASE: Color = (200, 192, 176)
OBSTACLE: Color = (112, 134, 164)
CHOSEN: Color = (86, 160, 211)
PATH: Color = (0, 114, 178)
BASE_PATH: Color = (148, 103, 44)
CANDIDATE: Color = (140, 178, 205)
BEST_CANDIDATE: Color = (0, 114, 178)
BRAND: Color = (0, 114, 178)
GRID: tuple[Color, Color] = (222, 226, 231), (196, 203, 211)
"""Cells and every fifth line."""

DARK_GRID: tuple[Color, Color] = (52, 57, 63), (78, 85, 93)


def css(color: Color) -> str:
    """Return a colour as CSS has it."""
    return f"rgb({color[0]}, {color[1]}, {color[2]})"
