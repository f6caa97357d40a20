"""Draws with their provenance on disk: ArviZ groups in one netCDF file, written all at once."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rigid.io.errors import InputError
from rigid.io.files import replacing
from rigid.io.hdf5 import require_own

ENGINE = "h5netcdf"
OVERHEAD = 65536
"""Bytes of a file, and of each variable in it, beside the numbers: more than netCDF takes."""
# xarray turns variables in these units, and those "since" a date, into dates when it reads them.
TIME_WORDS = frozenset(
    ("days", "hours", "minutes", "seconds", "milliseconds", "microseconds", "nanoseconds")
)


def save_posterior(
    path: Path | str, groups: Mapping[str, xr.Dataset], attrs: Mapping[str, Any]
) -> None:
    """Write the groups to `path`.

    - groups: ArviZ groups by name: posterior, prior, posterior_predictive, log_likelihood, ...
      Every variable has an attribute `units` ("1" where there is none), and so has every
      coordinate that counts in real numbers
    - attrs: provenance: strings, numbers or flat lists of them

    Raises ValueError for a variable without a unit, EnvironmentFaultError when the disk does not
    take the file.
    """
    tree = data_tree(groups, attrs)
    room = sum(one.nbytes + len(one.variables) * OVERHEAD for one in groups.values()) + OVERHEAD
    with replacing(path) as temporary:
        # On a full disk HDF5 ends the process, and from memory its files end it when Python cleans
        # up. So the room that the file takes is taken first, by a write that fails in a sentence.
        temporary.write_bytes(bytes(room))
        tree.to_netcdf(temporary, mode="w", engine=ENGINE)
    tree.close()


def data_tree(groups: Mapping[str, xr.Dataset], attrs: Mapping[str, Any]) -> xr.DataTree:
    """The groups as one tree, as `load_posterior` reads it back.

    Raises ValueError for a variable without a unit.
    """
    for name, dataset in groups.items():
        _check_units(name, dataset)
    tree = xr.DataTree.from_dict({f"/{name}": dataset for name, dataset in groups.items()})
    tree.attrs = dict(attrs)
    return tree


def load_posterior(path: Path | str) -> xr.DataTree:
    """Read what `save_posterior` wrote, all of it into memory; the file is not kept open.

    Raises InputError when the file is missing, damaged or holds no posterior.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; run `python -m rigid.fit` on the spec first")
    try:
        require_own(path)
        with xr.open_datatree(path, engine=ENGINE, decode_timedelta=False) as tree:
            loaded = tree.load().copy(deep=True)
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError(
            f"{path}: not a posterior file, or damaged; run `python -m rigid.fit` again"
        ) from error
    if "posterior" not in loaded.children:
        found = ", ".join(loaded.children) or "no group at all"
        raise InputError(f"{path}: holds {found}, but no posterior; it is not made by rigid.fit")
    return loaded


def stack(values: NDArray[Any]) -> NDArray[Any]:
    """Turn (ensembles, steps, walkers, ...) into (chain, draw, ...), a chain for each walker."""
    turned = np.swapaxes(values, 1, 2)
    return turned.reshape(-1, *turned.shape[2:])


def unstack(values: NDArray[Any], ensembles: int) -> NDArray[Any]:
    """Turn (chain, draw, ...) back into (ensembles, steps, walkers, ...)."""
    return np.swapaxes(values.reshape(ensembles, -1, *values.shape[1:]), 1, 2)


def by_ensemble(draws: xr.Dataset) -> xr.Dataset:
    """Lay draws out with a chain for each ensemble, step by step, its walkers side by side.

    - `draws`: a group whose `chain` is a walker, as in posterior.nc.

    R-hat of these chains is that between ensembles. ESS of them is far too high, since the walkers
    of a step look independent: take it of the walkers.
    """
    ensembles = len(np.unique(draws["ensemble"].values))
    variables = {}
    for name, values in draws.data_vars.items():
        if values.dims[:2] == ("chain", "draw"):
            steps = unstack(values.values, ensembles)
            flat = steps.reshape(ensembles, -1, *steps.shape[3:])
            variables[name] = (values.dims, flat, values.attrs)
    dropped = {name for name, value in draws.coords.items() if {"chain", "draw"} & set(value.dims)}
    return xr.Dataset(variables, coords=draws.drop_vars(dropped).coords, attrs=draws.attrs)


def chain_coords(ensembles: int, walkers: int, draws: int) -> dict[str, Any]:
    """Coordinates `chain` and `draw`, and along the chain `ensemble` and `walker`."""
    chains = np.arange(ensembles * walkers)
    return {
        "chain": chains,
        "draw": np.arange(draws),
        "ensemble": ("chain", chains // walkers),
        "walker": ("chain", chains % walkers),
    }


def _check_units(group: str, dataset: xr.Dataset) -> None:
    real = [name for name, value in dataset.coords.items() if value.dtype.kind in "fc"]
    for name in [*dataset.data_vars, *real]:
        units = dataset[name].attrs.get("units")
        if not isinstance(units, str) or not units:
            raise ValueError(f"{group}/{name}: has no attribute 'units'; say '1' if it has none")
        if units in TIME_WORDS or " since " in units:
            raise ValueError(f"{group}/{name}: units {units!r} would be read as a date; say 's'")
