"""Files with a given content."""

from __future__ import annotations

from pathlib import Path


def written(directory: Path, text: str | bytes, name: str = "problem.yaml") -> Path:
    path = directory / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
