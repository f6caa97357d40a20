"""Do the numbers of the budget (peak load, impulse, ...) lie where they are said to?

    python tests/studies/budget.py --posterior reports/calibration/posterior.nc --tests 100

Simulates field tests as `bands.py` does, under the right friction law, with seeds of their own;
makes bands from other draws of the posterior, and asks for each number of the budget whether its
90 % interval holds the true one. Peak and failure are the greatest true loads at any instant, also
between two samples. Tests are independent, so that the counts are binomial. Resumable: a test in
the file of rows is not run again.
"""

import argparse
import csv
import datetime
import sys
from pathlib import Path

import numpy as np
from bands import field_of, posterior_of, rows_of, simulated
from rows import commit

FIRST_SEED = 900_000
COLUMNS = ("seed", "quantity", "unit", "truth", "median", "q05", "q95", "drops")


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--posterior", type=Path, required=True)
    parser.add_argument("--tests", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("docs/studies/bands"))
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    return parser.parse_args()


def true_numbers(test, made) -> dict[str, float]:
    """The numbers of the budget of the true load and displacement, at the generator's instants."""
    from rigid.smoothing.run import windows_of

    time, at = made.time, windows_of(made.test)["A"]
    ends = time[at.failure][[0, -1]], time[at.rise][[0, -1]]
    here = (test.time >= time[0]) & (test.time <= time[-1])
    failing, rising = ((test.time >= low) & (test.time <= high) for low, high in ends)
    most = np.argmax(np.where(here, test.load, -np.inf))
    slope, _ = np.polyfit(test.displacement[rising], test.load[rising], 1)
    return {
        "peak load": test.load[most],
        "load at failure": test.load[failing].max(),
        "total impulse": np.trapezoid(test.load[here], test.time[here]),
        "displacement at peak": test.displacement[most],
        "effective stiffness dF/dx": slope,
    }


def one_test(spec, whole, seed: int) -> list[dict]:
    from rigid.smoothing.run import bands, learned, ways

    test, _, laws, _ = simulated(spec, whole, "right", seed)
    field = field_of(test)
    found = [learned(spec, [field], law, lambda _: None) for law in laws]
    made = bands(ways([field], found, laws), seed, apart=False)
    truth = true_numbers(test, made)
    return [
        {
            "seed": seed, "quantity": line.name, "unit": line.unit, "drops": len(test.drops),
            **{k: f"{v:.8g}" for k, v in zip(
                ("truth", "median", "q05", "q95"),
                (truth[line.name], line.median, line.q05, line.q95), strict=True,
            )},
        }
        for line in made.budget
    ]  # fmt: skip


def verdict(rows: list[dict[str, str]]) -> str:
    """Table of coverage; what lies outside its binomial band stands bold."""
    from scipy.stats import binom

    lines = ["| number | tests | in its 90 % interval | band | rms error | width of the interval |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for name in dict.fromkeys(r["quantity"] for r in rows):
        mine = [r for r in rows if r["quantity"] == name]
        truth, middle, low, high = (
            np.array([float(r[c]) for r in mine]) for c in ("truth", "median", "q05", "q95")
        )
        count, size = int(np.sum((low <= truth) & (truth <= high))), np.abs(truth)
        least, most = binom.interval(0.95, len(mine), 0.9)
        mark = "" if least <= count <= most else "**"
        rms = np.sqrt(np.mean(((middle - truth) / size) ** 2))
        cells = [name, f"{len(mine)}", f"{mark}{count}{mark}", f"{least:.0f}-{most:.0f}",
                 f"{100 * rms:.2f} %", f"{100 * np.median((high - low) / size):.2f} %"]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> int:
    args = options()
    from rigid.io.runtime import prepare

    prepare()
    spec, whole = posterior_of(args.posterior)
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / "budget.csv"
    done = {row["seed"] for row in rows_of(path)}
    for number in range(args.tests):
        seed = args.first_seed + number
        if str(seed) in done:
            continue
        rows = one_test(spec, whole, seed)
        fresh = not path.exists()
        with path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if fresh:
                writer.writeheader()
            writer.writerows(rows)
        sys.stderr.write(f"test {number + 1} of {args.tests}\n")
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    said = f"--posterior {args.posterior.name} --tests {args.tests}"
    head = f"`python tests/studies/budget.py {said}`, commit {commit()}, {today}\n\n"
    (args.out / "budget.md").write_text(head + verdict(rows_of(path)) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
