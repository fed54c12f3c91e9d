"""The swarm by ask and tell: it gives positions to evaluate, and is told what they are worth; and the result of a run."""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

import os
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief, Rows, counted, numbers
from spacearm.core.checks import as_readonly, shown
from spacearm.core.errors import SettingsError, SwarmError
from spacearm.core.native import native
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.random_seed import Rng, seed_of
from spacearm.swarm.checkpoint import broken_checkpoint, read_checkpoint, write_checkpoint
from spacearm.swarm.swarm_settings import DEFAULT_SETTINGS, IPSO, PSO, SwarmSettings, kernel_settings, named_settings

Array = NDArray[np.float64]

MESSAGES = {
    "budget": "the evaluation budget is spent",
    "target": "the target fitness was reached without violation",
    "stalled": "the best has not improved for the stated number of iterations",
    "time": "the time limit was reached",
    "callback": "the callback asked to stop",
    "interrupted": "interrupted from the keyboard",
    "feasible": "a candidate without violation was found, as asked",
}
"""Why a run stopped: the status, and its sentence."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SwarmHistory(Brief):
    """The swarm's best after each of T iterations, and what it had cost.

    Attributes:
        fitness: (T,) of the best so far, judged feasible first: it rises when a less violating one takes over.
        violation: (T,) of the same, 0 once it is feasible.
        evaluations: (T,) spent so far.
        positions: (T, d) of the best so far; None unless asked for.
    """

    fitness: Array
    violation: Array
    evaluations: NDArray[np.int64]
    positions: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SwarmResult(Brief, InNotebooks):
    """The best that a swarm found, and why it stopped.

    Attributes:
        x: (d,) the best position evaluated, within the bounds. If nothing was feasible, the one of least violation.
        fitness: f at x, exactly as f returned it; infinite if that was NaN or minus infinity.
        violation: at x; 0 if feasible.
        status: a key of `MESSAGES`.
        iterations: rounds done.
        evaluations: positions evaluated, exactly.
        failed_evaluations: those where f gave NaN or minus infinity; they counted as the worst there is.
        seed: random seed; repeats the run together with the settings and the trial.
        trial: which of the independent runs with this random seed it is.
        settings: of the swarm.
        history: over the iterations.
        seconds: wall time; for one of several native trials, an even share of what all took.
        minus_infinite_evaluations: those of the failed where f gave minus infinity.
        infinite_evaluations: those where fitness or violation was infinite, which is the worst there is, and not failed.
    """

    x: Array
    fitness: float
    violation: float
    status: str
    iterations: int
    evaluations: int
    failed_evaluations: int
    seed: int
    trial: int
    settings: SwarmSettings
    history: SwarmHistory
    seconds: float
    minus_infinite_evaluations: int = 0
    infinite_evaluations: int = 0

    def _in_short(self) -> tuple[str, Rows]:
        rows = [("why it ended", self.message), ("x", numbers(self.x)), ("fitness", f"{self.fitness!r}")]
        if self.violation > 0:
            rows.append(("violation", f"{self.violation:.4g}"))
        rows.append(("spent", f"{self.iterations:,} iterations, {self.evaluations:,} evaluations, {self.seconds:.3g} s"))
        rows.append(("made with", f"seed {self.seed}, trial {self.trial}, {type(self.settings).__name__}: result.settings"))
        judged = "feasible" if self.success else "not feasible"
        return f"SwarmResult, {judged}: fitness {self.fitness:.6g}, {counted(len(self.x), 'dimension')}", rows

    @property
    def success(self) -> bool:
        """Whether x is feasible and was not a failed evaluation."""
        return bool(self.violation <= 0 and np.isfinite(self.fitness))

    @property
    def message(self) -> str:
        """A sentence on why the run stopped and what is worth knowing about it."""
        text = MESSAGES[self.status]
        useless = self.failed_evaluations + self.infinite_evaluations
        if useless >= self.evaluations:
            return f"{text}; every evaluation failed (NaN or infinite): check f on a single position"
        if self.violation <= 0 and not np.isfinite(self.fitness):
            text += (
                f"; f is infinite wherever nothing is violated, and finite in {self.evaluations - useless} evaluations that do"
            )
        elif self.violation > 0:
            text += f"; nothing feasible was found, x violates least, by {self.violation:.3g}: allow more evaluations"
        if self.failed_evaluations:
            gave = "NaN or minus infinity" if self.minus_infinite_evaluations else "NaN"
            text += f"; {self.failed_evaluations} of {self.evaluations} evaluations gave {gave} and counted as the worst"
        if self.infinite_evaluations:
            text += f"; {self.infinite_evaluations} of {self.evaluations} evaluations gave infinity"
        return text


_MOST_NUMBERS = 10**8  # particles times dimensions: the kernel takes about 60 bytes for each


class Swarm(Brief):
    """A swarm over a box, for any objective.

    A round is ``x = swarm.ask()``, then ``swarm.tell(f(x))`` or ``swarm.tell(f(x), violation)``, until `done`. The
    numbers depend on the random seed, the settings and what is told, on nothing else.

    Args:
        lower: (d,) lower bounds; equal to the upper one where a dimension is fixed.
        upper: (d,) upper bounds.
        settings: `PSO(...)` or `IPSO(...)`; None: `named_settings("ring-small")`.
        rng: seed, generator or None.
        initial: (k, d) positions to begin with, k up to the number of particles; the others are drawn.
        keep_positions: also keep the best position of every iteration in the history.

    Attributes:
        lower: (d,) the bounds, read-only.
        upper: (d,) likewise.
        settings: of the swarm.
        seed: the random seed.
        initial: (k, d) the positions to begin with, or None.
        keep_positions: whether the history has positions.

    Raises:
        SettingsError: bounds that are not finite or not in order, or initial positions outside them.
    """

    def __init__(
        self,
        lower: ArrayLike,
        upper: ArrayLike,
        settings: SwarmSettings | None = None,
        *,
        rng: Rng = None,
        initial: ArrayLike | None = None,
        keep_positions: bool = False,
    ) -> None:
        settings = named_settings(DEFAULT_SETTINGS) if settings is None else settings
        if not isinstance(settings, (PSO, IPSO)):
            raise SettingsError(f"settings is {shown(settings)}, expected PSO(...) or IPSO(...)")
        self.lower, self.upper = as_bounds(lower, upper)
        self.settings = settings
        self.seed = seed_of(rng)
        self._begun = time.perf_counter()
        self._asked = False
        self.keep_positions = keep_positions
        self._infinite = self._minus_infinite = 0  # evaluations
        self._rows: list[tuple[float, float, int]] = []
        self._positions: list[Array] = []
        kernel = kernel_settings(settings)
        _require_room(self.dims, settings)
        try:
            self._native = native.Swarm64(kernel, self.lower, self.upper, self.seed, 0)
        except MemoryError:
            raise SettingsError(f"particles is {settings.particles}, more than there is memory for; ask for fewer") from None
        self.initial = None if initial is None else self._checked_initial(initial)

    def _in_short(self) -> tuple[str, Rows]:
        told = f"{self.iteration:,} of {self.settings.iterations:,} iterations, {self.evaluations:,} evaluations"
        rows = [("told", told), ("made with", f"seed {self.seed}, {type(self.settings).__name__}: swarm.settings")]
        if self.iteration:
            worst = f", violation {self.best_violation:.4g}" if self.best_violation > 0 else ""
            rows.insert(0, ("best", f"fitness {self.best_fitness:.6g}{worst} at {numbers(self.best_x)}"))
        return f"Swarm: {counted(self.settings.particles, 'particle')}, {counted(self.dims, 'dimension')}", rows

    @property
    def dims(self) -> int:
        """Number of dimensions d."""
        return len(self.lower)

    @property
    def iteration(self) -> int:
        """Rounds told so far."""
        return self._native.round

    @property
    def evaluations(self) -> int:
        """Positions told so far."""
        return self._native.evaluations

    @property
    def done(self) -> bool:
        """Whether the budget of particles x iterations is spent; asking on is allowed."""
        return self._native.spent

    @property
    def best_x(self) -> Array:
        """The best position so far (d,)."""
        return self._native.best_position

    @property
    def best_fitness(self) -> float:
        """Its fitness; infinite before the first tell."""
        return self._native.best_fitness

    @property
    def best_violation(self) -> float:
        """Its violation; infinite before the first tell."""
        return self._native.best_violation

    def ask(self) -> Array:
        """Return the positions to evaluate, (particles, d), always within the bounds.

        Raises:
            SwarmError: the last positions were not told yet.
        """
        if self._asked:
            raise SwarmError("ask() was called twice, expected tell() in between; tell the last positions' fitness first")
        self._native.ask()
        if self._native.round == 0 and self.initial is not None:
            self._native.place_first(self.initial)
        self._asked = True
        return self._native.positions()

    def tell(self, fitness: ArrayLike, violation: ArrayLike | None = None) -> None:
        """Tell what the positions asked for are worth.

        Args:
            fitness: (particles,) to be minimised; NaN is a failed evaluation and counts as the worst, and so is minus infinity:
                where a logarithm or a quotient has no value there is nothing to be found.
            violation: (particles,) by how much constraints are broken, 0 or less where none is; None: none anywhere.

        Raises:
            SwarmError: nothing was asked, or another shape.
        """
        if not self._asked:
            raise SwarmError("tell() was called before ask(), expected x = ask() and then tell(f(x))")
        n = self._native.active
        f = as_values("fitness", fitness, n, self.dims)
        c = np.zeros(n) if violation is None else as_values("violation", violation, n, self.dims)
        bottomless = f == -np.inf
        f = np.where(bottomless, np.nan, f)
        if isinstance(self.settings, IPSO) and self.settings.variant == "cooperative" and (f <= 0).any():
            raise SwarmError(
                f"fitness[{int(np.argmax(f <= 0))}] is {f[np.argmax(f <= 0)]:g}, expected positive values: the cooperative "
                "variant divides by them; add a constant to f or choose another variant"
            )
        self._native.tell(f, c)
        self._asked = False
        self._minus_infinite += int(np.count_nonzero(bottomless & ~np.isnan(c)))
        self._infinite += int(np.count_nonzero(((f == np.inf) | (c == np.inf)) & ~np.isnan(f) & ~np.isnan(c)))
        self._rows.append((self.best_fitness, self.best_violation, self.evaluations))
        if self.keep_positions:
            self._positions.append(self.best_x)

    def result(self, status: str = "budget") -> SwarmResult:
        """Return the best so far, as a run that stopped for this reason."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 3)
        positions = np.array(self._positions).reshape(-1, self.dims) if self.keep_positions else None
        return SwarmResult(
            x=self.best_x,
            fitness=self.best_fitness,
            violation=self.best_violation,
            status=status,
            iterations=self.iteration,
            evaluations=self.evaluations,
            failed_evaluations=self._native.failed_evaluations,
            minus_infinite_evaluations=self._minus_infinite,
            infinite_evaluations=self._infinite,
            seed=self.seed,
            trial=0,
            settings=self.settings,
            history=SwarmHistory(
                fitness=rows[:, 0],
                violation=rows[:, 1],
                evaluations=rows[:, 2].astype(np.int64),
                positions=positions,
            ),
            seconds=time.perf_counter() - self._begun,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a checkpoint from which `load` goes on exactly; a checkpoint of this swarm is replaced.

        Raises:
            SwarmError: positions were asked for and not told.
            OutputError: the file cannot be written, or holds something else.
        """
        if self._asked:
            raise SwarmError("save() was called between ask() and tell(), expected after tell(); tell the fitness first")
        write_checkpoint(
            path,
            settings=self.settings,
            seed=self.seed,
            lower=self.lower,
            upper=self.upper,
            state=self._native.state(),
            rows=np.array(self._rows, dtype=np.float64).reshape(-1, 3),
            positions=np.array(self._positions).reshape(-1, self.dims) if self.keep_positions else None,
            initial=self.initial,
            infinite=(self._minus_infinite, self._infinite),
        )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Swarm:
        """Read a checkpoint: the swarm goes on as if it had never stopped.

        Raises:
            FileFormatError: the file is missing, broken, or no checkpoint of ours.
        """
        saved = read_checkpoint(path)
        try:
            swarm = cls(
                saved.lower,
                saved.upper,
                saved.settings,
                rng=saved.seed,
                initial=saved.initial,
                keep_positions=saved.positions is not None,
            )
            if saved.state.keys() != swarm._native.state().keys():
                raise broken_checkpoint(path)
            swarm._native.restore(saved.state)
        except (SettingsError, ValueError, TypeError, KeyError):  # the kernel's own for a state of another shape
            raise broken_checkpoint(path) from None
        n = swarm.iteration
        counted = saved.rows.shape == (n, 3) and saved.rows.dtype == np.float64 and bool(np.isfinite(saved.rows[:, 2]).all())
        if not counted or (saved.positions is not None and saved.positions.shape != (n, swarm.dims)):
            raise broken_checkpoint(path)
        swarm._minus_infinite, swarm._infinite = saved.infinite
        swarm._rows = [(float(f), float(c), int(n)) for f, c, n in saved.rows]
        swarm._positions = [] if saved.positions is None else list(saved.positions)
        return swarm

    def _checked_initial(self, initial: ArrayLike) -> Array:
        rows = as_readonly("initial", initial, (None, self.dims), SettingsError)
        if len(rows) > self.settings.particles:
            raise SettingsError(
                f"initial has {len(rows)} positions, expected at most the {self.settings.particles} particles; leave some out"
            )
        outside = np.argwhere((rows < self.lower) | (rows > self.upper))
        if len(outside):
            i, d = (int(k) for k in outside[0])
            raise SettingsError(
                f"initial[{i}][{d}] is {rows[i, d]:g}, outside its bounds {self.lower[d]:g} to {self.upper[d]:g}; "
                "move it inside or widen the bounds"
            )
        return rows


def _require_room(dims: int, settings: SwarmSettings) -> None:
    if dims * settings.particles > _MOST_NUMBERS:
        raise SettingsError(
            f"{settings.particles} particles of {dims} dimensions are {dims * settings.particles:.3g} numbers, expected "
            f"at most {_MOST_NUMBERS:g}, which take about 6 GB; ask for fewer"
        )


def as_bounds(lower: ArrayLike, upper: ArrayLike) -> tuple[Array, Array]:
    """Check the bounds of a box: finite, of one length, in order.

    Raises:
        SettingsError: they are not; the entry is named.
    """
    low = as_readonly("lower", lower, (None,), SettingsError)
    high = as_readonly("upper", upper, (None,), SettingsError)
    if len(low) != len(high) or not len(low):
        raise SettingsError(f"lower has {len(low)} entries and upper {len(high)}, expected the same number, 1 or more")
    if (low > high).any():
        i = int(np.argmax(low > high))
        raise SettingsError(f"lower[{i}] is {low[i]:g}, above upper[{i}] {high[i]:g}, expected at most it; swap them")
    with np.errstate(over="ignore"):
        width = high - low
    if not np.isfinite(width).all():
        i = int(np.argmax(~np.isfinite(width)))
        raise SettingsError(f"upper[{i}] - lower[{i}] is {width[i]:g}, expected a finite range; narrow the bounds")
    return low, high


def as_values(name: str, values: object, n: int, dims: int) -> Array:
    """Check what an objective returned: one number a particle.

    Raises:
        SwarmError: another shape, or not numbers; both shapes are named.
    """
    try:
        given = np.asarray(values)
    except (TypeError, ValueError):  # rows of different lengths
        given = np.array(None)
    # Kinds are asked for because NumPy would turn None into NaN and drop an imaginary part.
    if given.dtype.kind not in "biuf":
        raise SwarmError(f"{name} is {shown(values)}, expected {n} numbers, one a particle")
    if given.shape != (n,):
        raise SwarmError(
            f"{name} has shape {given.shape}, expected ({n},): f is given all particles at once, as ({n}, {dims}), and "
            "returns one number for each; for an f of a single position pass vectorized=False"
        )
    return np.ascontiguousarray(given, dtype=np.float64)
