"""The greatest load of a test under every draw of a law, and what the draws leave open of it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.io.cache import NOTHING_KEPT
from rigid.smoothing.budget import FIGURES, Tally, bodies
from rigid.smoothing.paths import Going, batch_of, moved_at, stretches
from rigid.smoothing.run import Way, windows_of
from rigid.smoothing.smoother import Keeping

PEAK = list(FIGURES).index("peak load")
PEAK_UNIT = FIGURES["peak load"]


class Peaks(NamedTuple):
    """Peak loads of one place [N], (draws,) each.

    - `mean`: of the load as smoothed. - `drawn`: with one draw of what the sensors' noise and the
      load's own movement leave open.
    """

    mean: Float[np.ndarray, " draws"]
    drawn: Float[np.ndarray, " draws"]


def peaks(way: Way, seed: int, report: Callable[[int], None] = lambda _: None) -> dict[str, Peaks]:
    """Return the greatest loads under all draws of a law, by place; "total" of two cylinders.

    - `report(1)`: after each block of a record.
    """
    test, law = way
    rng, at, jumped = np.random.default_rng([seed, 6]), windows_of(test), moved_at(test)
    keeping, wide = Keeping(NOTHING_KEPT, report), batch_of(law)
    found: dict[str, list[np.ndarray]] = {}
    for first in range(0, law.size, wide):
        some = law.only(np.arange(first, min(first + wide, law.size)))
        seeds = [int(rng.integers(2**31)) for _ in test.fields]
        going, tallies = Going(test, some, seeds, wide, keeping), dict[str, tuple[Tally, Tally]]()
        for where in stretches(test):
            paths = going.stretch()
            if where.stop == where.start:
                continue
            for one in bodies(paths):
                load, place = paths[one.load], paths[one.displacement]
                both = tallies.setdefault(one.place, (Tally(at[one.place]), Tally(at[one.place])))
                open_ = load.own + load.noise, place.own + place.noise
                inside, time = jumped[one.place].within(where), test.time[where]
                both[0].add(time, load.mean, place.mean, inside, where.start)
                moved = load.mean + open_[0], place.mean + open_[1]
                both[1].add(time, *moved, inside, where.start)
        for name, both in tallies.items():
            here = np.stack([one.figures()[:, PEAK] for one in both])
            found.setdefault(name, []).append(here)
    return {name: Peaks(*np.concatenate(parts, axis=1)) for name, parts in found.items()}
