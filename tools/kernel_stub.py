"""Write the stub of the compiled kernel, which types `spacearm.core.native.native`: src/spacearm/_kernel/kernel.pyi.

    python tools/kernel_stub.py            # after a change of what the kernel binds

All levels bind the same names, so one stub serves them all; a test generates it again and compares.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import nanobind
from nanobind.stubgen import StubGen

STUB = Path(__file__).resolve().parent.parent / "src" / "spacearm" / "_kernel" / "kernel.pyi"
WRITTEN = f"Written by tools/kernel_stub.py with nanobind {nanobind.__version__}"
HEADER = f'"""The compiled kernel, the same at every level. {WRITTEN}: do not edit."""\n\n'


def stub_of(module: ModuleType) -> str:
    """Return the stub of a level's module."""
    generator = StubGen(module)
    generator.put(module)
    text = generator.get().replace(f"{module.__name__}.", "")
    text = re.sub(r'^"""The native kernel.*?"""\n', "", text, flags=re.S)
    # A property that can be set is a plain attribute; one that cannot stays a property.
    text = re.sub(
        r"^( +)@property\n +def (\w+)\(self\) -> (.*): \.\.\.\n\n +@\2\.setter\n +def \2\(self, arg: \3, /\) -> None: \.\.\.\n",
        r"\1\2: \3\n",
        text,
        flags=re.M,
    )
    # The shapes are told beside the arrays' types; order and device are the same for all.
    text = re.sub(r", device='cpu', writable=False\)", ")", text)
    # What differs between levels and compilers.
    text = text.replace("motion_terms: tuple =", "motion_terms: tuple[str, ...] =")
    text = re.sub(r"^(\w+): (str|int|tuple.*) = .*$", r"\1: \2 = ...", text, flags=re.M)
    return HEADER + "\n".join(line.rstrip() for line in text.strip().splitlines()) + "\n"


def main() -> None:
    """Write it."""
    from spacearm.core.native import available_levels, load_level

    STUB.write_text(stub_of(load_level(available_levels()[0])), encoding="utf-8")


if __name__ == "__main__":
    main()
