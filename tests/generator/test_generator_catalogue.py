"""Hidden causes of the same form as an effect of the catalogue leave the trace that it leaves."""

from dataclasses import asdict, replace

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import MEMORY, NOMINAL, drive, effects, track
from short import FREE, short_truth

from rigid.effects import CATALOGUE
from rigid.generator.constants import LITRE_PER_MINUTE
from rigid.generator.hidden import HIDDEN, Hidden
from rigid.generator.pieces import pump_flow
from rigid.generator.simulate import simulate
from rigid.likelihood.groups import SlowGroup

FLOW = FREE.kappa * pump_flow(0.0)  # constant: the pressure stays far below p_max
# Cause, its numbers at which it has the effect's form, and the effect's parameter.
SAME = {
    "constant-force": ({"amplitude": 300.0, "sign": -1}, {"F_constant": -300.0}),
    "effective-area": ({"amplitude": 0.01, "sign": 1}, {"area_excess": 0.01}),
    "load-cell-drift": ({"amplitude": 40.0, "warming": 1e7}, {"load_drift": 40.0}),
    "clock-offset": (
        {"amplitude": 0.013, "sign": 1},
        {"pressure_delay": 0.013, "load_delay_ratio": 0.0},
    ),
    "hose-pressure-drop": (
        {"amplitude": 2e9},
        {"R_hose": 2e9 * (1.0 + (FLOW / (10.0 * LITRE_PER_MINUTE)) ** 0.75)},
    ),
}
ABSENT = {
    "F_constant": 0.0,
    "area_excess": 0.0,
    "load_drift": 0.0,
    "R_hose": 0.0,
    "q_fittings": 1e6,
}
STEPS = {"load": 295.0, "stroke": 0.22e-3, "pressure": 5 * 6894.757}


def modelled(more: dict[str, float]) -> dict[str, np.ndarray]:
    """Readings of the free run by the model that is fitted, with all these effects in it."""
    truth = short_truth()
    known = truth.parameters()
    names = [name for name in NOMINAL if name in known]
    values = (
        NOMINAL
        | {name: known[name] for name in names}
        | {"pressure_delay": 0.0, "load_delay_ratio": 0.0}
    )
    values |= ABSENT | more | {"kappa[free-run-1,A]": FREE.kappa}
    one = track(
        "free-run-1,A", "free-run", 151, drive=drive(151, (1.2,), (1, 0)),
    )  # fmt: skip
    group = SlowGroup((one,), effects(MEMORY) + tuple(CATALOGUE[name] for name in SAME))
    read = group.predict({k: jnp.asarray([v], dtype=float) for k, v in values.items()})
    return {quantity: np.asarray(series)[:151, 0, 0] for quantity, series in read.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", SAME)
def test_same_form_same_trace(name):
    numbers, parameters = SAME[name]
    cause: Hidden = replace(HIDDEN[name](HIDDEN[name].typical), **numbers)
    assert asdict(cause)["amplitude"] != 0.0
    truth = short_truth()
    plain, hidden = (simulate(truth, FREE, more).values for more in ((), (cause,)))
    without, effect = modelled({}), modelled(parameters)
    for channel, step in STEPS.items():
        made, found = hidden[channel] - plain[channel], effect[channel] - without[channel]
        # A tenth of a step is what the model's steps may be off by, anywhere; a hundredth of the
        # effect's own trace besides, since that is a difference of two such readings. In the first
        # tenth of a second after a switch of the valve two steps: there the model reads a late
        # pressure between samples of a corner that is sharper than they are.
        near = np.abs(np.arange(151)[:, None] - [0, 120]).min(axis=1) < 10
        allowed = np.where(near, 2.0, 0.1) * step + 0.01 * np.abs(found).max()
        assert (np.abs(made - found) < allowed).all(), channel
        if np.abs(found).max() > 2 * step:
            size = np.linalg.norm(found)
            assert np.linalg.norm(made - found) < 0.1 * size, channel
