"""The native kernel: the build for this processor, chosen once at import.

`SPACEARM_KERNEL` forces a level, one of `kernel_info().available`.
"""

from __future__ import annotations

import importlib
import os
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING

from spacearm.core.brief import Brief
from spacearm.core.checks import shown_error
from spacearm.core.errors import KernelError, nearest

try:
    from spacearm._kernel import _processor
except ImportError as missing:
    raise KernelError(
        f"the compiled kernel cannot be loaded ({shown_error(missing)}), expected one built for this Python; "
        "install spacearm again"
    ) from None

ENVIRONMENT_VARIABLE = "SPACEARM_KERNEL"
_MODULE_OF_LEVEL = {
    "x86-64-v4": "_x86_64_v4",
    "x86-64-v3": "_x86_64_v3",
    "x86-64-v2": "_x86_64_v2",
    "generic": "_generic",
}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class KernelInfo(Brief):
    """Which build of the kernel runs, and which others this processor could run."""

    level: str
    available: tuple[str, ...]
    lanes_float32: int
    lanes_float64: int
    compiler: str


def available_levels() -> tuple[str, ...]:
    """The instruction levels that this processor supports, fastest first."""
    return tuple(_processor.levels())


def load_level(level: str) -> ModuleType:
    """Import the kernel's build for one level.

    Raises:
        KernelError: the level is unknown, or this processor cannot run it.
    """
    if level not in _MODULE_OF_LEVEL:
        raise KernelError(
            f"{ENVIRONMENT_VARIABLE}={level!r} is not a kernel level, expected one or none set; "
            f"{nearest(level, available_levels())}"
        )
    if level not in available_levels():
        raise KernelError(
            f"{ENVIRONMENT_VARIABLE}={level!r} asks for instructions this processor lacks; "
            f"it runs {', '.join(available_levels())}: choose one of these or unset the variable"
        )
    return importlib.import_module(f"spacearm._kernel.{_MODULE_OF_LEVEL[level]}")


if TYPE_CHECKING:
    from spacearm._kernel import kernel as native  # the stub that all levels have in common
else:
    native = load_level(os.environ.get(ENVIRONMENT_VARIABLE) or available_levels()[0])


def kernel_info() -> KernelInfo:
    """Tell which build of the kernel runs here."""
    return KernelInfo(
        level=native.level,
        available=available_levels(),
        lanes_float32=native.lanes32,
        lanes_float64=native.lanes64,
        compiler=native.compiler,
    )
