"""The benchmark: rigid and its peers side by side, one table.

    python tests/benchmarks/run.py [ROW ...] [--quick] [--out docs/studies]

Without names it runs all rows. Peers are an optional extra: `pip install -e .[peers]`; without it
their rows say so. Run it on an idle machine; `--quick` only shows that it runs.
"""

import argparse
import datetime
import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NAMES = (
    "wait", "joint", "compile", "limits", "friction", "release", "wall", "ess", "pints", "numpyro",
    "growth", "accuracy",
)  # fmt: skip


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("rows", nargs="*", metavar="ROW", help=f"of {', '.join(NAMES)}")
    parser.add_argument("--quick", action="store_true", help="few repetitions, short chains")
    parser.add_argument("--out", type=Path, help="folder of speed.md and its plot")
    given = parser.parse_args()
    unknown = [name for name in given.rows if name not in NAMES]
    if unknown:
        parser.error(f"no row '{unknown[0]}'; rows are {', '.join(NAMES)}")
    return given


def main() -> None:
    given = options()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads slow SciPy's 7 x 7 matrices down
    from rigid.io.runtime import prepare

    prepare()
    from campaign import Bench
    from registry import ROWS
    from table import page, provenance

    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
    bench, rows = Bench(given.quick, given.out), []
    began = datetime.datetime.now(datetime.UTC)
    command, text = " ".join(["python tests/benchmarks/run.py", *sys.argv[1:]]), ""
    for name in given.rows or NAMES:
        start = time.perf_counter()
        rows += ROWS[name](bench)
        sys.stderr.write(f"{name}: {time.perf_counter() - start:.0f} s\n")
        text = page(rows, provenance(ROOT, command, given.quick, began))
        if given.out is not None:  # after each row: the next may take an hour
            (given.out / "speed.md").write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
