"""Do the bands of ice load and displacement cover the truth as often as they say?

    python tests/studies/bands.py --posterior reports/calibration/posterior.nc --tests 200

Simulates field tests with seeds of their own (from FIRST_SEED on; all development used lower ones),
with drops of many sizes and speeds, each with a rig and sensors that are one draw of the posterior;
makes bands from other draws, and counts for what part of the time the 50 % and 90 % bands hold the
true load and displacement: over the whole test, and within 50 ms of a drop. The unit is the test.
Resumable: a test that stands in the file of rows is not run again.

`--law wrong` makes the bands under a constant friction, as in free running; `--law averaged` under
both laws, each weighed by its evidence in the record.
"""

import argparse
import csv
import datetime
import subprocess
import sys
import time
from pathlib import Path

FIRST_SEED = 700_000
NEAR = 0.05
DRAWS = 64
COLUMNS = ("seed", "quantity", "where", "cover50", "cover90", "rms", "width90", "drops", "weight",
           "wall_s")  # fmt: skip
BASE = ("load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve")


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--posterior", type=Path, required=True)
    parser.add_argument("--tests", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("docs/studies/bands"))
    parser.add_argument("--law", choices=("right", "wrong", "averaged"), default="right")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th test from the K-th on")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    return parser.parse_args()


