"""Which links meet: pairs that an SRDF switches off although they can, and pairs that overlap in every configuration.

Where the convex pieces of a mesh meet something, its triangles, which lie inside, decide (with Coal). The model must be loaded
for all that, so a copy of it is made loadable first: what can be mended is mended, what cannot is made fixed or removed.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import SpacearmError
from spacearm.doctor.diagnosis import Case, Chart, child_of, link_of, number_of
from spacearm.doctor.shape_checks import mesh_path, mesh_size
from spacearm.doctor.structure_checks import BROKEN
from spacearm.robot.assembly import Assembly, assemble
from spacearm.robot.collision_shapes import Shape
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.link_distances import CONTACT, distances, link_bodies, placed
from spacearm.robot.link_tree import LinkTree, advised, default_tip, ends_of, several_ends
from spacearm.robot.model import Robot
from spacearm.robot.self_collision import NEARLY_ALWAYS, LinkPair, find_self_pairs
from spacearm.robot.srdf import Srdf, pair
from spacearm.robot.unchecked_pairs import overlap_in_words
from spacearm.robot.urdf import collision_shapes, urdf_tree
from spacearm.robot.whole_range import finite_range

Array = NDArray[np.float64]

_MOST = 300  # configurations in which triangles are looked at

Parts = Sequence[tuple[Any, Array]]
"""Coal's shapes and their transforms in a link's frame, (4, 4)."""


def meeting_share(robot: Robot, shapes: Mapping[str, Sequence[Shape]], links: tuple[str, str], *, samples: int) -> float:
    """Return the share of random configurations in which two links meet.

    Args:
        robot: with an envelope.
        shapes: each link's collision shapes, in its frame; a link that has none is looked at by its envelope.
        links: their names.
        samples: how many configurations are drawn, always the same.
    """
    lower, upper = finite_range(robot)
    q = lower + np.random.default_rng(0).random((samples, robot.dof)) * (upper - lower)
    frames = base_and_joint_frames(robot, q)
    bodies = link_bodies(robot)
    near = np.flatnonzero(distances(*(placed(bodies[link], frames) for link in links), enough=CONTACT) < 0)
    if not near.size:
        return 0.0
    share = near.size / samples
    if not all(shapes.get(link) for link in links) or not has_mesh(shapes, links):
        return share
    looked = near[np.linspace(0, near.size - 1, min(near.size, _MOST)).astype(int)]
    first, second = ([_part(shape) for shape in shapes[link]] for link in links)
    places = [_places(robot, link, frames[looked]) for link in links]
    return share * float(np.mean([_meet(first, A, second, B) for A, B in zip(*places, strict=True)]))


def has_mesh(shapes: Mapping[str, Sequence[Shape]], links: tuple[str, str]) -> bool:
    """Whether a mesh is among the collision shapes of some links, so that convex pieces stand for it."""
    return any(shape.kind == "mesh" for link in links for shape in shapes.get(link, ()))


def _places(robot: Robot, link: str, frames: Array) -> Array:
    frame = robot.frame(link)
    return frames[:, frame.joint + 1] @ frame.T_joint_frame


def _meet(first: Parts, T_first: Array, second: Parts, T_second: Array) -> bool:
    import coal  # pyright: ignore[reportMissingImports]

    def moved(T: Array) -> Any:
        return coal.Transform3s(T[:3, :3], T[:3, 3])

    for one, T_one in first:
        for other, T_other in second:
            result = coal.CollisionResult()
            if coal.collide(one, moved(T_first @ T_one), other, moved(T_second @ T_other), coal.CollisionRequest(), result):
                return True
    return False


def _part(shape: Shape) -> tuple[Any, Array]:
    import coal  # pyright: ignore[reportMissingImports]

    if shape.kind == "sphere":
        made: Any = coal.Sphere(shape.size[0])
    elif shape.kind == "cylinder":
        made = coal.Cylinder(*shape.size)
    elif shape.kind == "capsule":
        made = coal.Capsule(*shape.size)
    elif shape.kind == "box":
        made = coal.Box(*shape.size)
    else:
        surface = shape.triangles
        assert surface is not None
        made = coal.BVHModelOBBRSS()
        made.beginModel(len(surface), 3 * len(surface))
        corners = surface.reshape(-1, 3)
        triangles = coal.StdVec_Triangle()
        for k in range(0, len(corners), 3):
            triangles.append(coal.Triangle(k, k + 1, k + 2))
        vertices = coal.StdVec_Vec3s()
        vertices.extend(list(corners))
        made.addSubModel(vertices, triangles)
        made.endModel()
    return made, shape.T_link_shape


_SAMPLES = 2000


def look_at_touching(chart: Chart, cases_of_copy: list[Case], copy: Any, srdf: Srdf | None, srdf_root: Any) -> None:
    """Look at which links meet in random configurations.

    Args:
        chart: of the model.
        cases_of_copy: what was found about a copy of it, which is changed here.
        copy: the copy's root.
        srdf, srdf_root: the SRDF, if there is one that can be read.
    """
    broken = [case.finding.code for case in chart.cases if case.finding.code in BROKEN]
    if broken:
        _not_examined(chart, "nobody knows where the links are")
        return
    try:
        tree, shapes = _tree(chart, cases_of_copy, copy)
        ends = ends_of(tree)
        tip = ends.links[0] if ends.links else tree.links[0]
        choices = Assembly(srdf=None if srdf is None else srdf.source, tip=tip, velocity_limit=1.0, self_collision="none")
        robot = assemble(tree, choices)
    except SpacearmError as error:
        _not_examined(chart, str(error).removeprefix(f"{chart.path}: "))
        return
    _tip(chart, tree, srdf)
    if len({part.name for part in robot.shapes}) > 1:
        _pairs(chart, robot, shapes, srdf, srdf_root)


def _not_examined(chart: Chart, reason: str) -> None:
    chart.found(
        "note",
        "not-examined",
        chart.root,
        f"which links meet could not be examined: {reason}",
        advice="mend the errors and ask again",
    )


def _tree(chart: Chart, cases: list[Case], root: Any) -> tuple[LinkTree, dict[str, list[Shape]]]:
    """Load the copy, mended and with nothing in it that would stop a reader; also each link's collision shapes.

    Raises:
        SpacearmError: links and joints that form no tree, or the like.
    """
    from dataclasses import replace

    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    for case in cases:
        if case.remedy is not None and case.finding.code != "collision-missing":
            case.remedy()
        elif case.finding.severity == "error":
            _leave_out(case.element)
    for collision in list(root.iterfind("link/collision")):
        if not _loads(collision, chart.path.parent):
            collision.getparent().remove(collision)
    for link in root.findall("link"):
        if not link.get("name"):
            root.remove(link)
    for i, joint in enumerate(root.findall("joint")):
        joint.set("name", joint.get("name") or f"joint without a name, {i}")
        _make_loadable(joint)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.urdf"
        path.write_bytes(etree.tostring(root, encoding="utf-8"))
        try:
            tree = urdf_tree(path, collision="urdf")
            shapes = collision_shapes(path)
        except SpacearmError as error:
            raise type(error)(str(error).replace(str(path), str(chart.path))) from None
    return replace(tree, source=str(chart.path)), shapes


def _leave_out(element: Any) -> None:
    """Remove the collision shape, or fix the joint, in which something is wrong that cannot be mended."""
    while element is not None and element.tag not in ("collision", "joint"):
        element = element.getparent()
    if element is None or element.getparent() is None:
        return
    if element.tag == "collision":
        element.getparent().remove(element)
    elif element.getparent().tag == "robot":
        element.set("type", "fixed")
        for tag in ("mimic", "limit", "axis"):
            for part in element.findall(tag):
                element.remove(part)


def _loads(collision: Any, directory: Path) -> bool:
    geometry = collision.find("geometry")
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    if len(shapes) != 1 or shapes[0].tag != "mesh":
        return len(shapes) == 1
    path = mesh_path(shapes[0], directory)
    try:
        if path is None or not mesh_size(path).max() > 0:
            return False
    except (OSError, ValueError):
        return False
    shapes[0].set("filename", str(path.resolve()))
    return True


def _make_loadable(joint: Any) -> None:
    kind = joint.get("type")
    if kind not in ("revolute", "continuous", "prismatic"):
        joint.set("type", "fixed")
        return
    if kind != "continuous":
        limit = child_of(joint, "limit")
        for end, value in (("lower", -math.pi), ("upper", math.pi)):
            if number_of(limit, end) is None:
                limit.set(end, "0" if kind == "prismatic" else f"{value}")
        if (number_of(limit, "lower") or 0) > (number_of(limit, "upper") or 0):
            joint.set("type", "fixed")


def _tip(chart: Chart, tree: LinkTree, srdf: Srdf | None) -> None:
    ends = ends_of(tree)
    mounted = set() if srdf is None else set(srdf.mounts) & set(ends.after)
    if len(mounted) == 1 or (srdf is not None and srdf.groups):
        return
    try:
        default_tip(tree)
    except SpacearmError:
        chart.found(
            "note",
            "tip-ambiguous",
            chart.root,
            f"it {several_ends(ends)}; the end effector must be named",
            value=", ".join(map(shown, ends.links[:8])) + (", ..." if len(ends.links) > 8 else ""),
            advice=f"give load_robot(tip={advised(ends)!r}), or the one you mean",
        )


def _pairs(chart: Chart, robot: Robot, shapes: dict[str, list[Shape]], srdf: Srdf | None, srdf_root: Any) -> None:
    for one in find_self_pairs(robot).found:
        if srdf is not None and srdf.may_touch(*one.links):
            share = meeting_share(robot, shapes, one.links, samples=_SAMPLES) if one.reason == "checked" and one.met > 0 else 0
            if share > 0:
                _switched_off(chart, one, share, srdf, srdf_root)
        elif one.reason == "always":
            meshes = has_mesh(shapes, one.links)
            share = meeting_share(robot, shapes, one.links, samples=_SAMPLES) if meshes else 1.0
            _overlap(chart, one, share, srdf)
        elif one.overlaps_always and srdf is not None:
            _forgotten(chart, one)
        elif one.reason == "checked" and one.met >= NEARLY_ALWAYS:
            _nearly_always(chart, one, srdf)


def _switched_off(chart: Chart, one: LinkPair, share: float, srdf: Srdf | None, root: Any) -> None:
    element = next(
        (
            element
            for element in root.findall("disable_collisions")
            if pair((element.get("link1") or "").strip(), (element.get("link2") or "").strip()) == one.links
        ),
        None,
    )
    if element is None:
        element = next(e for e in root.findall("disable_default_collisions") if (e.get("link") or "").strip() in one.links)
    reason = element.get("reason")
    chart.found(
        "warning",
        "pair-switched-off",
        element,
        f"switched off, but they meet in {share:.1%} of {_SAMPLES} random configurations",
        place=_both(one),
        file=None if srdf is None else srdf.source,
        value=f"reason {shown(reason)}" if reason else "",
        expected="a pair that can meet is checked",
        advice='remove the line, or give load_robot(self_collision="computed")',
    )


def _overlap(chart: Chart, one: LinkPair, share: float, srdf: Srdf | None) -> None:
    """Report two links that overlap in every configuration: their shapes, or only the pieces that stand for a mesh."""
    if share < 1:
        what = f"the convex pieces of their meshes overlap in every configuration, the meshes' surfaces in {share:.1%} of all"
        advice = "load the robot with more pieces for each mesh, correct the meshes, or allow the pair in an SRDF"
    else:
        what = overlap_in_words(one.depth, proven=one.proven)
        advice = "correct the shapes, or allow the pair in an SRDF if the two belong together"
    unwanted = ", and the SRDF does not allow them to" if srdf is not None else ""
    chart.found(
        "error" if share == 1 else "warning",
        "pair-always-meets",
        _joint_of(chart, one) if srdf is None else chart.root,
        f"{what}{unwanted}; no plan keeps them apart, and spacearm does not check them",
        place=_both(one),
        value=f"{one.depth:.3g} to {-one.clearance:.3g} m deep",
        expected="shapes that can be apart",
        advice=advice,
    )


def _forgotten(chart: Chart, one: LinkPair) -> None:
    chart.found(
        "warning",
        "pair-always-meets",
        chart.root,
        "neighbours that overlap in every configuration, and the SRDF does not allow them to; spacearm does not check them",
        place=_both(one),
        value=f"up to {-one.clearance:.3g} m deep",
        expected="neighbours that are switched off",
        advice='write <disable_collisions link1="..." link2="..." reason="Adjacent"/> for them',
    )


def _nearly_always(chart: Chart, one: LinkPair, srdf: Srdf | None) -> None:
    chart.found(
        "warning",
        "pair-nearly-always-meets",
        _joint_of(chart, one) if srdf is None else chart.root,
        f"they meet in {one.met:.1%} of all configurations, and are kept apart: that leaves hardly a motion",
        place=_both(one),
        value=f"up to {-one.clearance:.3g} m deep",
        expected="shapes that can be apart",
        advice="correct the shapes, or allow the pair in an SRDF if the two belong together",
    )


def _both(one: LinkPair) -> str:
    return " and ".join(f"'{link}'" for link in one.links)


def _joint_of(chart: Chart, one: LinkPair) -> Any:
    """Return the second link's element, where the reader is to look."""
    names = {link.get("name"): link for link in chart.links}
    below = [joint for joint in chart.joints if link_of(joint, "child") in one.links]
    last = link_of(below[-1], "child") if below else one.links[1]
    return names.get(last, chart.root)
