"""Colours of the viewer: Okabe's and Ito's for the colour-blind where they mean something, quiet greys for all else."""

from __future__ import annotations

from spacearm.view.nearest import Tone

Color = tuple[int, int, int]

GOOD: Color = (0, 121, 90)
NEAR: Color = (196, 138, 0)
BAD: Color = (194, 74, 0)
PLAIN: Color = (77, 87, 97)
TONES: dict[Tone, Color] = {"good": GOOD, "near": NEAR, "bad": BAD, "plain": PLAIN}

LINKS: tuple[Color, Color] = (205, 212, 219), (104, 118, 135)
BASE: Color = (200, 192, 176)
OBSTACLE: Color = (132, 146, 162)
CHOSEN: Color = (86, 160, 211)
PATH: Color = (0, 114, 178)
BASE_PATH: Color = (148, 103, 44)
CANDIDATE: Color = (140, 178, 205)
BEST_CANDIDATE: Color = (0, 114, 178)
BRAND: Color = (0, 114, 178)
SKY: Color = (244, 246, 248)
DARK_SKY: Color = (23, 27, 32)


def css(color: Color) -> str:
    """Return a colour as CSS has it."""
    return f"rgb({color[0]}, {color[1]}, {color[2]})"
