"""What a swarm refuses, and the sentence for each."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import SettingsError, SpacearmError, SwarmError
from spacearm.core.random_seed import seed_of
from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty, Swarm, minimize, named_settings
from support.messages import assert_refused

BOX = np.array([3.0, -9.0]), np.array([5.0, -8.5])
PLAIN = PSO(particles=4, iterations=3)


def ones(x: np.ndarray) -> np.ndarray:
    return np.ones(len(x))


def returning(value: Any, **options: Any) -> Any:
    """minimize an f that returns this, or what this makes of the positions."""
    return lambda: minimize(
        lambda x: value(x) if callable(value) else value, *BOX, options.pop("settings", PLAIN), rng=0, **options
    )


def given(**options: Any) -> Any:
    """minimize with some arguments changed."""
    arguments = {"f": ones, "lower": BOX[0], "upper": BOX[1], "settings": PLAIN, "rng": 0, **options}
    return lambda: minimize(**arguments)


def told(*values: Any, settings: Any = PLAIN) -> Any:
    def call() -> None:
        swarm = Swarm(*BOX, settings, rng=0)
        swarm.ask()
        swarm.tell(*values)

    return call


def twice(what: str) -> Any:
    def call() -> None:
        swarm = Swarm(*BOX, PLAIN, rng=0)
        if what == "ask":
            swarm.ask()
            swarm.ask()
        swarm.tell(np.ones(4))

    return call


SETTINGS: dict[str, Any] = {
    "setting mistyped": lambda: PSO(partickles=3),  # type: ignore[call-arg]
    "setting of IPSO in PSO": lambda: PSO(variant="symbiotic"),  # type: ignore[call-arg]
    "setting unlike any": lambda: PSO(temperature=3),  # type: ignore[call-arg]
    "settings by position": lambda: PSO(300, 100),  # type: ignore[call-arg]
    "IPSO by position": lambda: IPSO("symbiotic"),  # type: ignore[call-arg]
    "Penalty by position": lambda: Penalty(100.0),  # type: ignore[call-arg]
    "FeasibleFirst mistyped": lambda: FeasibleFirst(forgive=0.1),  # type: ignore[call-arg]
    "particles negative": lambda: PSO(particles=-3),
    "particles none at all": lambda: PSO(particles=0),
    "particles half": lambda: PSO(particles=2.5),  # type: ignore[arg-type]
    "particles as float": lambda: PSO(particles=30.0),  # type: ignore[arg-type]
    "particles text": lambda: PSO(particles="30"),  # type: ignore[arg-type]
    "particles True": lambda: PSO(particles=True),
    "particles too many": lambda: PSO(particles=10**9),
    "particles too few for three populations": lambda: IPSO(particles=5),
    "iterations zero": lambda: PSO(iterations=0),
    "inertia text": lambda: PSO(inertia="0.5"),  # type: ignore[arg-type]
    "inertia list": lambda: PSO(inertia=[0.9, 0.4]),  # type: ignore[arg-type]
    "inertia of three": lambda: PSO(inertia=(0.9, 0.5, 0.4)),  # type: ignore[arg-type]
    "inertia negative": lambda: PSO(inertia=(0.9, -0.4)),
    "inertia NaN": lambda: PSO(inertia=np.nan),
    "cognitive negative": lambda: PSO(cognitive=-1.0),
    "social infinite": lambda: PSO(social=np.inf),
    "cooperation negative": lambda: IPSO(cooperation=-2.0),
    "velocity_clamp zero": lambda: PSO(velocity_clamp=0.0),
    "start_velocity negative": lambda: PSO(start_velocity=-0.1),
    "neighbours zero": lambda: PSO(neighbours=0),
    "neighbours half": lambda: PSO(neighbours=1.5),  # type: ignore[arg-type]
    "bounds mistyped": lambda: PSO(bounds="absorbe"),  # type: ignore[arg-type]
    "bounds unlike any": lambda: PSO(bounds=None),  # type: ignore[arg-type]
    "constraints by name": lambda: PSO(constraints="penalty"),  # type: ignore[arg-type]
    "constraints as class": lambda: PSO(constraints=Penalty),  # type: ignore[arg-type]
    "variant mistyped": lambda: IPSO(variant="symbiotc"),  # type: ignore[arg-type]
    "evolving_share zero": lambda: IPSO(evolving_share=0.0),
    "evolving_share above 1": lambda: IPSO(evolving_share=1.2),
    "elite_share text": lambda: IPSO(elite_share="few"),  # type: ignore[arg-type]
    "memory zero": lambda: IPSO(memory=0),
    "shrink_to too few": lambda: IPSO(variant="evolving", shrink_to=3),
    "shrink_to more than there are": lambda: IPSO(variant="evolving", particles=30, shrink_to=31),
    "cooperative without a clamp": lambda: IPSO(variant="cooperative", velocity_clamp=None),
    "penalty weight zero": lambda: Penalty(weight=0),
    "penalty that falls": lambda: Penalty(weight=10.0, final_weight=1.0),
    "penalty rises after the end": lambda: Penalty(rise_from=1.5),
    "forgiven above 1": lambda: FeasibleFirst(forgiven=2),
    "forgiven until never": lambda: FeasibleFirst(until=0),
    "power zero": lambda: FeasibleFirst(power=0),
    "named settings mistyped": lambda: named_settings("ipso_m"),
    "named settings unlike any": lambda: named_settings("annealing"),
    "settings of no swarm": given(settings={"particles": 3}),
    "settings the class": given(settings=PSO),
    "seed negative": lambda: seed_of(-1),
    "seed too large": lambda: seed_of(2**63),
    "seed text": lambda: seed_of("0"),  # type: ignore[arg-type]
    "seed True": lambda: seed_of(True),
    "seed a float": lambda: seed_of(1.0),  # type: ignore[arg-type]
    "lower above upper": given(lower=[3.0, -8.0]),
    "lower NaN": given(lower=[3.0, np.nan]),
    "lower infinite": given(lower=[-np.inf, -9.0]),
    "upper infinite": given(upper=[5.0, np.inf]),
    "bounds of another length": given(lower=[3.0]),
    "bounds empty": given(lower=[], upper=[]),
    "bounds of single numbers": given(lower=0.0, upper=1.0),
    "bounds as pairs": given(lower=[[3.0, 5.0]], upper=[[5.0, 6.0]]),
    "bounds text": given(lower=["a", "b"]),
    "bounds None": given(lower=None),
    "bounds too wide": given(lower=[-1e308, 0.0], upper=[1e308, 1.0]),
    "initial outside": given(initial=[[4.0, -8.7], [4.0, -8.0]]),
    "initial NaN": given(initial=[[4.0, np.nan]]),
    "initial of one row": given(initial=[4.0, -8.7]),
    "initial of three dimensions": given(initial=[[4.0, -8.7, 0.0]]),
    "initial too many": given(initial=[[4.0, -8.7]] * 5),
    "f a number": given(f=3.0),
    "callback a number": given(callback=3),
    "target text": given(target="low"),
    "target NaN": given(target=np.nan),
    "stall_iterations zero": given(stall_iterations=0),
    "max_seconds zero": given(max_seconds=0),
    "history mistyped": given(history="position"),
    "checkpoint a number": given(checkpoint=3),
    "checkpoint empty": given(checkpoint=""),
    "checkpoint_every zero": given(checkpoint_every=0),
}

DRIVEN: dict[str, Any] = {
    "f returns a number": returning(1.0),
    "f returns None": returning(None),
    "f returns Nones": returning([None] * 4),
    "f returns texts": returning(["1"] * 4),
    "f returns complex numbers": returning(np.ones(4) * 1j),
    "f returns too few": returning(np.ones(3)),
    "f returns a column": returning(np.ones((4, 1))),
    "f returns one value a dimension": returning(lambda x: x**2),
    "f returns rows of different lengths": returning([[1.0], [1.0, 2.0], [1.0], [1.0]]),
    "f returns three": returning(lambda x: (ones(x), ones(x), ones(x))),
    "f returns one in a tuple": returning(lambda x: (ones(x),)),
    "f returns a violation too short": returning(lambda x: (ones(x), np.ones(3))),
    "f returns a violation of texts": returning(lambda x: (ones(x), ["none"] * 4)),
    "f returns a dictionary": returning({"fitness": 1.0}),
    "single: f returns None": returning(None, vectorized=False),
    "single: f returns text": returning("1", vectorized=False),
    "single: f returns an array": returning(lambda x: x, vectorized=False),
    "single: f returns three": returning((1.0, 2.0, 3.0), vectorized=False),
    "single: f returns a pair now and then": returning(lambda x: (1.0, 0.0) if x[0] > 4 else 1.0, vectorized=False),
    "cooperative: fitness zero": returning(lambda x: 0 * ones(x), settings=IPSO(variant="cooperative", particles=6)),
    "cooperative: one fitness negative": told([1, 1, 1, -0.25, 1, 1], settings=IPSO(variant="cooperative", particles=6)),
    "ask twice": twice("ask"),
    "tell before ask": twice("tell"),
    "tell too many": told(np.ones(5)),
    "tell a violation too short": told(np.ones(4), np.ones(3)),
}


@pytest.mark.parametrize("case", SETTINGS)
def test_settings_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("swarm", case, SettingsError, SETTINGS[case])


@pytest.mark.parametrize("case", DRIVEN)
def test_a_swarm_driven_wrongly_is_refused(case: str) -> None:
    assert_refused("swarm", case, SwarmError, DRIVEN[case])


@pytest.mark.parametrize("case", SETTINGS)
def test_one_error_class_catches_them_all(case: str) -> None:
    with pytest.raises(SpacearmError):
        SETTINGS[case]()


def test_a_refused_tell_can_be_repeated_rightly() -> None:
    swarm = Swarm(*BOX, PLAIN, rng=0)
    swarm.ask()
    with pytest.raises(SwarmError):
        swarm.tell(np.ones(5))
    swarm.tell(np.ones(4))
    assert swarm.evaluations == 4
