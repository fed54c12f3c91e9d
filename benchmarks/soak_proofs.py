"""A long search for a proof that is wrong: the finder, the checker and an oracle look at drawn motions, half of them grazing.

Robots of up to 14 joints with slides, mimics and branches, fixed and floating; links and obstacles of every shape; splines,
lines, cubics, quintics with rests, recordings of a thousand pieces; tracking errors; pairs near at an end; clearances by pair.
Of motions with even numbers the clearance required is within 1e-9 to 1e-3 m of what there is (`proofs/grazing_motions.py`).

Pinocchio and Coal measure all pairs at random instants, around the closest approach, and at the instants that the finder names.
Three things may never be, and each is a complaint: the checker proves more than is measured; the finder says that a proof
holds, and the checker does not; a proof fails, and what it measured is not there. With `--earlier FOLDER` the package in FOLDER
certifies the same motions: one may not prove what the other one refutes by a measurement.

What is drawn depends on the seed and the number alone, so `--first` goes on where another run ended, and `--records` where the
same one was stopped. Every complaint is written to a file, with the robot, the scene and the trajectory in full.

    python benchmarks/soak_proofs.py --count 100000 --seed 1
    python benchmarks/soak_proofs.py --count 3000 --seed 1 --earlier OLD/src
    python benchmarks/soak_proofs.py --seed 1 --only 1234
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fault_search import Case, Outcome, search  # puts the tests' modules on the path
from proofs.earlier import Earlier, earlier_version
from proofs.grazing_motions import Array, Drawn, closest, drawn, worst_deviation
from spacearm.core.errors import SpacearmError
from spacearm.geometry.scene import scene_as_list
from spacearm.motion.trajectory_values import trajectory_as_dict
from spacearm.proof.claim import Claim, claim_of
from spacearm.proof.near_pairs import find_near
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import pair_clearance_as_dict, required_clearance
from spacearm.robot.model import robot_as_dict

ROUNDING = 1e-9  # [m] of the oracle, where it is sure of a distance
DEPTH = 1e-6  # [m] by which a measurement of the finder may be off
NEVER = 1e9  # [m] stands for no clearance that is required, in files


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """What finder and checker say.

    Attributes:
        claim: that was to be shown.
        status: the finder's opinion.
        fault: the checker's; "": the proof shows the claim; None: there was no proof to check.
        proven: (phases,) [m], if it shows the claim.
        found: what the finder returned.
        seconds: of finder and checker, and all that is made before [s].
        sizes: of the tree.
    """

    claim: Claim
    status: str
    fault: str | None
    proven: Array
    found: Any
    seconds: tuple[float, float, float]
    sizes: dict[str, float]

    @property
    def holds(self) -> bool:
        return self.fault == ""


def look(case: Case) -> Outcome:
    """Draw a motion, find a proof, check it, measure, and compare."""
    try:
        made = drawn(case.seed, case.number)
        if not made.oracle.pairs:
            return Outcome(became=["nothing is to be kept apart"])
        judged = proof_of(made, find=case.options.get("finder", "native"))
    except SpacearmError as refused:
        return Outcome(became=[f"refused: {str(refused)[:50]}"])
    rng = np.random.default_rng((case.seed, case.number, 2))
    measured = Measurements(made, judged, rng, case.options["instants"])
    wrong = complaints(judged, measured)
    said = "holds" if judged.holds else judged.status
    grazes = np.isfinite(made.grazing)
    became = [f"{'grazing' if grazes else 'drawn'}: {said}", f"{made.kind}: {said}"]
    if judged.claim.held.pairs:
        became.append(f"with pairs near at an end: {said}")
    if measured.least > 0 and not judged.holds:
        became.append(f"{said}, but {_decade(measured.least)} m more than required were measured")
    folder = case.options["earlier"]
    if folder is not None and not made.tracking.any():
        earlier = earlier_version(Path(folder)).certify(made)
        wrong += against(judged, measured, earlier)
        if earlier.status != said:
            became.append(f"{said}, earlier: {earlier.status}, {_decade(measured.least)} m above what is required")
    if case.only:
        print(f"{made.kind}, clearance {made.clearance!r}, {made.clearances}, grazing by {made.grazing:.3g} m")
        print(f"finder: {judged.status}, checker: {judged.fault!r}, proven {judged.proven}, measured {measured.least:.9g} m")
    if wrong:
        _write(case, made, wrong)
    return Outcome(
        became=became,
        complaints=[f"{made.kind}: {sentence}" for sentence in wrong],
        measured={
            "claim [ms]": 1e3 * judged.seconds[0],
            "found [ms]": 1e3 * judged.seconds[1],
            "checked [ms]": 1e3 * judged.seconds[2],
            **judged.sizes,
        },
    )


def proof_of(made: Drawn, *, find: str = "native") -> Judged:
    """Find and check a proof of a drawn motion."""
    from spacearm.proof.checker import check_proof

    find_proof = _finder(find)
    begun = time.perf_counter()
    claim = _claim(made)
    between = time.perf_counter()
    found = find_proof(claim)
    halfway = time.perf_counter()
    checked = None if found.proof is None else check_proof(claim, found.proof)
    ended = time.perf_counter()
    holds = checked is not None and not checked.fault
    sizes = {} if checked is None else {"nodes": float(checked.nodes), "stretches": float(checked.stretches)}
    return Judged(
        claim=claim,
        status=str(found.status),
        fault=None if checked is None else checked.fault,
        proven=np.asarray(checked.proven) if holds else np.zeros(0),
        found=found,
        seconds=(between - begun, halfway - between, ended - halfway),
        sizes=sizes,
    )


def _finder(name: str) -> Any:
    if name == "native":
        from spacearm.proof.finder import find_proof

        return find_proof
    from support.reference_finder import find_proof as slow

    def found(claim: Claim) -> Any:
        proof = slow(claim)
        return SimpleNamespace(status="undecided" if proof is None else "holds", proof=proof, closest=(), worst=None)

    return found


def _claim(made: Drawn) -> Claim:
    required = required_clearance(made.robot, made.scene, made.clearance, made.clearances)
    given: dict[str, Any] = {"required": required, "by_pair": made.clearances, "tracking": made.tracking}
    path = PathIntervals(made.base.curve)
    claim = claim_of(made.robot, made.scene, made.base, path, **given)
    if not (made.clearance or made.clearances):
        return claim
    near = find_near(claim)
    return claim_of(made.robot, made.scene, made.base, path, near=near, **given) if near else claim


# ---- the oracle ------------------------------------------------------------------------------------------------------


class Measurements:
    """What all pairs have at instants, beside what they are held to and what is proven of them.

    Attributes:
        least: the least that any pair was measured to have above what it is held to [m].
    """

    def __init__(self, made: Drawn, judged: Judged, rng: np.random.Generator, instants: int) -> None:
        self.made, self.judged = made, judged
        self._rows(judged.claim)
        begin, end = made.base.curve.domain
        near = [made.closest, *(one.u for one in _suspects(judged.found))]
        around = np.concatenate([u + (end - begin) * 10 ** rng.uniform(-7, -2, 3) * rng.normal(size=3) for u in near])
        self.u = np.clip(np.concatenate([near, around, [begin, end], rng.uniform(begin, end, instants)]), begin, end)
        off = None
        if made.tracking.any():
            off = made.tracking * rng.choice([-1.0, 0.0, 1.0], (len(self.u), len(made.tracking)))
        self.full = made.placed(self.u, off)
        self.distances = made.oracle.distances(self.full)
        held, phase = self._held(self.u)
        excess = self.distances - held
        self._phase = phase
        i, self.pair = np.unravel_index(int(np.argmin(excess)), excess.shape)
        self._zoom(int(self.pair), float(self.u[i]), end - begin)
        self.least = min(float(excess.min()), self._zoomed - self._zoomed_held)

    def _rows(self, claim: Claim) -> None:
        """Look up the link and the row of the other body, in the claim's table, of each of the oracle's pairs."""
        bodies, pairs = claim.bodies, self.made.oracle.pairs
        of_shape = {int(shape): row for row, shape in enumerate(bodies.shape) if shape >= 0}
        single = (bodies.frame == 0) & (bodies.members == 0)
        of_obstacle = {int(owner): row for row, owner in enumerate(bodies.owner) if single[row]}
        self._first = np.array([of_shape[one.shape] for one in pairs], dtype=np.intp)
        self._obstacle = np.array([one.obstacle for one in pairs], dtype=np.intp)
        self._link = bodies.owner[self._first]
        rows = [of_shape[one.other] if one.other >= 0 else of_obstacle[one.obstacle] for one in pairs]
        self._other = np.array(rows, dtype=np.intp)

    def _held(self, u: Array) -> tuple[Array, Array]:
        """Return what all pairs are held to at instants, and their phases, each (r, pairs)."""
        count = len(self._link)
        link, other = np.tile(self._link, len(u)), np.tile(self._other, len(u))
        at = np.repeat(u, count)
        held, phase = self.judged.claim.held.on(link, other, at, at)
        return held.reshape(len(u), count), phase.reshape(len(u), count)

    def _zoom(self, pair: int, u: float, length: float) -> None:
        """Look for the closest approach of the pair that has least, around an instant, with the worst tracking error."""
        made = self.made
        self.off = worst_deviation(made, pair, u)
        around = np.clip(u + length / 50 * np.linspace(-1, 1, 9), *made.base.curve.domain)
        given = made.oracle.of_pair(pair, made.placed(around, self.off))
        self.zoomed_u, self._zoomed = closest(made, pair, around, given, self.off)
        held, phase = self._held(np.array([self.zoomed_u]))
        self._zoomed_held, self._zoomed_phase = float(held[0, pair]), int(phase[0, pair])

    def lacking(self) -> tuple[float, str]:
        """Return the most by which a pair has less than is proven of it [m], and a sentence about it."""
        proven = self.judged.proven
        short = proven[self._phase] - self.distances
        short[~np.isfinite(short)] = -np.inf
        i, pair = np.unravel_index(int(np.argmax(short)), short.shape)
        most, u, values = float(short[i, pair]), float(self.u[i]), self.full[i]
        zoomed = float(proven[self._zoomed_phase]) - self._zoomed
        if np.isfinite(zoomed) and zoomed > most:
            most, u, pair = zoomed, self.zoomed_u, self.pair
            values = self.made.placed(np.array([u]), self.off)[0]
        if most > 0:  # Coal's word is not enough: two points in the bodies are
            has = float(self.made.oracle.of_pair(int(pair), values[None])[0])
            sure = self.made.oracle.at_most(int(pair), values)
            most = has + most - sure if has > 0 else most
        return most, f"{self.made.oracle.pairs[int(pair)]} at u = {u!r}"

    def at(self, suspect: Any) -> tuple[float, float, float]:
        """Return the distance of a suspect's bodies at its instant by Coal, and what they are held to [m].

        An obstacle of several parts has the least and the greatest distance of them.
        """
        columns = self._columns(suspect.first, suspect.other)
        if not columns.size:
            columns = self._columns(suspect.other, suspect.first)
        if not columns.size:
            return np.nan, np.nan, np.nan
        u = np.array([suspect.u])
        held, full = self._held(u)[0][0], self.made.placed(u)
        has = [float(self.made.oracle.of_pair(int(i), full)[0]) for i in columns]
        return min(has), max(has), float(held[columns].max())

    def _columns(self, first: int, other: int) -> NDArray[np.intp]:
        """Return the oracle's pairs of two rows of the table; of an obstacle with all its parts."""
        bodies = self.judged.claim.bodies
        obstacle = bodies.owner[other] if bodies.frame[other] == 0 else -2
        return np.flatnonzero((self._first == first) & ((self._other == other) | (self._obstacle == obstacle)))


