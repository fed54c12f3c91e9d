"""What a notebook shows of a value beside its `repr`: HTML, made by whoever has registered for it.

The values live on lower floors than `report`, which draws them: they know nothing of it. The package root, which may import
every room, registers a function here that imports `report` when a notebook first asks; a program outside of notebooks never
does.
"""

from __future__ import annotations

from collections.abc import Callable

_makers: list[Callable[[object], str]] = []


def show_by(make: Callable[[object], str]) -> None:
    """Register what makes the HTML of a value; the last one registered counts."""
    _makers[:] = [make]


class InNotebooks:
    """Base of the values that notebooks (Jupyter, VS Code, Colab) show as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        """Return HTML that needs no network; None, as IPython takes it, where nothing makes any."""
        return _makers[0](self) if _makers else None
