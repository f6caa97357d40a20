"""Records of several kinds in one program: cut to one shape, with the readings of each alone."""

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, drive, effects, track
from test_compilations import compilations

from rigid.likelihood.grouping import Grouping
from rigid.likelihood.groups import SlowGroup, predictions
from rigid.localfit.families import Family, read

TANK = (1.0, 2.0, 2.6), (1, 0, 2, 0)
OPEN = (1.5,), (1, 0)
RECORDS = (
    ("frame-1,A", "frame", 350, TANK),
    ("run-1,A", "free-run", 260, OPEN),
    ("run-1,B", "free-run", 260, OPEN),
    ("run-2,A", "free-run", 300, OPEN),
)
UNSEEN = {"load": 0.25 * 33.0, "stroke": 2.5e-6, "pressure": 0.25 * 6895.0}
"""A twentieth of the converters' steps at most, SI: readings that differ by less are the same."""


def tracks() -> tuple:
    return tuple(
        track(label, kind, samples, drive=drive(samples, *valve))
        for label, kind, samples, valve in RECORDS
    )


def values(walkers: int = 2) -> dict:
    flows = {f"kappa[{label}]": 0.2 + 0.05 * i for i, (label, *_) in enumerate(RECORDS)}
    given = NOMINAL | flows | {"kappa_tank[frame-1,A]": -0.3}
    spread = np.linspace(1.0, 1.1, walkers)
    return {
        k: jnp.asarray(v * spread if k == "k_LC" else v + 0.0 * spread) for k, v in given.items()
    }


def grouped(names=BASE) -> tuple[SlowGroup, ...]:
    return Grouping(effects(names), {})(tracks())


def test_kinds_are_cut_to_one_shape_and_keep_their_order():
    groups = grouped()
    shapes = {(g.grid.drives.switches.shape, g.grid.drives.size) for g in groups}
    assert len(shapes) == 1
    assert sorted(t.label for g in groups for t in g.tracks) == sorted(r[0] for r in RECORDS)


@pytest.mark.slow
def test_kinds_share_a_program_and_without_the_cut_they_do_not():
    own = tuple(SlowGroup((t,), effects(BASE)) for t in tracks()[:2])
    for groups, programs in ((grouped(), 1), (own, 2)):
        family = Family((), groups, {})
        with compilations() as found:
            read(family, {k: np.asarray(v) for k, v in values().items()})
        assert found["jit(_read)"] == programs


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [
        pytest.param(BASE, id="steady"),
        pytest.param((*BASE, "coulomb-friction"), id="dry"),
    ],
)
def test_taking_turns_changes_no_reading(names):
    """Interpolation nodes follow the strokes of a turn: readings move, by less than is seen."""
    given = values() | {"F_C": jnp.full(2, 300.0), "presliding": jnp.full(2, 2e-5)}
    groups = grouped(names)
    each = predictions(groups, [given] * len(groups))
    for group, found in zip(groups, each, strict=True):
        for place, one in enumerate(group.tracks):
            alone = SlowGroup((one.on_grid(one.drive.size),), effects(names)).predict(given)
            for quantity, series in alone.items():
                n = int(one.samples)
                off = np.abs(found[quantity][:n, place] - series[:n, 0])
                assert off.max() < UNSEEN[quantity], (one.label, quantity, off.max())
