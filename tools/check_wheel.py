"""Try a wheel as a user would: in a fresh environment, in an empty folder, without a compiler.

python tools/check_wheel.py dist/spacearm-....whl            # install it, plan, prove again, report
python tools/check_wheel.py --sizes dist/spacearm-....whl    # also: what the core and each extra take on the disk
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
USER_EXTRAS = ("figures", "time-optimal", "view")
NOT_IN_CORE = ("matplotlib", "toppra", "viser")
SIZE = """
import importlib.metadata as m, json
print(json.dumps({d.metadata["Name"].lower(): sum(f.locate().stat().st_size for f in d.files or [] if f.locate().is_file())
                  for d in m.distributions()}))
"""


class Environment:
    """A fresh environment whose programs find no compiler."""

    def __init__(self, folder: Path) -> None:
        venv.create(folder / "env", with_pip=True)
        self.bin = folder / "env" / "bin"
        self.cwd = folder / "empty"
        self.cwd.mkdir()
        without = {"CC": "/bin/false", "CXX": "/bin/false", "PATH": str(self.bin)}
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV", "SPACEARM"))}
        self.variables = kept | without

    def run(self, *command: str) -> str:
        """Run a program of the environment; stop with its output if it fails."""
        program = str(self.bin / command[0])
        done = subprocess.run([program, *command[1:]], cwd=self.cwd, env=self.variables, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
        return done.stdout

    def install(self, what: str) -> None:
        """Install from wheels alone."""
        self.run("python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:", what)

    def sizes(self) -> dict[str, int]:
        """Return the size of each installed distribution [bytes]."""
        import json

        return json.loads(self.run("python", "-c", SIZE))


def use(env: Environment) -> None:
    """Plan, prove again and report, as the README does, far from the sources."""
    print(env.run("spacearm", "--version").strip())
    for name in NOT_IN_CORE:
        found = env.run("python", "-c", f"import importlib.util as u; print(u.find_spec({name!r}) is not None)").strip()
        if found != "False":
            sys.exit(f"the core brings {name}, expected it in an extra only")
    problems = sorted(EXAMPLES.glob("01_*.yaml"))
    if not problems:
        sys.exit(f"{EXAMPLES} has no problem whose name begins with 01_")
    print(env.run("spacearm", "plan", str(problems[0]), "-o", "out", "--seed", "0"))
    print(env.run("spacearm", "certify", "out/plan.json"))
    report = env.cwd / "out" / "report.html"
    if not report.is_file():
        sys.exit("spacearm plan wrote no report.html")
    print(f"report.html: {report.stat().st_size / 1e6:.2f} MB")


def main() -> None:
    """Check a wheel."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--sizes", action="store_true", help="also install each extra, and tell what it takes [MB]")
    given = parser.parse_args()
    wheel = given.wheel.resolve()
    with tempfile.TemporaryDirectory() as folder:
        env = Environment(Path(folder))
        empty = env.sizes()
        env.install(str(wheel))
        use(env)
        if given.sizes:
            before = env.sizes()
            total = sum(before.values()) - sum(empty.values())
            largest = sorted(before, key=before.__getitem__, reverse=True)[:8]
            print(f"core: {total / 1e6:.0f} MB, of which " + ", ".join(f"{n} {before[n] / 1e6:.0f}" for n in largest))
            for extra in USER_EXTRAS:
                env.install(f"{wheel}[{extra}]")
                now = env.sizes()
                new = {name: now[name] for name in now if name not in before}
                listed = ", ".join(f"{name} {size / 1e6:.1f}" for name, size in sorted(new.items(), key=lambda e: -e[1])[:6])
                print(f"{extra}: {sum(new.values()) / 1e6:.0f} MB more ({listed})")
                before = now
    print(f"{wheel.name} works without a compiler.")


if __name__ == "__main__":
    main()
