"""Field tests of one cylinder under many kinds of ice load, with their truth.

The campaign's own field record has drops of 30 to 80 ms. Here are drops from 1 ms (a brittle
failure, faster than any sample) to 150 ms, of a tenth of the load to all of it, rises that are not
straight, and a valve that may be shut for a while: what a study of bands draws from. Also the
sudden loss of contact area of Fig. 12.
"""

from dataclasses import dataclass, replace

import numpy as np

from rigid.generator.constants import SLOW_RATE
from rigid.generator.core import Piece, Rig, Run, Switch
from rigid.generator.friction import Friction
from rigid.generator.pieces import pieces_of
from rigid.generator.plant import Plant, readings, trajectory
from rigid.generator.schedule import FIELD_FRACTIONS
from rigid.generator.sensors import Sensor

FINE = 4  # instants of the truth in one sampling interval
STRENGTH = 1e6  # Pa, sigma_c of Fig. 12
CONTACT_AREA = 0.1575  # m^2, S_Ice,0 of Fig. 12
LASTING = (1e-3, 0.15)  # s, of a drop
CYCLE = 90.0  # s, from one press of a long record to the next
BEFORE, PRESSING = 8.0, 20.0  # s of rest before a press, and of the press
BACK, RETURNING = 35.0, 20.0  # s from a press's beginning until the way back, and that
PEAKS = (30e3, 120e3)  # N, of the presses of a long record
PUSHED_BACK = 18e3  # N on the plate on the way back: more than friction, so that no oil is sucked


@dataclass(frozen=True)
class Drop:
    """The load falls by `part` of itself from `begin` to `end` [s]."""

    begin: float
    end: float
    part: float


@dataclass(frozen=True)
class FieldTest:
    """One field test and its truth.

    - run: as it was; drops: those of its load
    - readings: channel -> (samples,) SI, whole converter steps; sample times from 0 on at 100 Hz
    - time [s], load [N], displacement [m]: the truth, FINE times as often
    """

    run: Run
    drops: tuple[Drop, ...]
    readings: dict[str, np.ndarray]
    time: np.ndarray
    load: np.ndarray
    displacement: np.ndarray


def field_test(
    rig: Rig,
    friction: Friction,
    sensors: dict[str, Sensor],
    rng: np.random.Generator,
    duration: float = 10.0,
    hidden: tuple[Piece, ...] = (),
) -> FieldTest:
    """Draw a load and a valve, run the test and record it with `sensors` (by channel)."""
    knots, drops = _load(rng, duration)
    valve = (Switch(duration, "open"),)
    if rng.uniform() < 0.4:
        shut = rng.uniform(0.2, 0.7) * duration
        again = shut + rng.uniform(0.5, 1.5)
        valve = (Switch(round(shut, 3), "open"), Switch(round(again, 3), "shut"), *valve)
    kappa = float(rng.choice(list(FIELD_FRACTIONS.values())) * np.exp(0.1 * rng.standard_normal()))
    run = Run("field", "field", "A", duration, valve, kappa=kappa, ice=knots)
    return record(rig, friction, sensors, run, (drops, rng), hidden)


def press_by_press(
    rig: Rig,
    friction: Friction,
    sensors: dict[str, Sensor],
    rng: np.random.Generator,
    presses: int,
) -> FieldTest:
    """Draw a long record: press after press, CYCLE s apart, each a load as in `field_test`.

    The ice fails at the end of each press; the valve is shut, the plunger pushed back with the
    valve to the tank at the flow with which it came, and the valve shut until the next. Cylinders
    drawn with generators of their own press at the same times.
    """
    kappa = float(rng.choice(list(FIELD_FRACTIONS.values())) * np.exp(0.1 * rng.standard_normal()))
    times, loads, valve, drops = [0.0], [0.0], [], []
    for number in range(presses):
        begin = CYCLE * number + BEFORE
        (knots, heights), fell = _load(rng, PRESSING)
        factor = rng.uniform(*PEAKS) / max(heights)
        back = begin + BACK
        times += [begin + t for t in knots]
        times += [back - 2.0, back - 1.0, back + RETURNING + 1.0, back + RETURNING + 2.0]
        loads += [*(factor * h for h in heights), 0.0, PUSHED_BACK, PUSHED_BACK, 0.0]
        drops += [replace(d, begin=begin + d.begin, end=begin + d.end) for d in fell]
        valve += [Switch(begin, "shut"), Switch(begin + PRESSING, "open"), Switch(back, "shut")]
        valve += [Switch(back + RETURNING, "tank")]
    duration = CYCLE * presses
    valve.append(Switch(duration, "shut"))
    ice = (*times, duration), (*loads, 0.0)
    run = Run("field", "field", "A", duration, tuple(valve), kappa, -kappa, ice=ice)
    return record(rig, friction, sensors, run, (tuple(drops), rng))


