"""The masses of the whole: which bodies have none, how heavy the base is, and what that makes of the arm."""

from __future__ import annotations

from typing import Any

from spacearm.checks import shown
from spacearm.robot.doctor.chart import Chart, child_of, link_of, written
from spacearm.robot.doctor.masses import TOY, Inertial, write_inertia
from spacearm.robot.doctor.shapes import link_solid
from spacearm.robot.doctor.structure import roots_of

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
