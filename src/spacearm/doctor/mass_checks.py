"""Masses and inertias: whether they are there, whether a body can have them, whether they fit its shape, and what they make of
the robot as a whole.

The thresholds: matter of mass m in a box of edges a, b, c has at most m (b² + c²) / 4 about the axis along a, which is
three times the solid box's m (b² + c²) / 12; it has next to none if it is at one point. `INERTIA_RANGE` allows for
shapes that are drawn too small or too large.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.rotations import rotation_from_rpy
from spacearm.doctor.diagnosis import Chart, child_of, link_of, number_of, numbers_of, written
from spacearm.doctor.shape_checks import Solid, link_solid
from spacearm.doctor.structure_checks import roots_of
from spacearm.robot.inertias import inertia_fault

Array = NDArray[np.float64]

INERTIA_RANGE = (0.01, 10.0)
"""Times the inertia of the solid box around the shape: the least trace, and the most about any axis."""

DENSITIES = (1.0, 25_000.0)
"""The mean density of a link's shape [kg/m^3]: air has 1.2, the densest metals 22,600."""

TOY = 1.0
"""A robot lighter than this is taken for a placeholder [kg]."""

_ROUNDING = 1e-3  # share of the largest moment by which files round
_OUTSIDE = 0.5  # of the shape's box: so far beyond it a centre of mass may lie
_TILTED = 0.05  # products of inertia below this share of the largest moment have no sign to speak of
_OPPOSITE = -0.8  # cosine between the products stated and those of the shape
_ALIKE = 3  # links: with the same numbers in this many links of different sizes, the numbers are placeholders

_DIAGONAL = ("ixx", "iyy", "izz")
_PRODUCTS = ("ixy", "ixz", "iyz")


@dataclass(frozen=True, slots=True, eq=False)
class Inertial:
    """What a link states: mass [kg], centre (3,) [m], and inertia (3, 3) about it along the link's axes [kg m^2]."""

    link: Any
    element: Any
    mass: float
    com: Array
    inertia: Array


def look_at_masses(chart: Chart) -> list[Inertial]:
    """Look at the <inertial> of every link; return those that can be read."""
    readable = []
    for link in chart.links:
        element = link.find("inertial")
        if element is None:
            continue
        inertial = _read(chart, link, element)
        if inertial is not None:
            readable.append(inertial)
            solid = link_solid(link, chart.path.parent)
            if _is_physical(chart, inertial, solid) and solid is not None:
                _fits(chart, inertial, solid)
            if solid is not None:
                _place_and_density(chart, inertial, solid)
    _placeholders(chart, readable)
    return readable


def _read(chart: Chart, link: Any, element: Any) -> Inertial | None:
    mass_element, origin, stated = element.find("mass"), element.find("origin"), element.find("inertia")
    mass = number_of(mass_element, "value")
    if mass_element is None:
        chart.found(
            "error", "mass-missing", element, "has an <inertial> without a mass", expected='<mass value="...">', advice="add it"
        )
        return None
    xyz, rpy = numbers_of(origin, "xyz", 3, (0, 0, 0)), numbers_of(origin, "rpy", 3, (0, 0, 0))
    moments = [numbers_of(stated, name, 1, (0,)) for name in (*_DIAGONAL, *_PRODUCTS)]
    if mass is None or xyz is None or rpy is None or None in moments:
        return None  # a number cannot be read, which has been said
    if mass < 0:
        chart.found(
            "error",
            "mass-negative",
            mass_element,
            "has a mass below 0",
            value=f"{mass:g} kg",
            expected="more than 0 [kg]",
            advice="give the true one",
        )
        return None
    xx, yy, zz, xy, xz, yz = (one[0] for one in moments if one is not None)
    R = rotation_from_rpy(rpy)
    inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    if not (np.isfinite(inertia).all() and max(np.abs(inertia).max(), mass, *np.abs(xyz)) < 1e12):
        chart.found(
            "error", "inertia-not-physical", element, "has numbers beyond 1e12", expected="SI units", advice="correct them"
        )
        return None
    return Inertial(link, element, mass, np.array(xyz), (inertia + inertia.T) / 2)


