"""Write the stubs of the compiled kernel, which type `core.native.native` and `core.native_finder.native_finder`.

    python tools/kernel_stub.py            # after a change of what the kernel binds

They are src/spacearm/_kernel/kernel.pyi and _proof.pyi. All levels of the kernel bind the same names, so one stub serves them
all; a test generates the stubs again and compares.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import nanobind
from nanobind.stubgen import StubGen

FOLDER = Path(__file__).resolve().parent.parent / "src" / "spacearm" / "_kernel"
STUB, PROOF_STUB = FOLDER / "kernel.pyi", FOLDER / "_proof.pyi"
WRITTEN = f"Written by tools/kernel_stub.py with nanobind {nanobind.__version__}"
HEADER = f'"""The compiled kernel, the same at every level. {WRITTEN}: do not edit."""\n\n'
PROOF_HEADER = f'"""The finder of proofs, compiled. {WRITTEN}: do not edit."""\n\n'


def stub_of(module: ModuleType, header: str = HEADER) -> str:
    """Return the stub of a level's module, or of another one with its header."""
    generator = StubGen(module)
    generator.put(module)
    text = generator.get().replace(f"{module.__name__}.", "")
    text = re.sub(r'^""".*?"""\n', "", text, flags=re.S)
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
    return header + "\n".join(line.rstrip() for line in text.strip().splitlines()) + "\n"


def main() -> None:
    """Write them."""
    from spacearm.core.native import available_levels, load_level
    from spacearm.core.native_finder import native_finder

    STUB.write_text(stub_of(load_level(available_levels()[0])), encoding="utf-8")
    PROOF_STUB.write_text(stub_of(native_finder, PROOF_HEADER), encoding="utf-8")


if __name__ == "__main__":
    main()
