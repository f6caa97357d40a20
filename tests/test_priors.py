"""Every prior law against SciPy's, and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import parameter
from scipy import stats

from rigid.io.errors import InputError
from rigid.likelihood.parameters import Parameter, Scoped, collect, require_known
from rigid.likelihood.priors import LAWS, Fixed, Lognormal, Normal, make_prior

Z = np.linspace(-5.0, 5.0, 101)


class Cubed:
    """A standard normal number cubed, with a slope at 0."""

    def ppf(self, share: np.ndarray) -> np.ndarray:
        return 20.0 * (stats.norm.ppf(share) ** 3 + 0.05 * stats.norm.ppf(share)) / 1.05


CASES = {
    "lognormal": ({"median": 6e7, "factor": 2.0}, stats.lognorm(np.log(2.0), scale=6e7)),
    "normal": ({"mean": 3.0, "sd": 0.5}, stats.norm(3.0, 0.5)),
    "truncated_normal": (
        {"mean": 1.0, "sd": 0.5, "low": 0.2, "high": 1.1},
        stats.truncnorm((0.2 - 1) / 0.5, (1.1 - 1) / 0.5, 1.0, 0.5),
    ),
    "uniform": ({"low": -1.0, "high": 4.0}, stats.uniform(-1.0, 5.0)),
    "either_sign": ({"usual": 20.0}, Cubed()),
    "loguniform": ({"low": 1e3, "high": 1e6}, stats.loguniform(1e3, 1e6)),
}


def test_every_law_stands_in_the_table():
    assert set(CASES) | {"fixed"} == set(LAWS)


@pytest.mark.parametrize("name", CASES)
def test_law_maps_quantiles_to_quantiles(name: str):
    arguments, expected = CASES[name]
    law = make_prior(name, arguments, "here")
    got = np.asarray(law.from_standard(jnp.asarray(Z)))
    np.testing.assert_allclose(got, expected.ppf(stats.norm.cdf(Z)), rtol=1e-8, atol=1e-12)
    assert np.all(np.diff(got) > 0)
    assert not law.known
    slopes = jax.vmap(jax.grad(law.from_standard))(jnp.asarray(Z))
    assert np.all(np.isfinite(slopes))
    assert np.all(np.asarray(slopes) > 0)


@pytest.mark.parametrize("name", CASES)
def test_law_stays_finite_far_out(name: str):
    law = make_prior(name, CASES[name][0], "here")
    assert np.all(np.isfinite(law.from_standard(jnp.asarray([-30.0, 30.0]))))


def test_negative_median_gives_negative_values():
    law = make_prior("lognormal", {"median": -0.2, "factor": 3.0}, "here")
    assert np.all(np.asarray(law.from_standard(jnp.asarray(Z))) < 0)


def test_known_laws():
    assert make_prior("fixed", {"value": 7.0}, "here").known
    assert make_prior("normal", {"mean": 7.0, "sd": 0.0}, "here").known
    assert float(Fixed(7.0).from_standard(jnp.asarray(2.0))) == 7.0


@pytest.mark.parametrize(
    ("name", "arguments", "says"),
    [
        ("gamma", {}, "unknown prior 'gamma'"),
        ("normal", {"mean": 1.0}, "normal takes mean, sd; given was mean"),
        ("normal", {}, "given was nothing"),
        ("normal", {"mean": 1.0, "sd": -1.0}, "sd of 0 or more"),
        ("lognormal", {"median": 1.0, "factor": 1.0}, "factor above 1"),
        ("lognormal", {"median": 0.0, "factor": 2.0}, "median other than 0"),
        ("uniform", {"low": 1.0, "high": 1.0}, "low < high"),
        ("loguniform", {"low": 0.0, "high": 1.0}, "0 < low < high"),
        ("either_sign", {"usual": 0.0}, "size above 0"),
        ("truncated_normal", {"mean": 0.0, "sd": 0.0, "low": 0.0, "high": 1.0}, "sd above 0"),
    ],
)
def test_what_makes_no_law_is_refused(name: str, arguments: dict, says: str):
    with pytest.raises(InputError, match=f"here: .*{says}"):
        make_prior(name, arguments, "here")


def test_parameters_part_into_sampled_and_known():
    listed = collect(
        [
            Parameter("k_LC", "k", "N/m", Lognormal(6e7, 2.0)),
            Parameter("p_max", "p", "Pa", Fixed(7e7)),
            parameter("kappa[free-run-1,A]", Normal(0.2, 0.01)),
        ]
    )
    assert listed.labels == ("k_LC", "kappa[free-run-1,A]")
    assert listed.index("kappa[free-run-1,A]") == 1
    assert listed.sampled[1].base == "kappa"
    values = listed.values(jnp.asarray([[0.0, 0.0], [1.0, -1.0]]))
    np.testing.assert_allclose(values["k_LC"], [6e7, 1.2e8])
    np.testing.assert_allclose(values["kappa[free-run-1,A]"], [0.2, 0.19])
    np.testing.assert_allclose(values["p_max"], [7e7, 7e7])


def test_records_see_the_values_of_their_scope():
    values = {"mu[frame]": 1.0, "mu[release]": 2.0, "k_LC": 3.0, "mu_branch[1]": 4.0}
    seen = Scoped(values, ("release", "A", "release-1,A"))
    assert seen["mu"] == 2.0
    assert "mu_branch" not in seen
    assert values.keys() <= seen.keys()


def test_a_name_that_nothing_answers_to_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="unknown name 'k_lc'; did you mean 'k_LC'"):
        require_known(["k_lc"], ["k_LC", "mu"], "spec")