def _is_physical(chart: Chart, inertial: Inertial, solid: Solid | None) -> bool:
    """Whether a body can have this inertia; if none can, that is written down."""
    moments = np.linalg.eigvalsh(inertial.inertia)  # ascending
    largest = float(np.abs(moments).max())
    element = inertial.element.find("inertia")
    element = inertial.element if element is None else element
    value = "principal moments " + ", ".join(f"{m + 0.0:.4g}" for m in moments) + " kg m^2"
    remedy = _from_shape(inertial, solid)
    mend = "compute it from the drawing" + ("; --fix takes the shape, evenly filled with the mass" if remedy else "")
    if inertial.mass == 0:
        if largest > 0:
            chart.found(
                "warning",
                "mass-zero",
                inertial.element,
                "has an inertia but the mass 0",
                value="0 kg",
                expected="more than 0 [kg]",
                advice="give the true mass",
            )
        return False
    if largest == 0:
        code, what, expected = "inertia-zero", "has a mass but no inertia: a point, which nothing can turn", "moments above 0"
    elif moments[0] <= 0:
        code = "inertia-not-physical"
        what = f"has a principal moment {'below' if moments[0] < 0 else 'of'} 0, which no body has"
        expected = "principal moments above 0"
    elif inertia_fault(inertial.inertia, rounding=_ROUNDING) == "triangle":
        code, what = (
            "inertia-not-physical",
            "breaks the triangle inequality: one principal moment exceeds the sum of the others",
        )
        expected = "each at most the sum of the other two"
    else:
        return True
    chart.found("error", code, element, what, value=value, expected=expected, advice=mend, remedy=remedy)
    return False


def _fits(chart: Chart, inertial: Inertial, solid: Solid) -> None:
    """Compare an inertia with that of the box around the link's shape, and its products with those of the shape."""
    squares = solid.edges**2
    box = inertial.mass / 12 * (squares.sum() - squares)  # (3,)
    if not (box > 0).all():
        return
    moments = np.diag(inertial.inertia)
    least, most = moments.sum() / box.sum(), (moments / box).max()
    element = inertial.element.find("inertia")
    remedy = _from_shape(inertial, solid)
    around = f"the solid box around its shape has {', '.join(f'{b:.3g}' for b in box)}"
    value = f"{', '.join(f'{m:.3g}' for m in moments)} kg m^2 (ixx, iyy, izz); {around}"
    mend = "check its units (kg m^2) and the axes" + ("; --fix takes the shape, evenly filled with the mass" if remedy else "")
    if most > INERTIA_RANGE[1] or least < INERTIA_RANGE[0]:
        large = most > INERTIA_RANGE[1]
        chart.found(
            "warning",
            "inertia-too-large" if large else "inertia-too-small",
            element,
            f"is {_factor(most if large else 1 / least)} {'larger' if large else 'smaller'} than its shape and mass suggest",
            value=value,
            expected=f"{INERTIA_RANGE[0]:g} to {INERTIA_RANGE[1]:g} times the box",
            advice=mend,
            remedy=remedy,
        )
        return
    if solid.volume <= 0:
        return
    of_shape = solid.inertia(inertial.mass)
    stated, expected = inertial.inertia[np.triu_indices(3, 1)], of_shape[np.triu_indices(3, 1)]
    sizes = float(np.linalg.norm(stated)), float(np.linalg.norm(expected))
    if min(sizes) > _TILTED * float(moments.max()) and stated @ expected < _OPPOSITE * sizes[0] * sizes[1]:
        chart.found(
            "warning",
            "inertia-sign",
            element,
            "has products of inertia of the sign opposite to its shape's: CAD programs often export them so",
            value=f"{', '.join(f'{p:.3g}' for p in stated)} kg m^2 (ixy, ixz, iyz); its shape has "
            f"{', '.join(f'{p:.3g}' for p in expected)}",
            expected="minus the integral of x y over the mass, as the URDF has it",
            advice="change the sign of all three",
            remedy=lambda: _other_signs(element),
        )


def _factor(value: float) -> str:
    return f"{value:,.0f} times" if value < 1e6 else f"{value:.0e} times"


def _place_and_density(chart: Chart, inertial: Inertial, solid: Solid) -> None:
    margin = _OUTSIDE * solid.edges.max()
    beyond = np.maximum(solid.low - inertial.com, inertial.com - solid.high).max()
    if beyond > margin > 0:
        chart.found(
            "warning",
            "mass-outside",
            inertial.element,
            f"has its centre of mass {beyond:.3g} m outside its shape, which is {solid.edges.max():.3g} m long",
            value=" ".join(f"{x:g}" for x in inertial.com),
            expected="a place inside, in the link's frame [m]",
            advice="check its units and frame",
        )
    if inertial.mass == 0 or solid.volume <= 0:
        return
    density = inertial.mass / solid.volume
    if not DENSITIES[0] <= density <= DENSITIES[1]:
        light = density < DENSITIES[0]
        chart.found(
            "warning",
            "mass-too-small" if light else "mass-too-large",
            inertial.element.find("mass"),
            f"its shape would have the density of {'less than air' if light else 'no metal'}",
            value=f"{inertial.mass:g} kg in {solid.volume:.3g} m^3: {density:.3g} kg/m^3",
            expected=f"{DENSITIES[0]:g} to {DENSITIES[1]:g} kg/m^3",
            advice="check the mass [kg], and the size of the shape [m]",
        )


