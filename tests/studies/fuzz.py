"""Does every damaged spec and record file get a sentence, in bounded time and memory?

    python tests/studies/fuzz.py --inputs 100000
    python tests/studies/fuzz.py --inputs 100000 --part 0/2
    python tests/studies/fuzz.py --table

Damages specs and files of every record format (tests/damage.py), has them read, and writes a line
for every thousand inputs to OUT/fuzz.K.jsonl and the page to OUT.md. Resumable: a thousand that has
its line is not run again. An input that takes more than LONGEST seconds of the
processor is stopped and is a fault; other work on the machine is none.
"""

import argparse
import datetime
import resource
import signal
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from rows import carry_out, lines_of

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where damage lies

BLOCK = 1000
FIRST_SEED = 1_000_000
"""The quick test takes seeds from 0 on."""
LONGEST = 20
"""Seconds of the processor, of this process and of the system for it."""
MIB = 1 << 20


class Case(NamedTuple):
    """A thousand inputs of one subject; `number` is unlike for each."""

    number: int
    subject: str
    seed: int


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--inputs", type=int, default=100_000, help="over all subjects")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th thousand from the K-th on")
    parser.add_argument("--table", action="store_true", help="write the page, run nothing")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/fuzz"))
    return parser.parse_args()


def cases(inputs: int) -> list[Case]:
    """Subject after subject, so that a run that is stopped has seen all of them alike."""
    from damage import texts

    subjects = sorted(texts())
    return [
        Case(number, subjects[number % len(subjects)], FIRST_SEED + BLOCK * number)
        for number in range(-(-inputs // BLOCK))
    ]


def one(case: Case) -> dict:
    """Run a thousand inputs."""
    from damage import outcome

    def stop(*_given: object) -> None:
        raise TimeoutError(f"more than {LONGEST} s of the processor")

    signal.signal(signal.SIGPROF, stop)
    warnings.simplefilter("error")
    found = []
    with tempfile.TemporaryDirectory() as name:
        for seed in range(case.seed, case.seed + BLOCK):
            signal.setitimer(signal.ITIMER_PROF, LONGEST)
            found.append((seed, outcome(case.subject, seed, Path(name))))
            signal.setitimer(signal.ITIMER_PROF, 0)
    proper = Counter(result.what for _, result in found if result.what in ("taken", "refused"))
    faults = [[seed, r.what] for seed, r in found if r.what not in ("taken", "refused")]
    return {
        "case": case._asdict(),
        "taken": proper["taken"],
        "refused": proper["refused"],
        "faults": faults,
        "longest_s": round(max(result.seconds for _, result in found), 4),
        "memory_MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }


def page(rows: list[dict]) -> str:
    """The page of the study."""
    subjects = sorted({row["case"]["subject"] for row in rows})
    total = BLOCK * len(rows)
    out = [
        "# Damaged specs and records\n",
        "Specs and record files of every format are damaged at random (`tests/damage.py`: numbers\n"
        "replaced, lines lost, written twice or exchanged, bytes changed, other separators and\n"
        "encodings, noise) and read. Each must be taken, or refused with a sentence that names\n"
        "its file and ends in status 2. Anything else is a fault, warnings of NumPy among them.\n"
        "*Table*: the reader of the format; *record*: all that is checked of a record: of the\n"
        "reference campaign (logger, accelerometer recorder, field test), a table with\n"
        "semicolons, decimal commas and a row of units, one with tabs and counts, and a measured\n"
        "motion.\n",
        f"`python tests/studies/fuzz.py --inputs {total}`, code of "
        f"{', '.join(sorted({row['commit'] for row in rows}))}, {datetime.date.today()}.\n",
        "| subject | inputs | taken | refused | faults | longest [CPU s] |",
        "|---|---|---|---|---|---|",
    ]
    for subject in (*subjects, "all"):
        mine = [r for r in rows if subject in ("all", r["case"]["subject"])]
        counts = (sum(r[key] for r in mine) for key in ("taken", "refused"))
        faults = sum(len(r["faults"]) for r in mine)
        cells = [subject, BLOCK * len(mine), *counts, faults, max(r["longest_s"] for r in mine)]
        out.append("| " + " | ".join(map(str, cells)) + " |")
    out.append(f"\nThe process held {max(r['memory_MiB'] for r in rows)} MiB at most.\n")
    told = [f"- {r['case']['subject']}, seed {s}: {w}" for r in rows for s, w in r["faults"]]
    return "\n".join(out + (["## Faults\n", *told[:100], ""] if told else []))


def main() -> int:
    args = options()
    part, parts = (int(x) for x in args.part.split("/"))
    if not args.table:
        mine = cases(args.inputs)[part::parts]
        path = args.out / f"fuzz.{part}.jsonl"
        carry_out(path, mine, one, lambda row: (row["refused"], row["faults"][:2]))
    rows = lines_of(sorted(args.out.glob("fuzz.*.jsonl")))
    if rows:
        args.out.with_suffix(".md").write_text(page(rows), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
