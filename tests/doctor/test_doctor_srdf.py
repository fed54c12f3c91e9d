"""What an SRDF switches off although it can meet, what it leaves on although it always meets, and names of nobody."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spacearm.core.errors import FileFormatError
from spacearm.doctor import diagnose
from spacearm.robot import load_robot
from support.doctor_text import HEALTHY, codes, found_in, written
from support.srdf_text import disabled, group, srdf, state

_NEIGHBOURS = (disabled("base", "upper"), disabled("fore", "upper"))

FOLDING = HEALTHY.replace('lower="-2.5" upper="2.5"', 'lower="-2.9" upper="2.9"')
"""The forearm's end can be folded into the base."""


def test_neighbours_may_be_switched_off(tmp_path: Path) -> None:
    found = found_in(tmp_path, HEALTHY, srdf(*_NEIGHBOURS))
    assert codes(found) == []


def test_a_pair_that_is_switched_off_and_can_meet_is_found_with_its_line(tmp_path: Path) -> None:
    text = srdf(*_NEIGHBOURS, disabled("fore", "base"))
    (finding,) = found_in(tmp_path, FOLDING, text).warnings
    assert (finding.code, finding.place) == ("pair-switched-off", "'base' and 'fore'")
    assert finding.file == str(tmp_path / "arm.srdf")
    assert finding.line is not None
    assert 'link1="fore" link2="base"' in text.splitlines()[finding.line - 1]
    assert "reason 'Adjacent'" in finding.value


def test_the_share_of_configurations_is_that_of_a_drawing(tmp_path: Path) -> None:
    # The arm moves in a plane: the forearm, a segment with a radius, against the square that it is folded onto.
    text = HEALTHY.replace('size="1 1 1"', 'size="1.6 1 1"').replace('lower="-2.5" upper="2.5"', 'lower="1.5" upper="2.9"')
    (finding,) = found_in(tmp_path, text, srdf(*_NEIGHBOURS, disabled("fore", "base"))).warnings
    said = float(finding.what.partition(" in ")[2].partition("%")[0]) / 100
    rng = np.random.default_rng(1)
    q = rng.uniform((-1.5, 1.5), (1.5, 2.9), size=(20_000, 2))
    elbow = np.stack([1.1 * np.sin(q[:, 0]), 0.6 + 1.1 * np.cos(q[:, 0])], axis=1)
    along = np.stack([np.sin(q.sum(axis=1)), np.cos(q.sum(axis=1))], axis=1)
    points = elbow[:, None] + np.linspace(0, 0.8, 40)[:, None] * along[:, None]
    gap = np.linalg.norm(np.maximum(np.abs(points) - (0.8, 0.5), 0), axis=2).min(axis=1)
    least, most = (gap < 0.03).mean(), (gap < 0.08).mean()  # the cylinder's ends are flat
    assert 0.02 < least < most
    spread = 4 * np.sqrt(most / 2000)  # of 2000 samples, four standard deviations: 1 false alarm in 16,000
    assert least - spread < said < most + spread


def test_shapes_that_stay_apart_may_be_switched_off(tmp_path: Path) -> None:
    # At its limit the forearm's end passes 0.1 m beside the cube.
    text = HEALTHY.replace('lower="-2.5" upper="2.5"', 'lower="-2.2" upper="2.2"')
    assert codes(found_in(tmp_path, text, srdf(*_NEIGHBOURS, disabled("fore", "base")))) == []


def test_a_whole_link_that_is_silent_is_no_way_around(tmp_path: Path) -> None:
    found = found_in(tmp_path, FOLDING, srdf('<disable_default_collisions link="fore"/>', disabled("base", "upper")))
    assert [(one.code, one.place) for one in found.warnings] == [("pair-switched-off", "'base' and 'fore'")]


def test_a_pair_that_always_meets_and_that_an_srdf_forgets_is_told(tmp_path: Path) -> None:
    text = HEALTHY.replace('size="1 1 1"', 'size="1 1 1.3"')
    found = found_in(tmp_path, text, srdf(disabled("fore", "upper")))
    (one,) = [one for one in found.warnings if one.code == "pair-always-meets"]
    assert one.place == "'base' and 'upper'"
    assert "neighbours that overlap in every configuration" in one.what


