"""The swarm, one particle at a time, from the equations of the papers; slow, and independent of the kernel.

It draws the kernel's random numbers, which test_random.py holds to their definition, and does each sum in the order in
which it is written in the equations, in the scalar of the kernel's build. So it agrees with the kernel bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from kernel.builds import Build

START_POSITION, START_VELOCITY, VELOCITY, EVOLUTION, ARCHIVE = range(5)
MASTERS_BLOCKS = 0x10000  # where variant M's third random number is drawn from

DEFAULTS: dict[str, Any] = {
    "particles": 300,
    "evaluations": 30000,
    "variant": "pso",
    "inertia_start": 0.5,
    "inertia_end": 0.5,
    "cognitive": 2.0,
    "social": 2.0,
    "cooperation": 2.0,
    "velocity_clamp": 0.0,
    "start_velocity": 0.2,
    "ring": 0,
    "bounds": "absorb",
    "constraints": "feasible_first",
    "penalty_start": 0.0,
    "penalty_end": 0.0,
    "penalty_rise": 0.0,
    "tolerance_share": 0.0,
    "tolerance_until": 0.8,
    "tolerance_power": 5,
    "evolving_share": 1.0,
    "elite_share": 0.11,
    "memory": 20,
    "shrink_to": 0,
}


class Merit(NamedTuple):
    """What a candidate is judged by; less is better, violation first."""

    violation: Any
    fitness: Any


class RandomSequence:
    """The kernel's random numbers by their meaning, for one seed and trial."""

    def __init__(self, build: Build, seed: int, trial: int) -> None:
        self._build, self._key = build, (seed, trial)
        self._drawn: dict[tuple[int, ...], np.ndarray] = {}

    def number(self, purpose: int, round_: int, particle: int, block: int, word: int) -> Any:
        first = particle // self._build.drawn_together * self._build.drawn_together
        at = (purpose, round_, first, block)
        if at not in self._drawn:
            self._drawn[at] = self._build.named("uniforms")(*self._key, *at)
        return self._drawn[at][word, particle - first]

    def sequence(self, purpose: int, round_: int, particle: int) -> Iterator[Any]:
        block = 0
        while True:
            yield from (self.number(purpose, round_, particle, block, word) for word in range(4))
            block += 1


