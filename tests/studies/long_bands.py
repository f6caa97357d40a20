"""What long and many field records cost `python -m rigid.bands`, in time and memory.

    python tests/studies/long_bands.py --posterior reports/calibration/posterior.nc --case hour

Simulates records of both cylinders at 100 Hz with rig and sensors that are one draw of the
posterior, writes them as the logger would, runs the command on them as a user would, in a process
of its own, and measures that process: wall time, processor time, greatest resident memory. Cases
are `hour` (40 presses in one record), `fifty` (fifty tests of 5.11 s) and `presses-N` (a record of
N presses, 90 s each). Then the bands are held against the truth. Resumable: data that are there are
not made again, and an interrupted command goes on (its figures are then those of its last process,
and the row says so). A row goes to docs/studies/bands/long.csv, the table of all rows to long.md.
"""

import argparse
import csv
import datetime
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from bands import field_test_of, posterior_of
from rows import commit

SEED = 900_000
MORNING = datetime.datetime(2026, 3, 12, 9, 30)
COLUMNS = ("case", "tests", "samples", "draws", "wall_s", "cpu_s", "peak_MiB", "resumed", "load50",
           "load90", "displacement50", "displacement90", "commit", "date")  # fmt: skip
CHANNELS = {"load": ("Load", "kN"), "stroke": ("Stroke", "mm"), "pressure": ("Press", "bar")}


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--posterior", type=Path, required=True)
    parser.add_argument("--case", default="presses-1", help="hour, fifty or presses-N")
    parser.add_argument("--draws", type=int, default=128)
    parser.add_argument("--data", type=Path, default=Path("reports/long-bands"))
    parser.add_argument("--out", type=Path, default=Path("docs/studies/bands"))
    return parser.parse_args()


def presses_of(case: str) -> list[int]:
    """Presses in each record of a case; 0: a single test of 5.11 s."""
    if case == "fifty":
        return [0] * 50
    return [40 if case == "hour" else int(case.removeprefix("presses-"))]


def write_data(folder: Path, case: str, posterior: Path) -> None:
    """Records, spec without its [bands], and truth of a case."""
    from rigid.generator.writers import write_toa5

    spec, law = posterior_of(posterior)
    folder.mkdir(parents=True, exist_ok=True)
    told = []
    for number, presses in enumerate(presses_of(case)):
        name = f"field-{number + 1}"
        path = folder / f"{name}.dat"
        told += [entry(name, cylinder) for cylinder in "AB"]
        if path.exists():
            continue
        codes, steps, truth = {}, {}, {}
        for cylinder in "AB":
            rng = np.random.default_rng([SEED, number, ord(cylinder)])
            test = field_test_of(spec, law, cylinder, rng, presses)
            for channel in CHANNELS:
                step = spec.sensors[channel].step
                steps[channel, cylinder] = step
                codes[channel, cylinder] = np.round(test.readings[channel] / step).astype(int)
            truth |= {f"load_{cylinder}": test.load, f"displacement_{cylinder}": test.displacement}
        np.savez(folder / f"truth-{name}.npz", **truth)
        write_toa5(path, codes, steps, MORNING, 1)
        sys.stderr.write(f"{path} written\n")
    effects = json.dumps(list(spec.model.effects))
    head = (
        f'title = "Long and many field records"\nsimulated = true\n\n[model]\neffects = {effects}\n'
    )
    (folder / "records.toml").write_text(head + "".join(told), encoding="utf-8")


def entry(name: str, cylinder: str) -> str:
    rows = "".join(
        f'{channel} = {{ column = "{column}_{cylinder}", unit = "{unit}" }}\n'
        for channel, (column, unit) in CHANNELS.items()
    )
    return (
        f'\n[[records]]\nname = "{name}"\nkind = "field"\ncylinder = "{cylinder}"\n'
        f'file = "{name}.dat"\n[records.channels]\n'
        f'time = {{ column = "TIMESTAMP", unit = "timestamp" }}\n{rows}'
    )


def measured(folder: Path, posterior: Path, draws: int) -> dict[str, object]:
    """Run the command to its end; gives what its process took."""
    spec = folder / f"field-{draws}.toml"
    bands = f'\n[bands]\nposterior = "{posterior.resolve()}"\ndraws = {draws}\n'
    spec.write_text((folder / "records.toml").read_text(encoding="utf-8") + bands, encoding="utf-8")
    out = folder / f"out-{draws}"
    resumed = (out / "bands" / "unfinished").exists()
    command = [sys.executable, "-m", "rigid.bands", str(spec), "--out", str(out), "--resume"]
    began = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "draws": draws, "wall_s": round(time.monotonic() - began),
        "cpu_s": round(used.ru_utime + used.ru_stime), "peak_MiB": round(used.ru_maxrss / 1024),
        "resumed": int(resumed),
    }  # fmt: skip


def held(folder: Path, draws: int, tests: int) -> dict[str, object]:
    """Share of all told instants at which the truth of a cylinder lies in its band, percent."""
    counts: dict[str, list[float]] = {}
    samples = 0
    for number in range(tests):
        name = f"field-{number + 1}"
        truth = np.load(folder / f"truth-{name}.npz")
        with (folder / f"out-{draws}" / "bands" / f"{name}.csv").open(encoding="utf-8") as file:
            head = file.readline().strip().split(",")
            picked = [
                head.index(f"{quantity}_{cylinder} {q} [{unit}]")
                for quantity, unit in (("load", "N"), ("displacement", "m"))
                for cylinder in "AB"
                for q in ("q05", "q25", "q75", "q95")
            ]
            table = np.loadtxt(file, delimiter=",", usecols=[0, *picked])
        at = np.round(table[:, 0] * 400).astype(int)
        samples += int(at[-1]) // 4 + 1
        for i, key in enumerate(f"{q}_{c}" for q in ("load", "displacement") for c in "AB"):
            low, lower, upper, high = table[:, 1 + 4 * i : 5 + 4 * i].T
            true, quantity = truth[key][at], key.split("_")[0]
            for level, inside in (("50", (true > lower) & (true < upper)),
                                  ("90", (true > low) & (true < high))):  # fmt: skip
                counts.setdefault(quantity + level, []).append(float(np.mean(inside)))
    shares = {name: f"{100 * np.mean(values):.1f}" for name, values in counts.items()}
    return {"tests": tests, "samples": samples, **shares}


def table(rows: list[dict[str, str]]) -> str:
    """All rows as a table."""
    lines = ["| case | tests | samples a cylinder | draws | wall | processor | greatest memory | "
             "load in the 50, 90 % band | displacement | commit |", "|" + "---|" * 10]  # fmt: skip
    for r in rows:
        lines.append(
            f"| {r['case']} | {r['tests']} | {int(r['samples']):,} | {r['draws']} | "
            f"{r['wall_s']} s | {r['cpu_s']} s | {r['peak_MiB']} MiB | "
            f"{r['load50']}, {r['load90']} % | "
            f"{r['displacement50']}, {r['displacement90']} % | {r['commit']} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    args = options()
    folder, tests = args.data / args.case, len(presses_of(args.case))
    write_data(folder, args.case, args.posterior)
    row: dict = {"case": args.case} | measured(folder, args.posterior, args.draws)
    row |= held(folder, args.draws, tests)
    row |= {"commit": commit(), "date": datetime.datetime.now(datetime.UTC).date().isoformat()}
    path = args.out / "long.csv"
    fresh = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if fresh:
            writer.writeheader()
        writer.writerow(row)
    with path.open(encoding="utf-8", newline="") as file:
        (args.out / "long.md").write_text(table(list(csv.DictReader(file))), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