def _placeholders(chart: Chart, inertials: list[Inertial]) -> None:
    """Find links that have the same numbers although their shapes do not have the same size."""
    alike: dict[tuple[float, ...], list[Inertial]] = {}
    for inertial in inertials:
        if inertial.mass > 0 and inertial.inertia.any():
            alike.setdefault((inertial.mass, *np.sort(np.linalg.eigvalsh(inertial.inertia)).round(12)), []).append(inertial)
    told = {id(case.element) for case in chart.cases if case.finding.code.startswith("inertia-")}
    for same in alike.values():
        if len(same) < _ALIKE or any(id(one.element.find("inertia")) in told for one in same):
            continue
        solids = [link_solid(one.link, chart.path.parent) for one in same]
        sizes = {tuple(np.sort(solid.edges).round(3)) for solid in solids if solid is not None}
        if len(sizes) >= _ALIKE:
            names = ", ".join(shown(one.link.get("name")) for one in same[:6]) + (", ..." if len(same) > 6 else "")
            chart.found(
                "warning",
                "inertia-placeholder",
                same[0].element,
                f"{len(same)} links of different sizes have the same mass and the same inertia",
                place=f"links {names}",
                value=f"{same[0].mass:g} kg each",
                expected="each its own",
                advice="these look like an exporter's placeholders; compute them from the drawings",
            )


def _from_shape(inertial: Inertial, solid: Solid | None) -> Any:
    """Return a remedy that fills a link's shape evenly with its mass; the centre of mass stays where it is stated."""
    if solid is None or solid.volume <= 0 or inertial.mass <= 0:
        return None
    inertia = solid.inertia(inertial.mass)
    return lambda: write_inertia(inertial.element, inertia) + " (its shape, evenly filled with its mass)"


def write_inertia(element: Any, inertia: Array) -> str:
    """Write an inertia (3, 3) along the link's axes into an <inertial>; say what it was and is."""
    origin, stated = element.find("origin"), child_of(element, "inertia")
    if origin is not None and origin.get("rpy") is not None and np.any(numbers_of(origin, "rpy", 3)):
        origin.set("rpy", "0 0 0")
    before = " ".join(stated.get(name, "?") for name in (*_DIAGONAL, *_PRODUCTS))
    values = (*np.diag(inertia), *inertia[np.triu_indices(3, 1)])
    small = 1e-12 * float(np.abs(inertia).max())  # rounding of a turned shape
    for name, value in zip((*_DIAGONAL, *_PRODUCTS), values, strict=True):
        stated.set(name, written(0.0 if abs(value) < small else float(value)))
    after = " ".join(stated.get(name) for name in (*_DIAGONAL, *_PRODUCTS))
    return f"{' '.join((*_DIAGONAL, *_PRODUCTS))}: {before} -> {after}"


def _other_signs(element: Any) -> str:
    said = []
    for name in _PRODUCTS:
        value = number_of(element, name)
        if value:
            element.set(name, written(-value))
            said.append(f"{name} {value:g} -> {-value:g}")
    return f"<inertia>: {', '.join(said)}"


HEAVY_ARM = 1.0
"""An arm of more than this share of its base's mass throws it about."""

UNEVEN = 1e6
"""A link lighter than the heaviest one by more than this is lost in rounding."""


def look_at_balance(chart: Chart, inertials: list[Inertial]) -> tuple[float | None, float | None]:
    """Look at the masses of all links together; return that of the robot and that of its base [kg], None if unstated."""
    masses = {inertial.link.get("name"): inertial.mass for inertial in inertials}
    base = _base(chart, masses)
    if not masses:
        if not any(link.find("inertial") is not None for link in chart.links):
            chart.found(
                chart.if_masses_matter,
                "mass-missing",
                chart.root,
                "no link states a mass: the robot can only be planned with a fixed base",
                expected="<inertial> for each link",
                advice="add them, from the drawings" if chart.choices.density is None else "add them",
                remedy=_all_from_density(chart),
            )
        return None, None
    total = sum(masses.values())
    bodies = _bodies(chart)
    for body in bodies:
        if not any(masses.get(name) for name in body):
            _without_mass(chart, body, base)
    base_mass = sum(mass for name, mass in masses.items() if name in base) or None
    if total < TOY:
        chart.found(
            "warning",
            "mass-toy",
            chart.root,
            "the whole robot is lighter than a bag of sugar",
            value=f"{total:.3g} kg",
            expected=f"{TOY:g} kg or more",
            advice="check the masses: [kg], not tonnes",
        )
    elif max(masses.values()) > UNEVEN * min([mass for mass in masses.values() if mass > 0], default=1.0):
        lightest = min((mass, name) for name, mass in masses.items() if mass > 0)
        chart.found(
            "warning",
            "mass-uneven",
            _link(chart, lightest[1]),
            f"is more than {UNEVEN:g} times lighter than the heaviest link",
            value=f"{lightest[0]:g} kg against {max(masses.values()):g} kg",
            expected="a mass that matters",
            advice="check its units [kg]",
        )
    if base_mass and total - base_mass > HEAVY_ARM * base_mass:
        chart.found(
            "warning" if chart.base == "floating" else "note",
            "arm-heavier-than-base",
            _link(chart, next(name for name in base if masses.get(name))),
            f"what moves is {(total - base_mass) / base_mass:.3g} times as heavy as the base"
            + ("" if chart.base == "floating" else "; if that floats, the arm throws it about"),
            value=f"{total - base_mass:.4g} kg against {base_mass:.4g} kg",
            expected="a base heavier than the arm, if it floats",
            advice="give the base link the spacecraft's mass",
        )
    return total, base_mass


