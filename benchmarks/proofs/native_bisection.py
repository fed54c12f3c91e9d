"""Compiles the native bisection: the finder's own module, with `bisection/proof/finder.hpp` in the place of its search."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import sysconfig
from functools import cache
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from spacearm.proof import finder
from spacearm.proof.claim import Claim

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
FLAGS = ("-std=c++20", "-O3", "-fno-tree-slp-vectorize", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off")
NAMES = ("SPACEARM_NAMESPACE=bisection_lanes", "SPACEARM_LEVEL=0", "NB_DOMAIN=bisection", "NDEBUG")


@cache
def native_bisection(environment: Path) -> Any:
    """Return the module; it is compiled anew if a source is newer. It needs g++ and nanobind."""
    import nanobind

    into = environment / "bisection" / "_proof.so"
    main = REPOSITORY / "kernel" / "proof" / "proof_module.cpp"
    sources = [*main.parent.glob("*.?pp"), *(HERE / "bisection").rglob("*.hpp")]
    if not into.exists() or into.stat().st_mtime < max(path.stat().st_mtime for path in sources):
        into.parent.mkdir(parents=True, exist_ok=True)
        library = Path(nanobind.include_dir()).parent
        folders = [HERE / "bisection", REPOSITORY / "kernel", library / "include", library / "ext/robin_map/include"]
        options = [f"-I{folder}" for folder in (*folders, sysconfig.get_path("include"))] + [f"-D{name}" for name in NAMES]
        files = [str(main), str(library / "src" / "nb_combined.cpp")]
        subprocess.run(["g++", *FLAGS, "-fPIC", "-shared", "-w", *options, *files, "-o", str(into)], check=True)
    loader = ExtensionFileLoader("_proof", str(into))
    spec = importlib.util.spec_from_loader("_proof", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


@cache
def bisecting_finder(environment: Path) -> Any:
    """Return another copy of the module `spacearm.proof.finder`, with the native bisection in the place of the finder."""
    name = "spacearm.core.native_finder"
    own, sys.modules[name] = sys.modules[name], SimpleNamespace(native_finder=native_bisection(environment))  # type: ignore[assignment]
    try:
        spec = importlib.util.spec_from_file_location("bisecting_finder", finder.__file__)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["bisecting_finder"] = module  # dataclasses look their module up
        spec.loader.exec_module(module)
    finally:
        sys.modules[name] = own
    return module


def bisect(claim: Claim, environment: Path) -> finder.Found:
    """Bisect a claim's pairs."""
    return bisecting_finder(environment).find_proof(claim)
