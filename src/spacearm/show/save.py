"""Figures as files: the same figure gives the same bytes, with where it came from in the metadata."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from spacearm.errors import OutputError
from spacearm.interrupts import unbroken
from spacearm.output import write_new
from spacearm.show.style import look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 300  # of the PNG, and of what is not drawn as lines in the PDF

_PDF_FIELDS = ("Title", "Author", "Subject")


def save_figure(figure: Figure, path_stem: str | os.PathLike[str], *, provenance: Mapping[str, str]) -> tuple[Path, Path]:
    """Write a figure as PNG and PDF. The figure's layout is settled by it and stays so.

    Args:
        figure: to be written.
        path_stem: of the files, without ".png" and ".pdf".
        provenance: what the figure was made from, as the seed, the version and the command; kept in both files.

    Returns:
        The paths of the PNG and the PDF.

    Raises:
        OutputError: one of the files exists, or cannot be written.
    """
    stem = Path(path_stem)
    png, pdf = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.pdf")
    for path in (png, pdf):
        if os.path.lexists(path):
            raise OutputError(f"{path} exists, expected a new file for the figure; choose another name or move it away")
    with unbroken():  # what draws would swallow Ctrl-C now and then, or trip over it
        _settle(figure)
        contents = _png(figure, provenance), _pdf(figure, provenance)
    with unbroken():
        write_new(png, contents[0])
        try:
            write_new(pdf, contents[1])
        except OutputError:
            png.unlink(missing_ok=True)
            raise
    return png, pdf


def _settle(figure: Figure) -> None:
    """Lay the figure out once, so that both files show the same layout, however often they are written."""
    if figure.get_layout_engine() is not None:
        with look():
            figure.draw_without_rendering()
        figure.set_layout_engine("none")


def _png(figure: Figure, provenance: Mapping[str, str]) -> bytes:
    buffer = io.BytesIO()
    with look():
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None, **provenance})
    return buffer.getvalue()


def _pdf(figure: Figure, provenance: Mapping[str, str]) -> bytes:
    """Write the PDF, whose metadata has fixed fields: what of the provenance has none is in its keywords."""
    buffer = io.BytesIO()
    fields = {key: value for key, value in provenance.items() if key in _PDF_FIELDS}
    keywords = "; ".join(f"{key}: {value}" for key, value in provenance.items() if key not in _PDF_FIELDS)
    metadata = {"Creator": "spacearm", "Producer": None, "CreationDate": None, "Keywords": keywords or None, **fields}
    with look():
        figure.savefig(buffer, format="pdf", dpi=DPI, metadata=metadata)
    return buffer.getvalue()