def _link(chart: Chart, name: str) -> Any:
    return next(link for link in chart.links if link.get("name") == name)


def _bodies(chart: Chart) -> list[list[str]]:
    """Gather the links that are fixed to each other, in the file's order."""
    body = {link.get("name"): link.get("name") for link in chart.links}

    def first(name: str) -> str:
        while body[name] != name:
            name = body[name]
        return name

    for joint in chart.joints:
        parent, child = link_of(joint, "parent"), link_of(joint, "child")
        if joint.get("type") == "fixed" and parent in body and child in body:
            body[first(child)] = first(parent)
    found: dict[str, list[str]] = {}
    for name in body:
        found.setdefault(first(name), []).append(name)
    return list(found.values())


def _base(chart: Chart, masses: dict[str, float]) -> list[str]:
    """List the links of the base: the root and what is fixed to it, or what floats on a root without a mass."""
    bodies, roots = _bodies(chart), roots_of(chart)
    if not roots:
        return []
    base = next(body for body in bodies if roots[0] in body)
    base.sort(key=lambda name: name != roots[0])
    away = [joint for joint in chart.joints if link_of(joint, "parent") in base and link_of(joint, "child") not in base]
    if len(away) == 1 and away[0].get("type") == "floating" and not any(masses.get(name) for name in base):
        child = link_of(away[0], "child")
        carried = next((body for body in bodies if child in body), [])
        return sorted(carried, key=lambda name: name != child) or base
    return base


def _without_mass(chart: Chart, body: list[str], base: list[str]) -> None:
    """Write down that a body of links has no mass, unless it is a mere frame."""
    is_base = set(body) == set(base)
    shaped = [name for name in body if any(_link(chart, name).find(tag) is not None for tag in ("collision", "visual"))]
    if not (is_base or shaped):
        return
    link = _link(chart, (shaped or base)[0])
    if any(case.finding.severity == "error" and _is_in(case.element, link.find("inertial")) for case in chart.cases):
        return  # its mass cannot be read, which has been said
    fixed = f" (nor has what is fixed to it: {', '.join(map(shown, body[1:4]))})" if len(body) > 1 else ""
    chart.found(
        chart.if_masses_matter,
        "base-without-mass" if is_base else "mass-missing",
        link,
        f"{'the base' if is_base else 'it'} has no mass{fixed}"
        + ("; a floating base moves by its mass" if is_base else "; every moving body needs one where the base floats"),
        expected="<inertial>",
        advice="give it the spacecraft's mass and inertia" if is_base else "give it one",
        remedy=_from_density(chart, link),
    )


def _is_in(element: Any, container: Any) -> bool:
    while element is not None and element is not container:
        element = element.getparent()
    return element is not None


def _from_density(chart: Chart, link: Any) -> Any:
    density, solid = chart.choices.density, link_solid(link, chart.path.parent)
    if density is None or solid is None or solid.volume <= 0:
        return None
    mass = density * solid.volume

    def remedy() -> str:
        inertial = child_of(link, "inertial")
        # In the order that readers are used to; the indentation is copied from the link's.
        child_of(inertial, "origin").set("xyz", " ".join(written(round(x, 12)) for x in solid.center))
        child_of(inertial, "mass").set("value", written(mass))
        write_inertia(inertial, solid.inertia(mass))
        return f"<inertial>: was missing -> {mass:.6g} kg (its shape at {density:g} kg/m^3)"

    return remedy


def _all_from_density(chart: Chart) -> Any:
    remedies = [(link, _from_density(chart, link)) for link in chart.links]
    able = [(link, remedy) for link, remedy in remedies if remedy is not None]
    if not able:
        return None
    return lambda: "; ".join(f"link {shown(link.get('name'))} {remedy()}" for link, remedy in able)
