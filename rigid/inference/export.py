"""Draws as the files that programs read: the groups of posterior.nc, rows of the tables."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from rigid.inference.derived import ChannelDraws
from rigid.inference.friction_curve import FREQUENCIES, Friction
from rigid.inference.pointwise import Blocks
from rigid.inference.summary import ParameterRow
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.problem import Problem
from rigid.physics.sensors import UNITS

DIMENSIONS = {
    "kappa": ("record", "cylinder"),
    "kappa_tank": ("record", "cylinder", "stretch"),
    "preload": ("record", "cylinder"),
    "release_time": ("record", "cylinder"),
    "release_lead": ("record", "cylinder"),
    "noise": ("quantity", "cylinder"),
    "gain": ("quantity", "cylinder"),
    "zero": ("quantity", "cylinder"),
    "mu_branch": ("branch",),
    "tau_branch": ("branch",),
}
"""What the places in a label's brackets are: `kappa[free-run-2,A]` is record, cylinder."""


class About(NamedTuple):
    """What a flat label stands for: `mu_branch[1][frame]` is mu_branch at the places 1, frame."""

    name: str
    places: tuple[str, ...]
    unit: str
    symbol: str


def dataset(
    values: Mapping[str, np.ndarray], about: Mapping[str, About], coords: Mapping
) -> xr.Dataset:
    """Gather flat labels into variables with dimensions.

    - `values`: (chain, draw) by label. - `about`: what each label is.
    - `coords`: of chain and draw. Places that do not exist hold NaN.
    """
    gathered: dict[str, dict[tuple[str, ...], str]] = {}
    for label in values:
        gathered.setdefault(about[label].name, {})[about[label].places] = label
    variables, used = {}, {}
    for name, members in gathered.items():
        width = max(len(p) for p in members)
        dims = (*DIMENSIONS.get(name, ()), "view", "view_2")[:width]
        padded = {p + ("1",) * (width - len(p)): label for p, label in members.items()}
        axes = [sorted({p[k] for p in padded}) for k in range(width)]
        first = values[next(iter(members.values()))]
        block = np.full((*first.shape, *(len(a) for a in axes)), np.nan)
        for places, label in padded.items():
            at = tuple(axes[k].index(places[k]) for k in range(width))
            block[(slice(None), slice(None), *at)] = values[label]
        _, _, unit, symbol = about[next(iter(members.values()))]
        own = {
            f"{d}" if d not in used or used[d] == a else f"{name}_{d}": a
            for d, a in zip(dims, axes, strict=True)
        }
        used |= own
        variables[name] = (("chain", "draw", *own), block, {"units": unit, "long_name": symbol})
    return xr.Dataset(variables, coords={**coords, **used})


def with_friction(
    body: xr.Dataset, frictions: Mapping[str, Friction], shape: tuple[int, int]
) -> xr.Dataset:
    """Add mu_omega and k_omega over frequency (and over the view, where friction varies).

    Without any view, as of a machine that is not the rig, there is nothing to add.
    """
    if not frictions:
        return body
    views = list(frictions)
    frequency = xr.Variable("frequency", FREQUENCIES, {"units": "Hz"})
    dims = ("chain", "draw", "frequency")
    coords: dict = {"frequency": frequency}
    if views != [""]:
        dims = ("chain", "draw", "friction_view", "frequency")
        coords["friction_view"] = views
    parts = {}
    for name, field, unit in (
        ("mu_omega", "dissipative", "N s/m"),
        ("k_omega", "storage", "N/m"),
    ):
        block = np.stack([getattr(f, field).reshape(*shape, -1) for f in frictions.values()], 2)
        parts[name] = (dims, block if views != [""] else block[:, :, 0], {"units": unit})
    return body.assign_coords(coords).assign(parts)


def about(parameters: Parameters) -> dict[str, About]:
    """What every parameter is, by label."""
    listed = (*parameters.sampled, *parameters.known)
    return {p.label: About(p.base, p.places, p.unit, p.symbol) for p in listed}


def about_sensors(problem: Problem) -> dict[str, dict[str, About]]:
    """Gain and zero of every sensor, by its label and by theirs."""
    out = {}
    for piece in problem.pieces:
        for i, cylinder in enumerate(piece.cylinders):
            places = (piece.quantity, cylinder)
            units = {"gain": "1", "zero": UNITS[piece.quantity]}
            out[piece.sensor(i)] = {
                f"{name}[{piece.sensor(i)}]": About(name, places, unit, name)
                for name, unit in units.items()
            }
    return out


def series_groups(channels: Sequence[ChannelDraws], replicates: str) -> dict[str, xr.Dataset]:
    """Group `observed_data`, and the replicated data as the group named `replicates`.

    Every channel is a variable `quantity[record,cylinder]` over a time of its own.
    """
    seen, made = {}, {}
    times = {}
    for c in channels:
        place = f"{c.record},{c.cylinder}"
        time = f"time[{place}]"
        times[time] = xr.Variable(time, c.time, {"units": "s"})
        name, unit = f"{c.quantity}[{place}]", {"units": UNITS[c.quantity]}
        seen[name] = (time, c.data, unit)
        made[name] = (("chain", "draw", time), c.replicates[None], unit)
    return {
        "observed_data": xr.Dataset(seen, coords=times),
        replicates: xr.Dataset(made, coords=times),
    }


def log_likelihood(
    problem: Problem, tracks: Mapping[str, np.ndarray], blocks: Blocks, shape: tuple[int, int]
) -> xr.Dataset:
    """Group `log_likelihood`: a value a record, both cylinders together, and one a block.

    - `tracks`: (n,) by "record,cylinder". - `shape`: chains and draws.
    """
    records: dict[str, list[np.ndarray]] = {}
    for label, values in tracks.items():
        records.setdefault(problem.track(label).name, []).append(values)
    names = list(records)
    block = np.stack([np.sum(v, axis=0).reshape(shape) for v in records.values()], axis=2)
    parts = blocks.values.astype(np.float32).reshape(*shape, -1)
    begins = [stretch.begins for stretch in blocks.stretches]
    return xr.Dataset(
        {
            "record_log_likelihood": (("chain", "draw", "record"), block, {"units": "1"}),
            "block_log_likelihood": (("chain", "draw", "block"), parts, {"units": "1"}),
        },
        coords={
            "record": names,
            "block": np.arange(len(begins)),
            "block_channel": ("block", [stretch.channel for stretch in blocks.stretches]),
            "block_quantity": ("block", [stretch.quantity for stretch in blocks.stretches]),
            "block_begins": ("block", begins, {"units": "s"}),
        },
    )


def diagnostics(rows: Sequence[ParameterRow]) -> dict[str, xr.Variable]:
    """R-hat between ensembles and effective sizes of every quantity of the tables, by name."""
    return {
        name: xr.Variable(
            "parameter",
            [np.nan if value is None else value for value in values],
            {"units": "1", "long_name": said},
        )
        for name, said, values in (
            ("r_hat", "R-hat between ensembles", [row.summary.r_hat for row in rows]),
            ("ess_bulk", "bulk effective sample size", [row.summary.ess_bulk for row in rows]),
            ("ess_tail", "tail effective sample size", [row.summary.ess_tail for row in rows]),
        )
    }
