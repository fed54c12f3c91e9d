"""Reports of plans: what the page holds of plans found and not found, of files and of certificates; its size, and its bytes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from house.source import REPOSITORY
from spacearm.core.errors import OutputError, ProblemError
from spacearm.files.plan_file import plan_text
from spacearm.report.report_curves import instants_of, sampled, turned_since_start
from spacearm.report.report_page import page_html
from spacearm.report.report_plan import report_of_plans
from support.drawn_claims import drawn_claim
from support.report_pages import content, curve, section, unpacked

Array = np.ndarray

ROBOT = sa.load_robot("zhang2022")
START, GOAL = np.zeros(7), np.array([1.0, 0.1, 0, 0.2, 0, 0, 0])
BALL = sa.Sphere([0.6, 0.2, 0.9], 0.08, name="buoy")


@pytest.fixture(scope="module")
def plan() -> sa.Plan:
    problem = sa.Problem(ROBOT, [BALL], start=START, goal=GOAL, clearances=[sa.PairClearance(0.02, obstacle="buoy")])
    return sa.plan(problem, sa.PlannerSettings(evaluations=300), rng=4)


@pytest.fixture(scope="module")
def floating() -> sa.Plan:
    file = REPOSITORY / "examples" / "05_floating_servicer.yaml"
    given = sa.load_problem(file)
    problem = replace(given, base_goal=None, base_limits=sa.BaseLimits(peak=math.radians(60)))
    return sa.plan(problem, sa.PlannerSettings(evaluations=1000), rng=1)


def titles(view: dict[str, Any]) -> list[str]:
    return [one["title"] for one in view["sections"]]


# ---- A plan ----------------------------------------------------------------------------------------------------------


def test_a_proven_plan_is_told_in_full(plan: sa.Plan) -> None:
    page = content(page_html(report_of_plans(plan)))
    assert page["spacearm-report"] == 1
    assert len(page["views"]) == 1
    view = page["views"][0]
    assert view["verdict"]["tone"] == "good"
    assert plan.certificate is not None
    assert plan.certificate.message in view["verdict"]["text"]
    assert {"Clearance", "Motion", "Joint limits", "Search", "Settings", "Make it again", "Provenance"} <= set(titles(view))
    assert "Pairs of links not checked" in titles(view)
    assert "Floating base" not in titles(view)
    assert view["clock"] == {"unit": "s", "duration": plan.trajectory.duration}  # type: ignore[union-attr]
    assert [one["name"] for one in view["obstacles"]] == ["buoy"]
    assert [(one["name"], one["kind"]) for one in view["targets"]] == [("start", "configuration"), ("goal", "configuration")]
    rows = dict(section(view, "Provenance")["rows"])
    assert rows["hash of the trajectory"] == f"sha256 {plan.certificate.trajectory_hash}"
    assert rows["spacearm"] == sa.__version__
    cells = dict(page["block"])
    assert cells["Seed"] == "4"
    assert cells["Clearance proven"].endswith(" mm")


def test_what_is_asked_and_proven_are_lines_of_the_clearance(plan: sa.Plan) -> None:
    view = report_of_plans(plan)["views"][0]
    found = next(one for one in view["plots"] if one["id"] == "clearance")
    assert found["log"]
    assert found["unit"] == "mm"
    lines = {one["label"].partition(":")[0]: one["value"] for one in found["lines"]}
    assert lines["asked for"] == pytest.approx(10)
    assert plan.certificate is not None
    assert lines["proven"] == pytest.approx(1e3 * plan.certificate.clearance, rel=1e-5)  # type: ignore[operator]
    t, least = curve(view, "clearance", "closest of all")
    assert (np.diff(t) >= 0).all()
    assert least.min() >= lines["proven"] - 1e-3
    near = plan.certificate.closest
    assert near is not None
    assert least.min() <= near.clearance * 1e3 + 1e-3  # its instant is among them
    assert any("of link" in row[1] or "obstacle 'buoy'" in row[1] for row in section(view, "Clearance")["rows"])


def test_the_joints_curves_are_the_trajectorys(plan: sa.Plan) -> None:
    view, trajectory = report_of_plans(plan)["views"][0], plan.trajectory
    assert trajectory is not None
    for name, row, limit in (
        ("positions", 0, ROBOT.upper),
        ("rates", 1, ROBOT.velocity),
        ("accelerations", 2, ROBOT.acceleration),
    ):
        t, values = curve(view, f"joint-{name}", ROBOT.dof_names[2])
        true = trajectory.sample(t)[row][:, 2]
        np.testing.assert_allclose(values, np.degrees(true), atol=1e-3)
        limits = next(one for one in view["plots"] if one["id"] == f"joint-{name}")["limits"]
        assert limits[2]["upper"] == pytest.approx(math.degrees(limit[2]))


def test_the_same_plan_gives_the_same_bytes_and_no_path(plan: sa.Plan, tmp_path: Path) -> None:
    again = sa.plan(plan.problem, plan.settings, rng=plan.seed)
    sa.save_report(plan, tmp_path / "a.html")
    sa.save_report(again, tmp_path / "b.html")
    text = (tmp_path / "a.html").read_text()
    assert text == (tmp_path / "b.html").read_text()
    assert str(tmp_path) not in text
    assert len(text) < 1.5e6


def test_a_report_is_not_written_over_anything(plan: sa.Plan, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text("mine")
    with pytest.raises(OutputError, match="overwrite=True"):
        sa.save_report(plan, path)
    assert path.read_text() == "mine"
    sa.save_report(plan, path, overwrite=True)
    assert path.read_text().startswith("<!doctype html>")


def test_the_python_call_makes_the_plan_again(plan: sa.Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sa.save_plan(plan, "plan.json")
    names: dict[str, Any] = {}
    exec(section(report_of_plans(plan)["views"][0], "Make it again")["code"], names)
    assert names["plan"].trajectory == plan.trajectory


def test_a_command_is_shown_where_it_is_known(plan: sa.Plan) -> None:
    view = report_of_plans(plan, commands=["spacearm plan a.yaml"])["views"][0]
    assert section(view, "Make it again")["code"] == "spacearm plan a.yaml"


def test_notes_of_robot_and_problem_are_listed() -> None:
    robot = replace(ROBOT, notes=("its limits were guessed",))
    problem = sa.Problem(robot, [], start=START, goal=GOAL, notes=["the goal was rounded"])
    view = report_of_plans(sa.plan(problem, sa.PlannerSettings(evaluations=50), rng=0))["views"][0]
    notes = section(view, "Notes")["notes"]
    assert "robot: its limits were guessed" in notes
    assert "problem: the goal was rounded" in notes


# ---- Without a proof -------------------------------------------------------------------------------------------------


def test_a_search_that_fails_shows_why_and_its_best_motion() -> None:
    wall = sa.Box([0.02, 4, 4], [0.35, 0, 0], name="wall")
    problem = sa.Problem(ROBOT, [wall], start=np.radians([90, 18, 0, 18, 0, 0, 0]), goal=np.radians([-90, 18, 0, 18, 0, 0, 0]))
    plan = sa.plan(problem, sa.PlannerSettings(evaluations=100, proofs=1), rng=0)
    assert not plan.found
    page = content(page_html(report_of_plans(plan)))
    view = page["views"][0]
    assert view["verdict"]["tone"] == "bad"
    assert plan.message[1:] in view["verdict"]["text"]
    assert ("not for execution" in view["verdict"]["text"]) == (plan.trajectory is not None)
    if plan.trajectory is not None:
        _, least = curve(view, "clearance", "closest of all")
        assert least.min() <= 1e-3
        assert "Contact is drawn at 0.1 mm" in next(one for one in view["plots"] if one["id"] == "clearance")["note"]


def test_without_a_motion_the_robot_stands_where_it_fails() -> None:
    problem = sa.Problem(ROBOT, [BALL], start=START, goal=sa.PositionGoal([5, 0, 0]))
    plan = sa.plan(problem, sa.PlannerSettings(evaluations=50), rng=0)
    assert plan.trajectory is None
    assert plan.ends.q is not None
    view = content(page_html(report_of_plans(plan)))["views"][0]
    assert unpacked(view["actors"][0]["knots"]["t"]).tolist() == [0.0]
    np.testing.assert_allclose(unpacked(view["actors"][0]["knots"]["q"]), plan.ends.q, atol=1e-6)
    assert view["plots"] == []
    assert view["verdict"]["text"].endswith("the robot stands in the configuration that comes nearest to the goal.")
    assert [one["kind"] for one in view["targets"]] == ["configuration", "position"]


def test_a_start_in_collision_shows_the_contact() -> None:
    tip = sa.forward_kinematics(ROBOT, START)[:3, 3]
    problem = sa.Problem(ROBOT, [sa.Sphere(tip, 0.05, name="clamp")], start=START, goal=GOAL)
    plan = sa.plan(problem, sa.PlannerSettings(evaluations=50), rng=0)
    assert plan.status == "start_in_collision"
    view = content(page_html(report_of_plans(plan)))["views"][0]
    np.testing.assert_allclose(unpacked(view["actors"][0]["knots"]["q"]), START, atol=1e-6)
    assert view["verdict"]["text"].endswith("the robot stands at the start.")
    assert unpacked(view["closest"]["distance"]) == pytest.approx(-plan.ends.contacts[0].depth, abs=1e-5)
    assert ["in the way", plan.ends.contacts[0].message] in section(view, "Clearance")["rows"]


def test_free_space_has_no_clearances_and_says_so() -> None:
    robot = replace(ROBOT, self_pairs=(), apart=None)
    plan = sa.plan(sa.Problem(robot, [], start=START, goal=GOAL), sa.PlannerSettings(evaluations=50), rng=0)
    view = report_of_plans(plan)["views"][0]
    assert "clearance" not in [one["id"] for one in view["plots"]]
    assert "closest" not in view
    assert any("nothing is in the way" in note for note in section(view, "Notes")["notes"])


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("seed", range(4))
def test_certificates_of_whatever_motion_are_shown(seed: int, floating: bool) -> None:
    drawn = drawn_claim(seed, floating=floating)
    certificate = sa.certify(_Setting(drawn), drawn.trajectory)
    html = page_html(report_of_plans(certificate))
    view = content(html)["views"][0]
    assert view["verdict"]["tone"] == ("good" if certificate.holds else "bad")
    assert certificate.message[1:] in view["verdict"]["text"]
    assert len(html) < 2e6


class _Setting:
    def __init__(self, drawn: Any) -> None:
        self.robot, self.scene, self.clearance = drawn.robot, drawn.scene, 0.0
        self.base, self.base_start, self.momentum = (
            getattr(drawn.trajectory, key) for key in ("base", "base_start", "momentum")
        )


# ---- Files -----------------------------------------------------------------------------------------------------------


def test_a_saved_plan_is_shown_as_what_the_file_says(plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    saved = sa.load_saved_plan(tmp_path / "plan.json")
    view, own = report_of_plans(saved)["views"][0], report_of_plans(plan)["views"][0]
    assert view["verdict"]["headline"].endswith("says the file")
    assert "not proven again" in view["verdict"]["text"]
    for key in ("actors", "obstacles", "targets", "plots", "closest", "clock"):
        assert view[key] == own[key], key
    for title in ("Clearance", "Motion", "Joint limits", "Settings", "Provenance", "Search", "Make it again"):
        assert section(view, title) == section(own, title)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("message", 3),
        ("near_pairs", [{"link": "hand"}]),
        ("closest", {"link": 1}),
        ("not_checked", []),
        ("limits", {"checked": [4]}),
        ("clearance_m", "much"),
        ("base", {"rate": 1}),
    ],
)
def test_a_certificate_that_is_nonsense_is_left_out(key: str, value: Any, plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    saved = sa.load_saved_plan(tmp_path / "plan.json")
    assert saved.certificate is not None
    broken = replace(saved, certificate={**saved.certificate, key: value}, search={"seed": "x", "history": [3], "fitness": [2]})
    view = content(page_html(report_of_plans(broken)))["views"][0]
    assert view["verdict"]["tone"] == "bad"
    assert any(f"no {key} that can be shown" in note for note in section(view, "Notes")["notes"])


def _edit_motion(values: dict[str, Any]) -> None:
    values["motion"]["control_points"][1][0] += 1e-3


def _edit_scene(values: dict[str, Any]) -> None:
    values["problem"]["obstacles"][0]["sphere"]["center"][0] += 1e-3


def _edit_status(values: dict[str, Any]) -> None:
    values["certificate"]["status"] = "fails"


def _drop_certificate(values: dict[str, Any]) -> None:
    values["certificate"] = None


@pytest.mark.parametrize("edit", [_edit_motion, _edit_scene, _edit_status, _drop_certificate])
def test_what_was_edited_since_its_proof_is_not_shown_as_proven(edit: Any, plan: sa.Plan, tmp_path: Path) -> None:
    values = json.loads(plan_text(plan))
    edit(values)
    (tmp_path / "plan.json").write_text(json.dumps(values))
    page = content(page_html(report_of_plans(sa.load_saved_plan(tmp_path / "plan.json"))))
    said = page["views"][0]["verdict"]
    assert said["tone"] == "bad"
    assert "Proven" not in said["headline"]
    assert "he file says that it is proven, which does not hold" in said["text"]
    assert ["Clearance proven", "none"] in page["block"]
    assert ["proven", "nothing"] in section(page["views"][0], "Clearance")["rows"]


def test_a_file_that_states_more_than_is_measured_is_not_shown_as_proven(plan: sa.Plan, tmp_path: Path) -> None:
    values = json.loads(plan_text(plan))
    values["certificate"]["clearance_m"] = values["certificate"]["closest"]["clearance_m"] + 1e-3
    (tmp_path / "plan.json").write_text(json.dumps(values))
    page = content(page_html(report_of_plans(sa.load_saved_plan(tmp_path / "plan.json"))))
    said = page["views"][0]["verdict"]
    assert said["tone"] == "bad"
    assert "Proven" not in said["headline"]
    assert "is measured for this page: it does not hold" in said["text"]
    assert ["Clearance proven", "none"] in page["block"]


def test_the_command_shows_nothing_of_a_file_but_known_settings(plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    saved = sa.load_saved_plan(tmp_path / "plan.json")
    settings = {**saved.search["settings"], "evaluations": 123, "x=__import__('os')": 1}
    settings["swarm"] = {**settings["swarm"], "kind": "load_plan('/etc/passwd') or sa.PSO"}
    page = content(page_html(report_of_plans(replace(saved, search={**saved.search, "settings": settings}))))
    code = section(page["views"][0], "Make it again")["code"]
    assert "evaluations=123" in code
    assert "import__" not in code
    assert "passwd" not in code


@pytest.mark.parametrize("value", [None, True, "x", [], {}, 10**400, 1e308, math.inf])
@pytest.mark.parametrize("key", ["evaluations", "fitness", "by", "island"])
def test_a_history_that_is_nonsense_is_left_out(key: str, value: Any, plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    saved = sa.load_saved_plan(tmp_path / "plan.json")
    history = [{**saved.search["history"][0], key: value if key != "by" or value != "x" else 3}, *saved.search["history"][1:]]
    page = content(page_html(report_of_plans(replace(saved, search={**saved.search, "history": history}))))
    assert "first motion" not in dict(section(page["views"][0], "Search")["rows"])


@pytest.mark.parametrize("value", [10**400, math.inf, True])
def test_a_certificates_number_that_is_none_is_left_out(value: Any, plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    saved = sa.load_saved_plan(tmp_path / "plan.json")
    broken = replace(saved, certificate={**(saved.certificate or {}), "clearance_m": value})
    assert content(page_html(report_of_plans(broken)))["views"][0]["verdict"]["tone"] == "bad"


def test_a_page_holds_no_infinite_number_and_no_half_character(plan: sa.Plan) -> None:
    page = report_of_plans(plan, title="a\udcff</title><script>")
    assert "<title>a?&lt;/title&gt;" in page_html(page).encode().decode()
    with pytest.raises(ProblemError, match="too large to be drawn"):
        page_html({**page, "views": [math.inf]})


@pytest.mark.parametrize("given", [3, None, "plan.json", [], [1], {"a": 1}])
def test_what_is_no_plan_is_refused(given: Any, tmp_path: Path) -> None:
    with pytest.raises(ProblemError, match="expected a Plan, a SavedPlan or a Certificate"):
        sa.save_report(given, tmp_path / "report.html")
    assert not list(tmp_path.iterdir())


# ---- A base that the arm moves ---------------------------------------------------------------------------------------


def test_a_floating_base_has_curves_and_figures_of_its_own(floating: sa.Plan) -> None:
    view, trajectory = report_of_plans(floating)["views"][0], floating.trajectory
    assert trajectory is not None
    assert floating.certificate is not None
    assert floating.certificate.floating is not None
    t, angle = curve(view, "base-angle", "angle")
    peak = math.degrees(floating.certificate.floating.rotation_peak)
    assert angle.max() == pytest.approx(peak, rel=1e-3)
    assert angle.max() <= peak + 1e-4
    _, rate = curve(view, "base-rate", "rate")
    np.testing.assert_allclose(rate, np.degrees(np.linalg.norm(trajectory.base_rate(t)[1], axis=1)), atol=1e-4)
    assert rate.max() <= math.degrees(floating.certificate.floating.rate) + 1e-4
    _, arm = curve(view, "momentum", "joints' motion")
    assert arm.max() <= floating.certificate.floating.joint_momentum * (1 + 1e-6)
    assert curve(view, "momentum", "in all")[1].max() < 1e-6 * arm.max()
    _, residual = curve(view, "residual", "angular")
    assert np.nanmax(residual) < 1e-6
    rows = dict(section(view, "Floating base")["rows"])
    assert "limit 60 deg" in rows["turned at most"]


@pytest.mark.parametrize("seed", range(6))
def test_the_tools_rates_are_those_of_its_places(seed: int) -> None:
    """By differences of the trajectory's own poses, of arms on bases of every kind."""
    trajectory = drawn_claim(seed, floating=bool(seed % 2)).trajectory
    step = 1e-6 * trajectory.duration
    t = np.linspace(0.1, 0.9, 17) * trajectory.duration + 0.1234 * step
    at = sampled(trajectory, t)
    before, after = trajectory.tip(t - step), trajectory.tip(t + step)
    np.testing.assert_allclose(at.T, trajectory.tip(t), atol=1e-9)
    velocity = (after - before)[:, :3, 3] / (2 * step)
    np.testing.assert_allclose(at.velocity, velocity, atol=1e-4 * (1 + np.abs(velocity).max()))
    skew = np.einsum("mij,mkj->mik", (after - before)[:, :3, :3], at.T[:, :3, :3]) / (2 * step)
    omega = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    np.testing.assert_allclose(at.omega, omega, atol=1e-4 * (1 + np.abs(omega).max()))


