"""The file of draws: what goes in comes out, and what is refused."""

import os
import resource
import warnings

import numpy as np
import pytest
import xarray as xr

from rigid.inference.posterior import chain_coords, load_posterior, save_posterior, stack, unstack
from rigid.io.errors import EnvironmentFaultError, InputError

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # ArviZ 0.23 announces its successor
    import arviz as az

ENSEMBLES, STEPS, WALKERS = 2, 5, 3


def groups():
    rng = np.random.default_rng(0)
    draws = rng.normal(size=(ENSEMBLES, STEPS, WALKERS))
    spectra = rng.normal(size=(ENSEMBLES, STEPS, WALKERS, 4))
    posterior = xr.Dataset(
        {
            "k_LC": (("chain", "draw"), stack(draws), {"units": "N/m"}),
            "mu_omega": (("chain", "draw", "frequency"), stack(spectra), {"units": "N s/m"}),
            "kappa": (
                ("chain", "draw", "record"),
                stack(spectra)[..., :2],
                {"units": "1"},
            ),
        },
        coords={
            **chain_coords(ENSEMBLES, WALKERS, STEPS),
            "frequency": ("frequency", [0.5, 1.0, 2.0, 4.0], {"units": "Hz"}),
            "record": ["frame-1", "free-run-2"],
        },
    )
    observed = xr.Dataset({"load": ("time", np.arange(3.0), {"units": "N"})})
    return draws, {"posterior": posterior, "observed_data": observed}


@pytest.fixture
def saved(tmp_path):
    draws, parts = groups()
    path = tmp_path / "out" / "posterior.nc"
    save_posterior(path, parts, {"seed": 1, "spec": "title = 'a'\n", "modes": [0.8, 0.2]})
    return path, draws, parts


def test_layout_of_chains():
    values = np.arange(ENSEMBLES * STEPS * WALKERS * 2).reshape(ENSEMBLES, STEPS, WALKERS, 2)
    chains = stack(values)
    coords = chain_coords(ENSEMBLES, WALKERS, STEPS)
    for chain, ensemble, walker in zip(
        coords["chain"], coords["ensemble"][1], coords["walker"][1], strict=True
    ):
        np.testing.assert_array_equal(chains[chain], values[ensemble, :, walker])
    np.testing.assert_array_equal(unstack(chains, ENSEMBLES), values)


def test_what_goes_in_comes_out(saved):
    path, _, parts = saved
    tree = load_posterior(path)
    assert set(tree.children) == {"posterior", "observed_data"}
    for name, dataset in parts.items():
        xr.testing.assert_identical(tree[name].to_dataset(), dataset)
    assert tree.attrs["seed"] == 1
    assert tree.attrs["spec"] == "title = 'a'\n"
    np.testing.assert_array_equal(tree.attrs["modes"], [0.8, 0.2])
    path.unlink()  # nothing is read later, nothing kept open
    assert tree["posterior"]["k_LC"].attrs["units"] == "N/m"
    assert float(tree["posterior"]["k_LC"].sum()) == float(parts["posterior"]["k_LC"].sum())


def test_arviz_reads_it(saved):
    path, draws, _ = saved
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        data = az.from_netcdf(path)
    values = data["posterior"]["k_LC"]
    assert values.dims == ("chain", "draw")
    assert values.attrs["units"] == "N/m"
    np.testing.assert_array_equal(values.values, stack(draws))
    np.testing.assert_array_equal(values["ensemble"].values, [0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(data["observed_data"]["load"].values, [0.0, 1.0, 2.0])


def test_nothing_half_written_is_left(saved):
    """HDF5 writing to such a disk itself would end the process."""
    path, _, parts = saved
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) // 2, limits[1]))
    try:
        with pytest.raises(EnvironmentFaultError, match="File too large"):
            save_posterior(path, parts, {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


@pytest.mark.parametrize("units", [None, "", 3, "seconds", "days since 2026-01-01"])
def test_a_variable_without_a_unit_is_refused(tmp_path, units):
    attrs = {} if units is None else {"units": units}
    dataset = xr.Dataset({"mu": ("draw", np.zeros(3), attrs)})
    with pytest.raises(ValueError, match="posterior/mu"):
        save_posterior(tmp_path / "a.nc", {"posterior": dataset}, {})
    assert os.listdir(tmp_path) == []


def test_a_coordinate_in_real_numbers_needs_one_too(tmp_path):
    dataset = xr.Dataset({"mu": ("f", np.zeros(2), {"units": "1"})}, coords={"f": [0.5, 1.0]})
    with pytest.raises(ValueError, match="posterior/f"):
        save_posterior(tmp_path / "a.nc", {"posterior": dataset}, {})


def test_what_is_no_posterior_is_refused_in_a_sentence(saved, tmp_path):
    path, _, _ = saved
    whole = path.read_bytes()
    with pytest.raises(InputError, match="no such file"):
        load_posterior(tmp_path / "missing.nc")
    for content in (b"", b"text", whole[: len(whole) // 2], whole[:2000] + b"\0" * 2000):
        path.write_bytes(content)
        with pytest.raises(InputError, match="damaged"):
            load_posterior(path)
    save_posterior(path, {"prior": xr.Dataset({"mu": ("draw", np.zeros(3), {"units": "1"})})}, {})
    with pytest.raises(InputError, match="holds prior, but no posterior"):
        load_posterior(path)
