"""Where the paper is silent, and what we read there. Each is a setting or a datum; the report lists them all."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A declared reading.

    Attributes:
        open: what the paper leaves open.
        reading: what we take.
        why: the reason.
    """

    open: str
    reading: str
    why: str


READINGS: tuple[Reading, ...] = (
    Reading(
        open="robot",
        reading="S-R-S arm: spherical shoulder at the origin, elbow, spherical wrist; links 0.668, 0.4128, 0.2552 m along "
        "+y at q = 0",
        why="the start (0, 1.336, 0) is then the stretched arm",
    ),
    Reading(
        open="joint axes at q = 0",
        reading="z, x, y, z, y, x, z",
        why="consecutive axes perpendicular; joints 1, 4, 7 move the arm in the plane z = 0",
    ),
    Reading(
        open="joint limits",
        reading="[deg] max 160, 20, 180, 170, 20, 20, 180; min -160, -20, -180, -150, -180, -46, -80",
        why="the most economical repair of the printed lines, whose signs are lost",
    ),
    Reading(
        open="obstacle radius A_R",
        reading="0.10 m; 0.06 and 0.15 on request",
        why="disjoint spheres need less than 0.112; the straight way is blocked above 0.054",
    ),
    Reading(open="radius of the links' cylinders", reading="0 m, a setting", why="no value is given"),
    Reading(
        open="control points in eq. (5)",
        reading="distinct joint centres: shoulder, elbow, wrist, end effector",
        why="seven centres with three at the origin give F >= 5.1 at the goal, above the paper's worst 4.33",
    ),
    Reading(open="third coordinate in eq. (6)", reading="z joins x and y", why="the goal is a point in space"),
    Reading(
        open="is the goal reached?",
        reading="mode 'goal': reaching it within 1 mm is a constraint; mode 'literal': only eq. (4)",
        why="f1 is minimised and pulls the arm towards the obstacles: with eq. (4) alone the optimum stops short of the goal",
    ),
    Reading(
        open="constraint handling",
        reading="feasible first; the weighted penalty as an option",
        why="not stated",
    ),
    Reading(
        open="reference [19], population 3",
        reading="variant M (symbiotic, after Niu et al. 2007) and variant S (cooperative, after Zhang and Ding 2011)",
        why="the two published three-population PSOs that fit the text",
    ),
    Reading(
        open="v1, v2, v3 in variant S",
        reading="the velocities before the update, G1 and G2 the fitness of the current positions",
        why="all three at the same time step",
    ),
    Reading(open="split of 300 particles", reading="100 / 100 / 100", why="both sources use equal populations"),
    Reading(open="c3 of variant M", reading="2, as c1 and c2", why="not stated"),
    Reading(
        open="velocity clamp",
        reading="0.2 of the joint range for IPSO; PSO unclamped as in Table 1",
        why="both sources of IPSO clamp",
    ),
    Reading(
        open="initial velocities",
        reading="uniform within +- 0.2 of the joint range",
        why="'stochastic under constraints'",
    ),
    Reading(
        open="particles beyond the joint limits",
        reading="set onto the limit, that component of the velocity to 0",
        why="not stated",
    ),
    Reading(
        open="what an iteration is",
        reading="one evaluation of every particle, the initial random one included: 100 iterations are 30,000 evaluations",
        why="Table 1 gives 300 particles and 100 iterations",
    ),
    Reading(
        open="inertia weight in eq. (14)",
        reading="w (printed v), falling linearly over the evaluations",
        why="the printed v is a misprint",
    ),
    Reading(
        open="r1, r2",
        reading="drawn for every particle, dimension and iteration",
        why="the usual reading",
    ),
    Reading(
        open="the path",
        reading="the motion that the planner finds from the start configuration to the swarm's best configuration, with its "
        "certificate; beside it, as the paper draws it, the trace of the best end effector over the iterations",
        why="the paper's particle is one configuration, not a path",
    ),
    Reading(
        open="base attitude",
        reading="Q_b0 = Q_bd = (1, 0, 0, 0): the base is held fixed",
        why="they are given as equal",
    ),
)
"""All declared readings."""
