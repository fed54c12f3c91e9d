"""The installed version, which pyproject.toml states once."""

from __future__ import annotations

from importlib import metadata


def version() -> str:
    """Return the version of the installed package."""
    return metadata.version("spacearm")