def rows_of(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def plant_of(values: dict, steps: dict):
    """The generator's rig, friction and sensors with one draw's numbers."""
    from rigid.generator.friction import Friction
    from rigid.generator.plant import Rig
    from rigid.generator.sensors import Sensor

    rig = Rig(**{n: values[n] for n in Rig.__dataclass_fields__})
    friction = Friction(values["mu"], values["mu_branch[1]"], values["tau_branch[1]"],
                        values["mu_branch[2]"], values["tau_branch[2]"])  # fmt: skip
    sensors = {
        q: Sensor(1.0 + values[f"gain[{q},A]"], values[f"zero[{q},A]"], values[f"noise[{q},A]"], s)
        for q, s in steps.items()
    }
    return rig, friction, sensors


def constant_friction(law):
    """The same draws with the friction of steady running at every frequency."""
    import dataclasses

    from rigid.effects import CATALOGUE

    values = dict(law.values)
    values["mu"] = values["mu"] + values["mu_branch[1]"] + values["mu_branch[2]"]
    effects = tuple(CATALOGUE[name] for name in BASE)
    return dataclasses.replace(law, name="constant friction", effects=effects, values=values)


def laws_of(kind: str, law) -> list:
    """The laws that the bands are made under."""
    return {"right": [law], "wrong": [constant_friction(law)],
            "averaged": [law, constant_friction(law)]}[kind]  # fmt: skip


def field_of(test):
    """A simulated test as the smoother meets it."""
    import numpy as np

    from rigid.smoothing.field import Field
    from rigid.smoothing.model import QUANTITIES

    reading = np.stack([test.readings[q] for q in QUANTITIES], axis=1)
    return Field("field", "A", "", 0.0, 0.01, reading, np.ones_like(reading))


def made_bands(spec, field, laws, seed: int):
    """Bands of a record under laws weighed by their evidence; gives the first law's weight too."""
    import dataclasses

    import numpy as np

    from rigid.smoothing.run import Way, bands, learned, prepared

    found = [learned(spec, [field], law, lambda _: None) for law in laws]
    bounds = np.array([one[0].bound for one in found])
    weights = np.exp(bounds - bounds.max())
    weights = weights / weights.sum()
    ways = [
        Way(prepared([field], one), dataclasses.replace(law, weight=float(w)))
        for one, law, w in zip(found, laws, weights, strict=True)
    ]
    return bands(ways, seed, apart=False), float(weights[0])


def one_test(spec, whole, seed: int, kind: str) -> list[dict]:
    import numpy as np

    from rigid.generator.field import field_test
    from rigid.smoothing.model import QUANTITIES

    began = time.monotonic()
    rng = np.random.default_rng([seed, 1])
    picked = rng.choice(whole.size, DRAWS + 1, replace=False)
    true = {k: float(v[picked[0]] if v.size > 1 else v[0]) for k, v in whole.values.items()}
    plant = plant_of(true, {q: spec.sensors[q].step for q in QUANTITIES})
    test = field_test(*plant, rng)
    made, weight = made_bands(spec, field_of(test), laws_of(kind, whole.only(picked[1:])), seed)
    near = np.zeros(len(test.time), dtype=bool)
    for drop in test.drops:
        near |= (test.time > drop.begin - NEAR) & (test.time < drop.end + NEAR)
    out = []
    for quantity, truth in (("load_A", test.load), ("displacement_A", test.displacement)):
        low, lower, middle, upper, high = made.bands[quantity].quantiles
        for where, mask in (("overall", np.ones_like(near)), ("near a drop", near)):
            out.append({
                "seed": seed, "quantity": quantity, "where": where,
                "cover50": f"{np.mean(((truth > lower) & (truth < upper))[mask]):.4f}",
                "cover90": f"{np.mean(((truth > low) & (truth < high))[mask]):.4f}",
                "rms": f"{np.sqrt(np.mean((middle - truth)[mask] ** 2)):.4g}",
                "width90": f"{np.median((high - low)[mask]):.4g}",
                "drops": len(test.drops), "weight": f"{weight:.4g}",
                "wall_s": f"{time.monotonic() - began:.1f}",
            })  # fmt: skip
    return out


def verdict(rows: list[dict[str, str]]) -> str:
    """Table of coverage with tests as the unit, beside the binomial band."""
    import numpy as np
    from scipy.stats import binom

    lines = ["| quantity | where | tests | 50 % band covers | binomial band | 90 % band covers | "
             "binomial band | median rms error | median width of the 90 % band |",
             "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for quantity, unit, scale in (("load_A", "N", 1.0), ("displacement_A", "mm", 1e3)):
        for where in ("overall", "near a drop"):
            mine = [r for r in rows if r["quantity"] == quantity and r["where"] == where]
            n = len(mine)
            if n == 0:
                continue
            cells = [quantity.removesuffix("_A"), where, str(n)]
            for level, column in ((0.5, "cover50"), (0.9, "cover90")):
                band = binom.interval(0.95, n, level)
                share = np.mean([float(r[column]) for r in mine])
                cells += [f"{100 * share:.1f} %",
                          f"{100 * band[0] / n:.0f}-{100 * band[1] / n:.0f} %"]  # fmt: skip
            cells += [f"{scale * np.median([float(r[c]) for r in mine]):.3g} {unit}"
                      for c in ("rms", "width90")]  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> int:
    args = options()
    part, parts = (int(x) for x in args.part.split("/"))
    from rigid.runtime import prepare

    prepare()
    # The spec is the posterior's own.
    import tomllib

    import numpy as np

    from rigid.posterior import load_posterior
    from rigid.smoothing.laws import read_law
    from rigid.spec.values import Spec, SpecBody

    body = SpecBody.model_validate(tomllib.loads(load_posterior(args.posterior).attrs["spec"]))
    fields = {name: getattr(body, name) for name in SpecBody.model_fields}
    spec = Spec.model_construct(**fields, path=Path("study.toml"), text="")
    whole = read_law(spec, args.posterior, np.random.default_rng(1))
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{args.law}.{part}.csv"
    done = {row["seed"] for row in rows_of(path)}
    for number in range(part, args.tests, parts):
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
        sys.stderr.write(f"test {number + 1} of {args.tests}, {rows[-1]['wall_s']} s: {told}\n")
    rows = [row for p in sorted(args.out.glob(f"{args.law}.?.csv")) for row in rows_of(p)]
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True,
                            text=True, check=False).stdout.strip()  # fmt: skip
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    said = f"--posterior {args.posterior.name} --law {args.law} --tests {args.tests}"
    head = f"`python tests/studies/bands.py {said}`, commit {commit}, {today}\n\n"
    (args.out / f"{args.law}.md").write_text(head + verdict(rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