def test_a_turn_beyond_half_a_turn_goes_on() -> None:
    angle = np.linspace(0, 9, 40)
    R = np.array([[[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]] for a in angle])
    np.testing.assert_allclose(turned_since_start(R), np.outer(angle, [0, 0, 1]), atol=1e-7)


def test_accelerations_that_jump_are_drawn_on_both_sides() -> None:
    motion = sa.Motion([START, GOAL / 2, GOAL])
    law = sa.time_optimal(ROBOT, motion)
    trajectory = law if isinstance(law, sa.Trajectory) else sa.Trajectory(ROBOT, motion, time_law=law)
    t = instants_of(trajectory)
    assert 500 <= len(t) <= 1000
    assert (np.diff(t) > 0).all()


# ---- Several ---------------------------------------------------------------------------------------------------------


def test_several_plans_are_beside_each_other(plan: sa.Plan, floating: sa.Plan) -> None:
    other = sa.plan(plan.problem, plan.settings, rng=9)
    page = content(page_html(report_of_plans([plan, other, floating], names=["first", "second", "adrift"], title="Three")))
    assert page["title"] == "Three"
    assert [view["name"] for view in page["views"]] == ["Side by side", "first", "second", "adrift"]
    view = page["views"][0]
    assert [(one["name"], one["ghost"], one["tone"]) for one in view["actors"]] == [
        ("first", False, 0),
        ("second", True, 1),
        ("adrift", True, 2),
    ]
    assert len(page["robots"]) == 2  # those of the first two are one
    table = section(view, "Side by side")["table"]
    assert table["header"] == ["", "first", "second", "adrift"]
    rows = {row[0]: row[1:] for row in table["rows"]}
    assert rows["seed"] == ["4", "9", "1"]
    assert rows["base"] == ["fixed", "fixed", "floating"]
    assert rows["base turned at most"][:2] == ["-", "-"]
    t, speed = curve(view, "tool-speed", "first")
    assert plan.trajectory is not None
    assert np.isnan(speed[t > plan.trajectory.duration * 1.001]).all()
    assert any("another robot" in note for note in section(view, "Differences between the problems")["notes"])
    assert view["verdict"]["headline"] == "All 3 motions are proven"
    assert "'adrift' has other obstacles, another robot" in view["verdict"]["text"]