ALWAYS = HEALTHY.replace('xyz="0 0 0.6"', 'xyz="0 0 0.3"').replace('xyz="0 0 1.1"', 'xyz="0 0.2 -0.1"')
"""The elbow is in the base, so the forearm always is."""


def test_links_that_overlap_in_every_configuration_are_an_error_with_both_names_the_depth_and_the_remedy(
    tmp_path: Path,
) -> None:
    for text in (None, srdf(*_NEIGHBOURS)):
        found = found_in(tmp_path, ALWAYS, text)
        (one,) = [one for one in found.errors if one.code == "pair-always-meets"]
        assert not found.healthy
        assert one.place == "'base' and 'fore'"
        depth = float(one.what.partition("overlap by ")[2].partition(" mm")[0])
        assert 100 < depth < 300  # 0.2 m above the elbow is the top of the base
        assert "in every configuration" in one.what
        assert ("the SRDF does not allow them to" in one.what) == (text is not None)
        assert "correct the shapes, or allow the pair in an SRDF" in one.advice
    assert codes(found_in(tmp_path, ALWAYS, srdf(*_NEIGHBOURS, disabled("base", "fore")))) == []


def test_links_that_meet_nearly_always_are_a_warning_and_stay_checked(tmp_path: Path) -> None:
    text = HEALTHY.replace('xyz="0 0 0.6"', 'xyz="0 0 0.4"').replace('lower="-2.5" upper="2.5"', 'lower="-0.65" upper="2.9"')
    text = text.replace('xyz="0 0 1.1"', 'xyz="0 0.2 0"').replace('lower="-1.5" upper="1.5"', 'lower="1.2" upper="1.5"')
    text = text.replace('<origin xyz="0 0 0.4"/> <!-- drawn in 2024 -->', '<origin xyz="0 0 0.6"/>')
    found = found_in(tmp_path, text, srdf(*_NEIGHBOURS))
    (one,) = [one for one in found.warnings if one.code.startswith("pair")]
    assert (one.code, one.place) == ("pair-nearly-always-meets", "'base' and 'fore'")
    robot = load_robot(written(tmp_path, text), srdf=written(tmp_path, srdf(*_NEIGHBOURS), "arm.srdf"))
    assert ("base", "fore") in robot.self_pairs


def test_names_of_nobody_are_told_once_and_by_what_they_do(tmp_path: Path) -> None:
    text = srdf(
        *_NEIGHBOURS,
        disabled("base", "foer"),
        disabled("upper", "foer"),
        group("arm", chain=("base", "hnad")),
        state("home", "arm", shuolder=0.0),
        state("home", "gripper", elbow=0.0),
    )
    found = found_in(tmp_path, HEALTHY, text)
    told = {(one.severity, one.place): one for one in found.findings if one.code == "srdf-unknown-name"}
    assert set(told) == {
        ("error", "link 'hnad'"),
        ("warning", "joint 'shuolder'"),
        ("warning", "group 'gripper'"),
        ("note", "link 'foer'"),
    }
    assert "1 more line" in told["note", "link 'foer'"].what
    assert told["error", "link 'hnad'"].advice == "did you mean 'hand'?"


def test_a_broken_srdf_is_a_finding_and_does_not_end_the_examination(tmp_path: Path) -> None:
    text = srdf('<disable_collisions link1="base"/>')
    found = found_in(tmp_path, HEALTHY.replace(' velocity="0.1"', ""), text)
    assert {"srdf-broken", "velocity-missing"} <= set(codes(found))


def test_pairs_are_looked_at_although_the_model_cannot_be_loaded(tmp_path: Path) -> None:
    broken = FOLDING.replace(' velocity="0.1"', "").replace("<inertia ", "<inetria ")
    assert "pair-switched-off" in codes(found_in(tmp_path, broken, srdf(*_NEIGHBOURS, disabled("fore", "base"))))


@pytest.mark.parametrize("text", ["", "<robot", HEALTHY])
def test_what_is_no_srdf_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"arm\.srdf"):
        diagnose(written(tmp_path, HEALTHY), written(tmp_path, text, "arm.srdf"))
    with pytest.raises(FileFormatError, match="does not exist"):
        diagnose(tmp_path / "arm.urdf", tmp_path / "none.srdf")
