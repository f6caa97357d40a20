"""The paper's claims on Figs. 10-12 for the simulated rig of the reference campaign, in numbers.

    python tests/studies/claims.py --out docs/studies/bands

How far is the force in the load cell from the load on the ice, how far the stroke from the plate's
displacement, and what does a sudden loss of contact do? Perfect sensors, no inference: what the
rig itself does to the measurement. The generator alone is used.
"""

import argparse
import dataclasses
import datetime
import sys
from pathlib import Path

import numpy as np
from rows import commit

from rigid.generator.constants import SLOW_RATE
from rigid.generator.core import Run, Switch
from rigid.generator.draw import Truth, draw
from rigid.generator.field import CONTACT_AREA, STRENGTH
from rigid.generator.friction import Friction
from rigid.generator.plant import trajectory
from rigid.generator.simulate import plant_of

SEED = 2018  # of the reference campaign
RATE = 1000
STEP = 295.0  # N, of the load cell's converter
AWAY = 0.1
BEGIN = 1.0


def motion_of(truth: Truth, run: Run) -> tuple[np.ndarray, ...]:
    """Time, ice load, load-cell force, plate displacement, stroke; 1 kHz."""
    plant = plant_of(truth, run)
    time = np.arange(round(run.duration * RATE) + 1) / RATE
    states = trajectory(plant, plant.at_rest(), time).states
    cell = -truth.rig.k_LC * states[0]
    return time, run.ice_load(time), cell, states[2], states[2] - states[0]


def field_lines(truth: Truth) -> list[str]:
    lines = ["| cylinder | mean deviation over the rises | greatest, away from drops and valve | "
             "greatest, as the valve moves | greatest, at drops | stroke less plate, greatest |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for run in (r for r in truth.runs if r.kind == "field"):
        time, ice, cell, plate, stroke = motion_of(truth, run)
        assert run.ice is not None  # a field record has it
        knots = np.array(run.ice[0])
        steep = np.abs(np.diff(run.ice[1]) / np.diff(knots)) > 5e4
        near = np.zeros(time.size, dtype=bool)
        for first, last in zip(knots[:-1][steep], knots[1:][steep], strict=True):
            near |= (time > first - AWAY / 10) & (time < last + 5 * AWAY)
        turned = np.zeros(time.size, dtype=bool)
        for switch in run.valve[:-1]:
            turned |= (time > switch.until - AWAY / 10) & (time < switch.until + 5 * AWAY)
        rise = ~near & ~turned & (ice > 5e3)
        off = cell - ice
        share = np.abs(off[rise]) / ice[rise]
        moved = f"{np.abs(off[turned]).max():.0f} N" if turned.any() else "does not move"
        lines.append(
            f"| {run.cylinder} | {100 * np.mean(off[rise]) / np.mean(ice[rise]):.1e} % | "
            f"{100 * share.max():.2g} % | {moved} | {np.abs(off[near]).max() / 1e3:.2f} kN | "
            f"{1e3 * np.max(np.abs(stroke - plate)):.2f} mm |"
        )
    return lines


def quantised(run: Run) -> Run:
    """The run under its load as a converter with steps of STEP gives it at 100 Hz."""
    times = np.arange(round(run.duration * SLOW_RATE) + 1) / SLOW_RATE
    loads = STEP * np.rint(run.ice_load(times) / STEP)
    return dataclasses.replace(run, ice=(tuple(times.tolist()), tuple(loads.tolist())))


def quantised_lines(truth: Truth) -> list[str]:
    lines = [
        "| cylinder | mean deviation | 95 % of the time within | greatest |",
        "|---|---|---|---|",
    ]
    for run in (r for r in truth.runs if r.kind == "field"):
        time, ice, cell, _, _ = motion_of(truth, quantised(run))
        # Where the load has not fallen by more than rounding for half a second, nor is about to.
        fallen = np.gradient(run.ice_load(time), time) < -1e3
        near = np.convolve(fallen, np.ones(RATE), "same") > 0
        rise = (run.ice_load(time) > 5e3) & ~near
        share = 100 * (cell - ice)[rise] / ice[rise]
        lines.append(
            f"| {run.cylinder} | {share.mean():.1e} % | {np.quantile(np.abs(share), 0.95):.2f} % | "
            f"{np.abs(share).max():.2f} % |"
        )
    return lines


def drop_lines(truth: Truth) -> list[str]:
    lines = ["| friction | alpha | lasting | ice after | least in the load cell | greatest "
             "deviation | plate moves in 50 ms | without the drop |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    laws = {
        "with memory": truth,
        "constant 1e5 N s/m": dataclasses.replace(
            truth, friction=Friction(1e5, 1e-3, 0.2, 1e-3, 8e-3)
        ),
    }
    full = 0.5 * STRENGTH * CONTACT_AREA
    for name, rig in laws.items():
        for alpha in (0.2, 0.4, 0.6):
            for lasting in (0.0001, 0.001, 0.01, 0.05):
                left = full * (1.0 - alpha)
                times = (0.0, 0.1, 0.6, BEGIN, BEGIN + lasting, BEGIN + 0.3)
                ice = times, (0.0, 0.0, full, full, left, left)
                run = Run("drop", "field", "A", times[-1], (Switch(times[-1], "open"),),
                          kappa=1.0, ice=ice)  # fmt: skip
                time, load, cell, plate, _ = motion_of(rig, run)
                after = time > BEGIN
                at = [round((BEGIN + t) * RATE) for t in (-0.05, 0.0, 0.05)]
                off = np.abs(cell - load)[after].max()
                lines.append(
                    f"| {name} | {alpha} | {1e3 * lasting:g} ms | {left / 1e3:.1f} kN | "
                    f"{cell[after].min() / 1e3:.1f} kN | {off / 1e3:.1f} kN | "
                    f"{1e3 * (plate[at[2]] - plate[at[1]]):.2f} mm | "
                    f"{1e3 * (plate[at[1]] - plate[at[0]]):.2f} mm |"
                )
                sys.stderr.write(lines[-1] + "\n")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("docs/studies/bands"))
    args = parser.parse_args()
    truth = draw(SEED)
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    head = f"Simulated; `python tests/studies/claims.py`, commit {commit()}, {today}"
    text = [head, "", *field_lines(truth), ""]
    text += ["The same with the load of a converter (steps of 295 N, 100 Hz) as the ice load:", ""]
    text += [*quantised_lines(truth), ""]
    text += drop_lines(truth)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "claims.md").write_text("\n".join(text) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