def test_the_verdict_of_two_plans_says_if_their_problems_differ(plan: sa.Plan) -> None:
    elsewhere = replace(plan.problem, scene=sa.Scene([sa.Sphere((3, 3, 3), 0.1, name="buoy")]))
    other = sa.plan(elsewhere, plan.settings, rng=4)
    for pair, differ in (([plan, other], True), ([plan, plan], False)):
        verdict = report_of_plans(pair, names=["first", "second"])["views"][0]["verdict"]
        assert verdict["headline"] == "Both motions are proven"
        assert ("'second' has other obstacles than 'first'" in verdict["text"]) is differ


def test_the_verdict_of_many_plans_counts_the_problems_that_differ(plan: sa.Plan) -> None:
    other = sa.plan(replace(plan.problem, scene=sa.Scene([sa.Sphere((3, 3, 3), 0.1, name="buoy")])), plan.settings, rng=4)
    verdict = report_of_plans([plan, other, other, other])["views"][0]["verdict"]
    assert verdict["text"].endswith("The problems of 3 motions differ from the first one's.")


def test_plans_of_the_same_name_are_numbered(plan: sa.Plan) -> None:
    assert [view["name"] for view in report_of_plans([plan, plan])["views"]] == [
        "Side by side",
        "zhang2022 (1)",
        "zhang2022 (2)",
    ]


def test_of_many_plans_the_first_ones_have_views_of_their_own(plan: sa.Plan) -> None:
    page = report_of_plans([plan] * 14)
    assert len(page["views"]) == 13
    assert len(page["views"][0]["actors"]) == 14
    assert "the first 12 of 14 motions have a view of their own" in page["sections"][0]["notes"]
    assert len(page_html(page)) < 5e6
