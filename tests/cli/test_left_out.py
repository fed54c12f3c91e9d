"""`spacearm plan` and `certify` name every pair of links that is not checked, and refuse a robot without an envelope."""

from __future__ import annotations

from pathlib import Path

from cli.conftest import Told
from support import srdf_text, urdf_text

BALL = urdf_text.collision('<sphere radius="0.06"/>')
DRAWN = '<visual><geometry><sphere radius="0.05"/></geometry></visual>'


def written(folder: Path, shape: str, robot: str = "arm.urdf") -> Path:
    joints = [
        urdf_text.joint("j1", "base", "a", xyz="0 0 0.1", axis="0 1 0"),
        urdf_text.joint("j2", "a", "b", xyz="0 0 0.06"),
        urdf_text.joint("j3", "b", "c"),
    ]
    links = [urdf_text.link("base", DRAWN), *(urdf_text.link(name, shape) for name in "abc")]
    (folder / "arm.urdf").write_text(urdf_text.robot(*links, *joints))
    (folder / "arm.srdf").write_text(srdf_text.srdf(srdf_text.disabled("a", "b"), srdf_text.disabled("b", "c")))
    path = folder / "problem.yaml"
    path.write_text(f"spacearm: 1\nrobot: {robot}\nstart: [0, 0, 0]\ngoal: {{configuration: [0.5, 0, 0]}}\n")
    return path


def test_what_is_not_checked_is_printed_with_the_reason(told: Told, tmp_path: Path) -> None:
    path = written(tmp_path, BALL, "{file: arm.urdf, srdf: arm.srdf}")
    out = tmp_path / "out"
    for arguments in (["plan", path, "-o", out, "--no-report"], ["certify", out / "plan.json"]):
        code, printed, _ = told(arguments)
        assert code == 0
        rows = [line.split(None, 2)[2] for line in printed.splitlines() if line.startswith("not checked")]
        (overlap, allowed) = rows
        assert overlap.startswith("1 pair, always in contact: a - c overlap by 59.9 mm or more in every configuration")
        assert allowed == "2 pairs, allowed to touch: a - b, b - c"
        assert "no envelope" in printed
        assert "correct the shapes, or allow the pair in the SRDF" in " ".join(printed.split())


def test_a_robot_without_an_envelope_is_wrong_input(told: Told, tmp_path: Path) -> None:
    code, printed, said = told(["plan", written(tmp_path, DRAWN), "-o", tmp_path / "out"])
    assert (code, printed) == (2, "")
    assert "has no envelope" in said
    assert not (tmp_path / "out").exists()
    meant = written(tmp_path, DRAWN, "{file: arm.urdf, collision: none}")
    code, printed, _ = told(["plan", meant, "-o", tmp_path / "out", "--no-report"])
    assert code == 0
    assert "meant to have no envelope" in printed