def _suspects(found: Any) -> list[Any]:
    return [one for one in (*found.closest, found.worst) if one is not None]


# ---- what may never be -----------------------------------------------------------------------------------------------


def complaints(judged: Judged, measured: Measurements) -> list[str]:
    """Say what is wrong with a proof, if anything is."""
    out: list[str] = []
    if judged.status == "holds" and not judged.holds:
        out.append(f"the finder says that its proof holds, the checker: {judged.fault or 'there is none'}")
    if judged.holds and judged.status != "holds":
        out.append(f"the checker says that the proof holds, the finder: {judged.status}")
    if judged.holds:
        most, where = measured.lacking()
        if most > ROUNDING:
            out.append(f"proven {judged.proven}, but {most:.3g} m less were measured: {where}")
        if not all(judged.proven[phase] > 0 or judged.claim.held.required.max() < 0 for phase in (0,)):
            out.append(f"it holds with {judged.proven} m proven")
    if judged.status == "fails":
        worst = judged.found.worst
        if worst is None:
            out.append("it fails, and the finder names no pair")
        elif not measured.made.tracking.any():
            has, _, held = measured.at(worst)
            if np.isfinite(has) and has > held + DEPTH and measured.least > DEPTH:
                out.append(f"it fails at u = {worst.u!r}, where {has:.9g} m are measured, {has - held:.3g} more than required")
    for one in _suspects(judged.found):
        _, has, _ = measured.at(one)
        if has > 0 and np.isfinite(has) and one.clearance > has + DEPTH:
            out.append(f"the finder measures {one.clearance:.9g} m at u = {one.u!r}, where Coal measures {has:.9g}")
    return out


