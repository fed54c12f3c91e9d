"""Names that have moved: old modules still lead to them, with a DeprecationWarning that tells the new place.

`from spacearm.momentum.quick import moving` goes on working. What is imported is looked for in the room that has it now. This
serves programs that were written before the rooms were built; it goes with the next release that breaks names.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

_ROOMS: dict[str, tuple[str, ...]] = {
    "_kernel": ("core.native",),
    "_kernel.exact": ("core.exact",),
    "bench": ("study",),
    "momentum": ("dynamics", "core.rotations"),
    "motion": ("files", "motion", "dynamics"),
    "paper": ("study",),
    "planner": ("files", "planner", "dynamics", "core.rotations"),
    "proof": ("proof", "core"),
    "robot": ("robot", "doctor", "core.rotations"),
    "scene": ("geometry",),
    "show": ("show",),
    "swarm": ("swarm", "core"),
    **dict.fromkeys(("checks", "interrupts", "output", "reading", "records", "settings"), ("core",)),
    **dict.fromkeys(("strict_model", "version"), ("core",)),
    "meshes": ("geometry",),
}
"""By the old room: where its names are now, in the order of looking."""

_OLD_MODULES: dict[str, str] = {
    "_kernel": "exact",
    "motion": "base_columns bernstein cubic_law curve exports for_robot joint_trajectory margins on_a_base "
    "optimal plain refined_law resampled retimed stated stated_times table_rows tables timelaw "
    "toppra_law trajectory_files",
    "planner": "base_report files floating held held_mass islands motion_swarm moveit reaching result search settings",
    "proof": "base base_limits digest drift ellipses intervals kept masses measuring middles pairs quaternions "
    "recoil residual solids spans stance suprema tumbling vectors",
    "robot": "base bodies box_capsules capsule_closer capsule_split centres doctor envelope_report excess "
    "groups held_elsewhere held_joints inertials joint_limits_file left_out limits links load "
    "never_meet plain rotations segments shape_notes srdf_fit tip tree urdf_check xml_repair xml_root "
    "yaml_parts yaml_robot yaml_schema",
    "show": "arm base base_paths clearance convergence joints momentum_residual obstacles_in_space overview "
    "pareto path path_drawing path_space save shapes style",
    "swarm": "engine named native_run result seed settings",
}
"""By room: modules that it no longer has. Rooms that are gone have none of theirs."""

_STANDING = frozenset(_OLD_MODULES)
"""Rooms that are still there under their names."""


def moved_name(module: str, name: str) -> object:
    """Return what a module once had, from where it is now.

    Args:
        module: the old module or room, with its dots.
        name: asked of it.

    Raises:
        AttributeError: no such name is known.
    """
    inner = module.removeprefix("spacearm.")
    rooms = _ROOMS.get(inner) or _ROOMS.get(inner.split(".")[0], ())
    if not name.startswith("__"):
        for candidate in _modules_of(rooms):
            found = importlib.import_module(candidate)
            if candidate != module and name in vars(found) and not isinstance(vars(found)[name], _MovedModule):
                place = getattr(vars(found)[name], "__module__", None) or candidate
                warnings.warn(f"{module}.{name} is now {place}.{name}", DeprecationWarning, stacklevel=3)
                return vars(found)[name]
    raise AttributeError(f"module {module!r} has no attribute {name!r}")


def _modules_of(rooms: Sequence[str]) -> list[str]:
    import pkgutil  # here, since nearly nobody needs it

    out: list[str] = []
    for room in rooms:
        whole = f"spacearm.{room}"
        path: Sequence[str] = getattr(importlib.import_module(whole), "__path__", ())
        out += [whole, *(f"{whole}.{info.name}" for info in pkgutil.iter_modules(path) if info.name != "__main__")]
    return out


class _MovedModule(ModuleType):
    """A module that is gone: each of its names is looked for where it is now."""

    def __getattr__(self, name: str) -> object:
        return moved_name(self.__name__, name)


class _MovedModules:
    """Finds modules that are gone, after all other finders, and loads them.

    It has what `sys.meta_path` asks for. The classes of `importlib.abc` are not its bases: their import takes 13 ms.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a module's spec; None for what never was."""
        parts = fullname.split(".")
        if parts[0] != "spacearm" or len(parts) < 2:
            return None
        gone = parts[1] in _ROOMS and parts[1] not in _STANDING
        if not gone and (len(parts) < 3 or parts[2] not in _OLD_MODULES.get(parts[1], "").split()):
            return None
        return ModuleSpec(fullname, self, is_package=True)  # pyright: ignore[reportArgumentType]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the empty module."""
        return _MovedModule(spec.name, "Moved: see spacearm.core.moved.")

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: names are looked for when they are asked for."""


def find_moved_modules() -> None:
    """Let old modules be imported; called once, by the package."""
    if not any(type(finder).__name__ == _MovedModules.__name__ for finder in sys.meta_path):
        sys.meta_path.append(_MovedModules())
