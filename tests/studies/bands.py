"""Do the bands of ice load and displacement cover the truth as often as they say?

    python tests/studies/bands.py --posterior reports/calibration/posterior.nc --tests 200

Simulates field tests with seeds of their own (from FIRST_SEED on; all development used others),
with drops of many sizes and speeds, each with a rig and sensors that are one draw of the posterior;
makes bands from other draws, and asks whether the 50 % and 90 % bands hold the true load and
displacement: anywhere in the test, and within 50 ms of a drop. The unit is the test, in two ways:
one instant of each test drawn at random, which makes a binomial count; and the share of its time
that is covered, averaged over tests. Resumable: a test in the file of rows is not run again.

`--law wrong` makes the bands under a constant friction, as in free running. `--law averaged` draws
the law of the truth, each of the two with probability 1/2, and makes the bands under both with
these probabilities.
"""

import argparse
import csv
import dataclasses
import datetime
import sys
import time
from pathlib import Path

import numpy as np
from rows import commit

FIRST_SEED = 800_000
NEAR = 0.05  # s from a drop
DURATION = 5.11  # s: 512 samples
NO_FRICTION = 1e-3  # N s/m, where 1e6 counts
THINNED = 3  # every so many told instants count where no drop is near
DRAWS = 128  # as the command takes
COLUMNS = ("seed", "quantity", "where", "in50", "in90", "cover50", "cover90", "rms", "width90",
           "drops", "truth", "gap", "cpu_s")  # fmt: skip


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--posterior", type=Path, required=True)
    parser.add_argument("--tests", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("docs/studies/bands"))
    parser.add_argument("--law", choices=("right", "wrong", "averaged"), default="right")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    return parser.parse_args()