class EquationSwarm:
    """Ask and tell, like the kernel's Swarm; `x`, `v`, `p` and the others are arrays with a row a particle."""

    def __init__(
        self, build: Build, settings: dict[str, Any], lower: Any, upper: Any, *, seed: int = 0, trial: int = 0
    ) -> None:
        self.T = build.scalar
        self.set = {**DEFAULTS, **settings}
        self.lower, self.upper = np.asarray(lower, dtype=self.T), np.asarray(upper, dtype=self.T)
        self.dims, n = len(self.lower), self.set["particles"]
        self.random = RandomSequence(build, seed, trial)
        self.round, self.used, self.failed = 0, 0, 0
        self.x = np.zeros((n, self.dims), dtype=self.T)
        self.v, self.p = self.x.copy(), self.x.copy()
        self.f, self.c, self.pf, self.pc = (np.full(n, np.inf, dtype=self.T) for _ in range(4))
        self.best, self.best_x = Merit(np.inf, np.inf), np.zeros(self.dims, dtype=self.T)
        self.tolerance = self.first_tolerance = self.penalty = self.T(0)
        self.populations = self._split(n)
        self.history = Evolution(self)

    def _split(self, n: int) -> list[range]:
        variant = self.set["variant"]
        if variant == "pso":
            return [range(n)]
        each = int((1 - self.set["evolving_share"]) * n / 2 + 1e-9) if variant == "evolving" else max(1, n // 3)
        second, third = min(n, each), min(n, 2 * each)
        return [range(second), range(second, third), range(third, n)]

    @property
    def active(self) -> int:
        return self.populations[-1].stop

    @property
    def evolving(self) -> range:
        return self.populations[2] if self.set["variant"] == "evolving" else range(0)

    # ---- judging ----------------------------------------------------------------------------------------------------

    def judged(self, fitness: Any, violation: Any) -> Merit:
        if self.set["constraints"] == "penalty":
            with np.errstate(over="ignore"):
                return Merit(self.T(0), fitness + np.minimum(violation, np.finfo(self.T).max) * self.penalty)
        return Merit(violation if violation > self.tolerance else self.T(0), fitness)

    def personal(self, i: int) -> Merit:
        return self.judged(self.pf[i], self.pc[i])

    def leader(self, population: range) -> int:
        return min(population, key=self.personal)  # the first of equals

    def progress(self) -> float:
        return min(1.0, self.used / self.set["evaluations"])

    def tell(self, fitness: np.ndarray, violation: np.ndarray) -> None:
        n = self.active
        for i in range(n):
            fine = not (np.isnan(fitness[i]) or np.isnan(violation[i]))
            self.failed += not fine
            self.f[i] = fitness[i] if fine else np.inf
            self.c[i] = max(violation[i], 0) if fine else np.inf
        self.used += n
        self._schedule(n)
        for i in range(n):
            if Merit(self.c[i], self.f[i]) < self.best or (self.round, i) == (0, 0):
                self.best, self.best_x = Merit(self.c[i], self.f[i]), self.x[i].copy()
        if self.round == 0:
            # Whatever they are worth, no other positions are known yet.
            self.p, self.pf, self.pc = self.x.copy(), self.f.copy(), self.c.copy()
        for i in range(n):
            now, old = self.judged(self.f[i], self.c[i]), self.personal(i)
            if now < old:
                if i in self.evolving:
                    self.history.succeeded(i, now, old)
                self.p[i], self.pf[i], self.pc[i] = self.x[i], self.f[i], self.c[i]
        self.history.learn()
        self._shrink()
        self.round += 1

    def _schedule(self, n: int) -> None:
        if self.round == 0 and self.set["tolerance_share"] > 0:
            quantile = np.sort(self.c[:n])[min(n - 1, int(self.set["tolerance_share"] * n))]
            self.first_tolerance = quantile if np.isfinite(quantile) else self.T(0)
        left = max(0.0, 1 - self.progress() / self.set["tolerance_until"])
        share = 1.0
        for _ in range(self.set["tolerance_power"]):
            share *= left
        self.tolerance = self.first_tolerance * self.T(share)
        start, end, rise = (self.set[f"penalty_{name}"] for name in ("start", "end", "rise"))
        s = max(0.0, self.progress() - rise) / max(1e-12, 1 - rise)
        self.penalty = self.T(start + (end - start) * s * s)

    def _shrink(self) -> None:
        if not self.evolving or self.set["shrink_to"] <= 0:
            return
        first, whole, least = self.evolving.start, self.set["particles"] - self.evolving.start, self.set["shrink_to"]
        kept = max(least, int(whole - (whole - least) * self.progress() + 0.5))
        if kept >= len(self.evolving):
            return
        order = sorted(self.evolving, key=self.personal)
        for values in (self.p, self.pf, self.pc):
            values[first : first + len(order)] = values[order].copy()
        self.populations[2] = range(first, first + kept)
        del self.history.archive[self.history.room() :]

    # ---- moving -----------------------------------------------------------------------------------------------------

    def ask(self) -> np.ndarray:
        if self.round == 0:
            self._start()
        else:
            if self.set["variant"] == "evolving":
                self._fly([*self.populations[0], *self.populations[1]])
                self.history.propose()
            else:
                self._fly(range(self.active))
        return self.x[: self.active].copy()

    def _start(self) -> None:
        for i in range(self.active):
            for d in range(self.dims):
                u = self.random.number(START_POSITION, 0, i, d // 4, d % 4)
                s = self.random.number(START_VELOCITY, 0, i, d // 4, d % 4)
                width = self.upper[d] - self.lower[d]
                self.x[i, d] = min(self.lower[d] + u * width, self.upper[d])
                self.v[i, d] = (s + s - self.T(1)) * (width * self.T(self.set["start_velocity"]))

    def _fly(self, flying: Any) -> None:
        T, variant = self.T, self.set["variant"]
        w0, w1 = self.set["inertia_start"], self.set["inertia_end"]
        w = T(w0 - (w0 - w1) * self.progress())  # eq. (14)
        c1, c2 = T(self.set["cognitive"]), T(self.set["social"])
        phi, slave = self._phi() if variant == "symbiotic" and self.populations[2] else (1.0, 0)
        carried = self.v.copy()
        if variant == "cooperative":
            self._carry(carried)
        moved = {}
        for i in flying:
            v, guide = np.empty(self.dims, dtype=T), self._guide(i)
            for d in range(self.dims):
                r1 = self.random.number(VELOCITY, self.round, i, d // 2, 2 * (d % 2))
                r2 = self.random.number(VELOCITY, self.round, i, d // 2, 2 * (d % 2) + 1)
                x, p, g = self.x[i, d], self.p[i, d], self.p[guide, d]
                v[d] = w * carried[i, d] + c1 * r1 * (p - x)  # eq. (13)
                if variant == "symbiotic" and i in self.populations[2]:
                    r3 = self.random.number(VELOCITY, self.round, i, MASTERS_BLOCKS + d // 4, d % 4)
                    v[d] = v[d] + T(phi * self.set["social"]) * r2 * (g - x)
                    v[d] = v[d] + T((1 - phi) * self.set["cooperation"]) * r3 * (self.p[slave, d] - x)
                else:
                    v[d] = v[d] + c2 * r2 * (g - x)
            moved[i] = self._land(self.x[i], v)
        for i, (x, v) in moved.items():
            self.x[i], self.v[i] = x, v

    def _guide(self, i: int) -> int:
        population = next(p for p in self.populations if i in p)
        k, size = self.set["ring"], len(population)
        if k <= 0 or 2 * k + 1 >= size:
            shared = self.populations if self.set["variant"] == "cooperative" else [population]
            return min((self.leader(p) for p in shared if p), key=self.personal)
        neighbours = [population.start + (i - population.start + o) % size for o in range(-k, k + 1)]
        best = min(neighbours, key=self.personal)
        return best if self.personal(best) < self.personal(i) else i

    def _phi(self) -> tuple[float, int]:
        one, two, master = (self.leader(p) for p in self.populations)
        slave = two if self.personal(two) < self.personal(one) else one
        f_S, f_M = self.personal(slave), self.personal(master)
        return (0.0 if f_S < f_M else 1.0 if f_S > f_M else 0.5), slave

    def _carry(self, carried: np.ndarray) -> None:
        first, second, third = self.populations
        for i in third:
            one = first.start + (i - third.start) % len(first)
            two = second.start + (i - third.start) % len(first)
            with np.errstate(all="ignore"):
                G1, G2 = self.f[one], self.f[two]
                G = G1 + G2
                a, b = G / G1, G / G2
            if np.isfinite(a) and np.isfinite(b):
                carried[i] = a * self.v[one] + b * self.v[two] + self.v[i]

    def _land(self, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        T, rule = self.T, self.set["bounds"]
        width = self.upper - self.lower
        if self.set["velocity_clamp"] > 0:
            most = width * T(self.set["velocity_clamp"])
            v = np.clip(v, -most, most)
        to = x + v
        for d in range(self.dims):
            low, high = self.lower[d], self.upper[d]
            if low <= to[d] <= high:
                continue
            bound = low if to[d] < low else high
            if rule == "absorb":
                to[d], v[d] = bound, 0
            elif rule == "reflect":
                to[d], v[d] = np.clip(bound + bound - to[d], low, high), -v[d]
            elif width[d] > 0:
                turns = np.rint((to[d] - low) / width[d] - T(0.5))
                to[d] = np.clip(to[d] - turns * width[d], low, high)
            else:
                to[d] = low
        return to, v


class Evolution:
    """Population 3 by differential evolution with a success history: SHADE, Tanabe and Fukunaga (CEC 2013), with these
    changes: F is drawn around a Cauchy and CR around a bell-shaped distribution made without logarithms; the elite's
    share is fixed, and the leaders of populations 1 and 2 belong to it; r1 and r2 may be any member.
    """

    def __init__(self, swarm: EquationSwarm) -> None:
        self.swarm, T = swarm, swarm.T
        self.M_F, self.M_CR = (np.full(swarm.set["memory"], 0.5, dtype=T) for _ in range(2))
        self.archive: list[np.ndarray] = []
        self.next = 0
        self.F: dict[int, Any] = {}
        self.CR: dict[int, Any] = {}
        self.gains: dict[int, Any] = {}

    def room(self) -> int:
        return int(1.4 * len(self.swarm.evolving))

    def propose(self) -> None:
        s, T = self.swarm, self.swarm.T
        n = len(s.evolving)
        self.gains = {}
        by_merit = sorted(s.evolving, key=s.personal)
        elite = by_merit[: max(min(2, n), int(s.set["elite_share"] * n + 0.5))]
        elite += [s.leader(p) for p in s.populations[:2] if len(p)]
        for i in s.evolving:
            u = s.random.sequence(EVOLUTION, s.round, i)
            r = below(u, len(self.M_F), T)
            CR = min(max(self.M_CR[r] + T(0.1) * bell(u, T), T(0)), T(1))
            F = T(0)
            while not F > 0:
                F = self.M_F[r] + T(0.1) * cauchy(u, T)
            F = min(F, T(1))
            self.F[i], self.CR[i] = F, CR
            best = elite[below(u, len(elite), T)]
            r1 = s.evolving.start + below(u, n, T)
            r2 = below(u, n + len(self.archive), T)
            x_r2 = s.p[s.evolving.start + r2] if r2 < n else self.archive[r2 - n]
            certain = below(u, s.dims, T)
            for d in range(s.dims):
                x = s.p[i, d]
                y = x + F * (s.p[best, d] - x) + F * (s.p[r1, d] - x_r2[d])  # current-to-pbest/1
                if y < s.lower[d]:
                    y = (s.lower[d] + x) / T(2)
                if y > s.upper[d]:
                    y = (s.upper[d] + x) / T(2)
                crossed = next(u) < CR or d == certain
                s.x[i, d] = y if crossed else x

    def succeeded(self, i: int, now: Merit, old: Merit) -> None:
        s = self.swarm
        gain = old.violation - now.violation if now.violation < old.violation else old.fitness - now.fitness
        self.gains[i] = gain if np.isfinite(gain) and gain > 0 else s.T(1e-30)
        if self.room() == 0:
            return
        if len(self.archive) < self.room():
            self.archive.append(s.p[i].copy())
        else:
            self.archive[below(s.random.sequence(ARCHIVE, s.round, i), self.room(), s.T)] = s.p[i].copy()

    def learn(self) -> None:
        if not self.gains:
            return
        T = self.swarm.T
        # Only the gains' ratios matter: as shares of a power of 2 about the largest, their sums do not overflow.
        _, exponent = np.frexp(max(self.gains.values()))
        total = sum_F = sum_F2 = sum_CR = T(0)
        for i in sorted(self.gains):
            g, F, CR = np.ldexp(self.gains[i], -exponent), self.F[i], self.CR[i]
            total, sum_F, sum_F2, sum_CR = total + g, sum_F + g * F, sum_F2 + g * F * F, sum_CR + g * CR
        self.M_F[self.next] = sum_F2 / sum_F  # Lehmer's mean
        self.M_CR[self.next] = sum_CR / total
        self.next = (self.next + 1) % len(self.M_F)
        self.gains = {}


def below(u: Iterator[Any], n: int, T: Any) -> int:
    return min(n - 1, int(next(u) * T(n)))


def bell(u: Iterator[Any], T: Any) -> Any:
    return (next(u) + next(u) + next(u) + next(u) - T(2)) * T(1.7320508075688772)


def cauchy(u: Iterator[Any], T: Any) -> Any:
    while True:
        a, b = T(2) * next(u) - T(1), next(u)
        if a * a + b * b <= T(1) and b > 0:
            return a / b