def against(judged: Judged, measured: Measurements, earlier: Earlier) -> list[str]:
    """Say where this version and another one contradict each other."""
    if earlier.status == "holds" and measured.least < -ROUNDING - DEPTH:
        return [f"the other version proves it, and {-measured.least:.3g} m less than required are measured"]
    if earlier.status == "holds" and judged.status == "fails":
        return [f"it fails by {judged.found.worst}, and the other version proves it: {earlier.message}"]
    if judged.holds and earlier.status == "fails" and earlier.measured is not None:
        has, held = earlier.measured
        if has < held - DEPTH:
            return [f"it holds, and the other version measures {has:.9g} m of {held:.9g}: {earlier.message}"]
    return []


def _decade(value: float) -> str:
    """Return in which power of ten a value is."""
    if not value > 0:
        return "no" if value > -1e-12 else f"-1e{int(np.floor(np.log10(-value)))}"
    power = int(np.floor(np.log10(max(value, 1e-12))))
    return f"1e{power} to 1e{power + 1}"


def _write(case: Case, made: Drawn, wrong: list[str]) -> None:
    """Write all that is needed to see a complaint again."""
    folder = Path(case.options["write"])
    folder.mkdir(parents=True, exist_ok=True)
    values = {
        "complaints": wrong,
        "seed": case.seed,
        "number": case.number,
        "clearance": made.clearance,
        "clearances": [pair_clearance_as_dict(pair) for pair in made.clearances],
        "tracking": made.tracking.tolist(),
        "closest_u": made.closest,
        "robot": robot_as_dict(made.robot),
        "obstacles": scene_as_list(made.scene),
        "trajectory": trajectory_as_dict(made.trajectory),
    }
    (folder / f"proof_{case.seed}_{case.number}.json").write_text(json.dumps(values), encoding="utf-8")


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--instants", type=int, default=24, help="random instants at which all pairs are measured")
    parser.add_argument("--earlier", type=Path, help="folder with another version of spacearm to compare with")
    parser.add_argument("--finder", choices=["native", "reference"], default="native", help="that looks for the proofs")
    parser.add_argument("--write", type=Path, default=Path("wrong_proofs"), help="folder of what is wrong, a file each")


if __name__ == "__main__":
    sys.exit(search(look, doc=__doc__, what="motions", count=100_000, add_options=add_options))