def rows_of(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def plant_of(values: dict, steps: dict, cylinder: str = "A"):
    """The generator's rig, friction and sensors of a cylinder with one draw's numbers."""
    from rigid.generator.core import Rig
    from rigid.generator.friction import Friction
    from rigid.generator.sensors import Sensor

    rig = Rig(**{n: values[n] for n in Rig.__dataclass_fields__})
    friction = Friction(values["mu"], values["mu_branch[1]"], values["tau_branch[1]"],
                        values["mu_branch[2]"], values["tau_branch[2]"])  # fmt: skip
    sensors = {}
    for q, step in steps.items():
        gain, zero, noise = (values[f"{n}[{q},{cylinder}]"] for n in ("gain", "zero", "noise"))
        sensors[q] = Sensor(1.0 + gain, zero, noise, step)
    return rig, friction, sensors


def field_test_of(spec, law, cylinder: str, rng, presses: int):
    """A test of one cylinder: a long record of some presses, or one of DURATION where there are 0.

    The rig is the first draw of the law, the same for both cylinders.
    """
    from rigid.generator.field import field_test, press_by_press
    from rigid.smoothing.field import QUANTITIES

    true = {k: float(v[0]) for k, v in law.values.items()}
    plant = plant_of(true, {q: spec.sensors[q].step for q in QUANTITIES}, cylinder)
    return press_by_press(*plant, rng, presses) if presses else field_test(*plant, rng, DURATION)


def constant_friction(law):
    """The same draws with the friction of steady running at every frequency."""
    values = dict(law.values)
    total = values["mu"] + values["mu_branch[1]"] + values["mu_branch[2]"]
    nothing = {f"mu_branch[{i}]": np.full_like(total, NO_FRICTION) for i in (1, 2)}
    values |= {"mu": total, **nothing}
    return dataclasses.replace(law, name="constant friction", values=values)


def without_memory(friction):
    """The generator's friction with all of it in the dashpot."""
    total = friction.mu_inf + friction.mu_1 + friction.mu_2
    return dataclasses.replace(friction, mu_inf=total, mu_1=NO_FRICTION, mu_2=NO_FRICTION)


def field_of(test):
    """A simulated test as the smoother meets it."""
    from rigid.smoothing.field import QUANTITIES, Field, rig_setup

    reading = np.stack([test.readings[q] for q in QUANTITIES], axis=1)
    return Field("field", "A", {}, 0.0, 0.01, reading, np.ones_like(reading), rig_setup("A"))


def made_bands(spec, field, laws, rows, seed: int):
    """Bands of a record at some of its told instants, under laws with the weights they have."""
    from rigid.smoothing.run import bands, learned, ways

    found = [learned(spec, [field], law, lambda _: None) for law in laws]
    under = [way._replace(test=way.test._replace(rows=rows)) for way in ways([field], found, laws)]
    return bands(under, seed, apart=False)


def simulated(spec, whole, kind: str, seed: int):
    """A field test with its truth, the name of the law it obeys, and the laws of the bands."""
    from rigid.generator.field import field_test
    from rigid.smoothing.field import QUANTITIES

    rng = np.random.default_rng([seed, 1])
    picked = rng.choice(whole.size, DRAWS + 1, replace=False)
    true = {k: float(v[picked[0]] if v.size > 1 else v[0]) for k, v in whole.values.items()}
    rig, friction, sensors = plant_of(true, {q: spec.sensors[q].step for q in QUANTITIES})
    law = whole.only(picked[1:])
    constant = constant_friction(law)
    truth = "memory"
    if kind == "averaged" and rng.uniform() < 0.5:
        truth, friction = "constant", without_memory(friction)
    if kind == "averaged":
        laws = [dataclasses.replace(one, weight=0.5) for one in (law, constant)]
    else:
        laws = [law if kind == "right" else constant]
    return field_test(rig, friction, sensors, rng, DURATION), truth, laws, rng


def one_test(spec, whole, seed: int, kind: str) -> list[dict]:
    began = time.process_time()
    test, law, laws, rng = simulated(spec, whole, kind, seed)
    near = np.zeros(len(test.time), dtype=bool)
    for drop in test.drops:
        near |= (test.time > drop.begin - NEAR) & (test.time < drop.end + NEAR)
    even = np.arange(len(test.time)) % THINNED == 0
    rows = np.flatnonzero(near | even)
    made = made_bands(spec, field_of(test), laws, rows, seed)
    gap = float(made.test.learned[0].gap.max())
    out = []
    places = {"overall": even[rows], "near a drop": near[rows]}
    instants = {where: int(rng.choice(np.flatnonzero(mask))) for where, mask in places.items()}
    for quantity, true in (
        ("load_A", test.load[rows]),
        ("displacement_A", test.displacement[rows]),
    ):
        low, lower, middle, upper, high = made.bands[quantity].quantiles
        held = {"50": (true > lower) & (true < upper), "90": (true > low) & (true < high)}
        for where, mask in places.items():
            found = {f"in{k}": int(v[instants[where]]) for k, v in held.items()}
            found |= {f"cover{k}": f"{np.mean(v[mask]):.4f}" for k, v in held.items()}
            out.append({
                "seed": seed, "quantity": quantity, "where": where, **found,
                "rms": f"{np.sqrt(np.mean((middle - true)[mask] ** 2)):.4g}",
                "width90": f"{np.median((high - low)[mask]):.4g}",
                "drops": len(test.drops), "truth": law, "gap": f"{gap:.3f}",
                "cpu_s": f"{time.process_time() - began:.1f}",
            })  # fmt: skip
    return out


def verdict(rows: list[dict[str, str]]) -> str:
    """Table of coverage with tests as the unit; what lies outside its binomial band stands bold."""
    from scipy.stats import binom

    lines = ["| quantity | where | tests | in the 50 % band | band | in the 90 % band | band | "
             "time in the 50 % band | time in the 90 % band | rms error | width of the 90 % band |",
             "|---|---|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for quantity, unit, scale in (("load_A", "N", 1.0), ("displacement_A", "mm", 1e3)):
        for where in ("overall", "near a drop"):
            mine = [r for r in rows if r["quantity"] == quantity and r["where"] == where]
            n = len(mine)
            if n == 0:
                continue
            cells = [quantity.removesuffix("_A"), where, str(n)]
            for level in (50, 90):
                low, high = binom.interval(0.95, n, level / 100)
                count = sum(int(r[f"in{level}"]) for r in mine)
                mark = "" if low <= count <= high else "**"
                cells += [f"{mark}{count}{mark}", f"{low:.0f}-{high:.0f}"]
            for level in (50, 90):
                share = 100 * np.array([float(r[f"cover{level}"]) for r in mine])
                cells.append(f"{share.mean():.1f} +- {share.std(ddof=1) / np.sqrt(n):.1f} %")
            cells += [f"{scale * np.median([float(r[c]) for r in mine]):.3g} {unit}"
                      for c in ("rms", "width90")]  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def posterior_of(path: Path):
    """The spec that a posterior is of, and its law."""
    import tomllib

    from rigid.inference.posterior import load_posterior
    from rigid.smoothing.laws import read_law
    from rigid.spec.values import Spec, SpecBody

    body = SpecBody.model_validate(tomllib.loads(load_posterior(path).attrs["spec"]))
    fields = {name: getattr(body, name) for name in SpecBody.model_fields}
    spec = Spec.model_construct(**fields, path=Path("study.toml"), text="")
    return spec, read_law(spec, path, np.random.default_rng(1))


def main() -> int:
    args = options()
    from rigid.io.runtime import prepare

    prepare()
    spec, whole = posterior_of(args.posterior)
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{args.law}.csv"
    done = {row["seed"] for row in rows_of(path)}
    for number in range(args.tests):
        seed = args.first_seed + number
        if str(seed) in done:
            continue
        rows = one_test(spec, whole, seed, args.law)
        fresh = not path.exists()
        with path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if fresh:
                writer.writeheader()
            writer.writerows(rows)
        told = {f"{r['quantity']} {r['where']}": (r["cover50"], r["cover90"]) for r in rows}
        sys.stderr.write(f"test {number + 1} of {args.tests}, {rows[-1]['cpu_s']} s: {told}\n")
    rows = rows_of(path)
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    said = f"--posterior {args.posterior.name} --law {args.law} --tests {args.tests}"
    head = f"`python tests/studies/bands.py {said}`, commit {commit()}, {today}\n\n"
    (args.out / f"{args.law}.md").write_text(head + verdict(rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