def contact_loss(
    rig: Rig,
    friction: Friction,
    sensors: dict[str, Sensor],
    rng: np.random.Generator,
    drop: Drop,
    duration: float = 4.0,
) -> FieldTest:
    """Fig. 12: half of sigma_c S_Ice,0 on one cylinder, of which `drop.part` is lost for good.

    The formula of the area is missing in the text at hand, so instant and length of the drop are
    parameters here; the load rises over the first second. kappa is 1, as there.
    """
    full = 0.5 * STRENGTH * CONTACT_AREA
    left = full * (1.0 - drop.part)
    times, loads = (0.0, 0.2, 1.2, drop.begin, drop.end, duration), (0, 0, full, full, left, left)
    valve = (Switch(duration, "open"),)
    ice = times, tuple(float(load) for load in loads)
    run = Run("contact-loss", "field", "A", duration, valve, kappa=1.0, ice=ice)
    return record(rig, friction, sensors, run, ((drop,), rng))


def record(
    rig: Rig,
    friction: Friction,
    sensors: dict[str, Sensor],
    run: Run,
    told: tuple[tuple[Drop, ...], np.random.Generator],
    hidden: tuple[Piece, ...] = (),
) -> FieldTest:
    """Run a field test; `told`: its drops, and the random numbers of the sensors' noise."""
    drops, rng = told
    acting = tuple(one for piece in hidden for one in piece.within(rig, run))
    plant = Plant(rig, (friction, *pieces_of(run, rig), *acting))
    time = np.arange(round(run.duration * SLOW_RATE) * FINE + 1) / (SLOW_RATE * FINE)
    motion = trajectory(plant, plant.balanced() if acting else plant.at_rest(), time)
    ideal = readings(plant, motion, time)
    read = {}
    for channel in ("load", "stroke", "pressure"):
        values, sensor = ideal[channel][::FINE], sensors[channel]
        read[channel] = sensor.step * sensor.codes(values, rng.standard_normal(values.size))
    return FieldTest(run, drops, read, time, run.ice_load(time), motion.states[2])


def _load(
    rng: np.random.Generator, duration: float
) -> tuple[tuple[tuple[float, ...], tuple[float, ...]], tuple[Drop, ...]]:
    """Knots of a load that rises unevenly, falls in drops, and fails at last."""
    count = int(rng.integers(2, 6))
    inner = 1.0 + np.sort(rng.uniform(0.0, duration - 2.5, count))
    begins = np.append(inner[np.diff(inner, append=np.inf) > 0.35], duration - 1.0)
    steep = rng.uniform(4e3, 20e3)  # N/s
    times, loads, drops = [0.0, 0.4], [0.0, 0.0], []
    for number, begin in enumerate(begins):
        while begin - times[-1] > 0.15:
            step = min(rng.uniform(0.1, 0.6), begin - times[-1])
            slope = steep * np.exp(0.6 * rng.standard_normal())
            times.append(times[-1] + step)
            loads.append(loads[-1] + slope * step)
        last = number == len(begins) - 1
        part = 1.0 if last or rng.uniform() < 0.1 else rng.uniform(0.1, 0.8)
        end = times[-1] + np.exp(rng.uniform(*np.log(LASTING)))
        drops.append(Drop(times[-1], end, part))
        times.append(end)
        loads.append(loads[-1] * (1.0 - part))
    times.append(duration)
    loads.append(loads[-1] if drops[-1].part == 1.0 else loads[-1] + 1e3)
    return (tuple(map(float, times)), tuple(map(float, loads))), tuple(drops)
