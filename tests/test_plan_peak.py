"""The greatest load of a test as what a record is to tell."""

import numpy as np
import pytest
import small_campaign

from rigid import load
from rigid.inference.newton import is_noise
from rigid.inference.search import search
from rigid.io.errors import InputError
from rigid.study.peak import Sought, peak_load, sought

TEST = """
[[records]]
name = "press"
kind = "field"
cylinder = "left"
file = "press.csv"
[records.channels]
time = { column = "t", unit = "s" }
load = { column = "F", unit = "N" }
stroke = { column = "x", unit = "m" }
pressure = { column = "p", unit = "Pa" }
"""
PEAK = 30e3
READ = ("load", "stroke", "pressure")


def write_test(folder):
    """A load that rises to PEAK within 2 s and falls as slowly, pushed by a slow plunger."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 4.0, 0.01)
    load = PEAK * np.interp(time, [0.0, 0.5, 2.5, 4.5], [0.0, 0.0, 1.0, 0.0])
    stroke = 1e-3 * np.clip(time - 0.5, 0.0, None) + load / 60e6
    pressure = load / 44e-4 + 2e5 * (time > 0.5)
    rows = np.column_stack(
        [
            time,
            295.0 * np.round((load + 100.0 * rng.standard_normal(time.size)) / 295.0),
            0.22e-3 * np.round(stroke / 0.22e-3),
            34473.8 * np.round((pressure + 2e4 * rng.standard_normal(time.size)) / 34473.8),
        ]
    )
    text = "t,F,x,p\n" + "\n".join(",".join(f"{v:.7g}" for v in row) for row in rows)
    (folder / "press.csv").write_text(text, encoding="utf-8")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A small campaign of the generator with a test of the same rig in its spec."""
    folder = tmp_path_factory.mktemp("peak")
    small_campaign.make(folder)
    own = folder / "specs" / "own.toml"
    write_test(own.parent)
    own.write_text(own.read_text("utf-8") + TEST, "utf-8")
    return load(own)


@pytest.fixture(scope="module")
def found(study):
    return search(study.problem, 2, 1)


@pytest.mark.slow
def test_the_peak_goes_with_the_gains_of_all_sensors(study, found):
    """The rig is nearly linear: sensors that all read 1 % too much say a load 1 % too large.

    10 % for what is not linear: the oil's stiffness over its column, and the law of the flow.
    """
    test = sought(study._asked, "peak_load[press]")
    assert isinstance(test, Sought)
    quantity = peak_load(test, found, 1)
    problem = found.problem
    z = found.optima[0].z
    peak = float(quantity.values(z[None])[0])
    assert peak == pytest.approx(PEAK, rel=0.05)
    slopes = dict(zip(problem.sensors, quantity.sensors.reshape(-1, 2), strict=True))
    gains = {q: slopes[f"{q},left"][0] / study.spec.sensors[q].gain_sd for q in READ}
    assert sum(gains.values()) == pytest.approx(-peak, rel=0.1)
    assert gains["load"] < -0.1 * peak
    assert np.sqrt(quantity.stays) < 0.05 * PEAK
    slope = quantity.slope(problem, z)
    assert len(slope) == int((~is_noise(problem)).sum()) + 2 * len(problem.sensors)


@pytest.mark.slow
def test_what_stays_bounds_what_a_record_can_tell(study):
    made = study.plan(("peak_load[press,left]", "k_LC"), quiet=True).result
    peak, stiffness = made["quantities"]
    assert (peak["unit"], stiffness["unit"]) == ("N", "N/m")
    assert peak["median"] == pytest.approx(PEAK, rel=0.05)
    for record in made["records"]:
        one, two, four = (
            next(
                e for e in record["expected"] if e["quantity"] == peak["name"] and e["records"] == n
            )
            for n in (1, 2, 4)
        )
        assert four["factor"] <= two["factor"] <= one["factor"] <= 1.0 + 1e-9
    assert made["records"][0]["expected"][0]["factor"] < 1.0


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("peak_load[pres]", "did you mean 'press'"),
        ("peak_load[press,right]", "unknown place 'right'"),
    ],
)
def test_a_test_that_is_not_there_is_told(study, name, says):
    with pytest.raises(InputError, match=says):
        study.plan((name,), quiet=True)


def test_tests_of_another_rig_are_refused(study, tmp_path):
    folder = study.spec.path.parent
    text = study.spec.text.replace('"frequency-dependent-friction",', "")
    (folder / "other.toml").write_text(text, "utf-8")
    mine = folder / "mine.toml"
    mine.write_text(f'{study.spec.text}\n[plan]\ntests = "other.toml"\n', "utf-8")
    with pytest.raises(InputError, match="has another rig, other effects or other sensors"):
        sought(load(mine)._asked, "peak_load[press]")
    mine.write_text(f'{study.spec.text}\n[plan]\ntests = "own.toml"\n', "utf-8")
    same = sought(load(mine)._asked, "peak_load[press]")
    assert same is not None
    assert same.spec.path.name == "own.toml"


def test_a_number_of_the_fit_is_no_peak(study):
    assert sought(study._asked, "k_LC") is None
    assert sought(study._asked, "abs_mu[80 Hz]") is None
