"""The study of oscillators: its machines obey their equations, its table counts what rows say."""

import numpy as np
import pytest
from oscillators import RIGHT, Case, cells, drawn, simulated, written

from rigid.spec import load_spec


@pytest.mark.parametrize("population", ["nothing", "cubic", "square", "decay"])
def test_forces_balance_along_the_motion(population):
    one = drawn(np.random.default_rng(3))
    t, x, force = simulated(population, one, np.random.default_rng(4))
    v, inner = np.gradient(x, t, edge_order=2), slice(400, -400)
    taken = one.mass * np.gradient(v, t) + one.drag * v + one.stiffness * x
    left = (force - taken)[inner]
    fast, size = one.size * one.omega, np.std(one.stiffness * x)
    hidden = {
        "nothing": 0.0 * x,
        "cubic": one.share * one.stiffness / one.size**2 * x**3,
        "square": 15.0 * one.share * one.drag / fast * v * np.abs(v),
        "decay": 0.03 * one.share * one.stiffness * one.size * np.tanh(v / (1e-3 * fast)),
    }[population][inner]
    assert np.std(left - hidden) < 0.01 * size
    if population in ("cubic", "square"):
        assert np.std(left - hidden) < 0.3 * np.std(hidden)


def test_a_late_force_is_that_of_before():
    one = drawn(np.random.default_rng(3))
    t, x, late = simulated("late", one, np.random.default_rng(4))
    _, same, force = simulated("nothing", one, np.random.default_rng(4))
    np.testing.assert_array_equal(x, same)
    lags = np.linspace(0.0, 0.06 / one.frequency, 200)
    off = [np.std(np.interp(t - lag, t, force) - late) for lag in lags]
    assert 0.0 < lags[np.argmin(off)] < lags[-1]
    assert min(off) < 0.05 * np.std(force)


def test_a_campaign_is_a_spec_and_a_record(tmp_path):
    spec = load_spec(written(Case(0, "decay", 5), tmp_path))
    assert spec.simulated
    assert (tmp_path / "swing.csv").read_text("utf-8").startswith("t,x,F\n")


def test_the_table_counts_what_is_said_first_and_wrong_names_in_any_step():
    def row(*steps: tuple[str, float], verdict: str = "named") -> dict:
        told = [{"said": name, "probability": p} for name, p in steps]
        return {"verdict": verdict, "steps": told, "gap": [2.0, 1.0], "failed": ["residuals"]}

    rows = [
        row(("lugre-friction", 0.95), ("joint-spring", 0.95)),
        row(("coulomb-friction", 0.5), ("joint-spring", 0.5)),
        row(("force over speed", 1.0)),
        row(verdict="nothing-missing"),
    ]
    count, right, least, wrong, other, loud, gaps, _ = cells(rows, RIGHT["dry"])
    assert (count, right, wrong, loud) == ("4", "2", "1", "4")
    assert (other, gaps) == ("force over speed 1, nothing-missing 1", "2, 1")
    assert least == "10 %"  # Clopper and Pearson: 2 of 4
