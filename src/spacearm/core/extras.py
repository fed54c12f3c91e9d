"""Libraries that only some users need: the extras of the package, and the sentence for who lacks one."""

from __future__ import annotations

from importlib.util import find_spec

from spacearm.core.errors import SettingsError

_EXTRAS = {"matplotlib": "figures", "toppra": "time-optimal", "viser": "view"}
"""Module of a library, and the extra that brings it (`pyproject.toml`)."""


def has_extra(module: str) -> bool:
    """Whether a library of an extra is installed; nothing is imported."""
    return find_spec(module) is not None


def require_extra(module: str, what: str, *, instead: str = "") -> None:
    """Refuse what needs a library that is not installed, before any work is done.

    Args:
        module: the library, one of the extras'.
        what: that needs it, the subject of the message.
        instead: what can be done without it.

    Raises:
        SettingsError: it is not installed; the message says how to install it.
    """
    if not has_extra(module):
        install = f"pip install 'spacearm[{_EXTRAS[module]}]'"
        raise SettingsError(f"{what} needs {module}, which is not installed; {install}{f', or {instead}' if instead else ''}")
