"""Which kind of rig or record breaks a fit first? Campaigns of the second simulator, by population.

    python tests/studies/open_world.py --campaigns 2
    python tests/studies/open_world.py --campaigns 2 --part 0/2
    python tests/studies/open_world.py --campaigns 1 --only plain stage --discover
    python tests/studies/open_world.py --campaigns 60 --discover --first-seed N --part 0/2
    python tests/studies/open_world.py --table
    python tests/studies/open_world.py --discover --first-seed N --table

Simulates campaigns by tests/second_simulator (docs/studies/populations.md), fits each in process as
`rigid.fit` does, and writes a line a campaign to OUT/fit-SEED-COMMIT.K.jsonl, and OUT.md as page.
`--discover` runs discovery on them, lines in OUT/discover-SEED-COMMIT.K.jsonl, page in
OUT_discovery.md. A page has the rows of one first seed and one commit (`--commit`, the latest where
it is left out), and says how many of others it leaves out. Resumable: a campaign that has its line
from the same code is not run again. Seeds from FIRST_SEED on are for development; none of them may
stand in a report on sealed campaigns.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from open_world_discovery import page as page_of_discovery
from open_world_page import page
from open_world_truth import acting
from rows import OneCode, carry_out, commit, lines_of, no_answer, of_one_commit

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where second_simulator lies

FIRST_SEED, DEVELOPED = 910_000, 10_000
"""The first seed of development, and how many there are; campaign i of every population has the
i-th seed after the first."""
PROGRAM = "python tests/studies/open_world.py"
LOOKALIKES = Path(__file__).resolve().parents[2] / "docs/studies/discovery/lookalikes.json"
KEPT = (
    *("verdict", "p_value", "probabilities", "steps", "gap"),
    *("usable", "checks", "disagreements"),
)
"""What a row keeps of discovery.json."""
HERTZ = (0.01, 80.0)
"""Frequencies at which a fit's table holds |mu|."""
LARGEST = 5
"""Residuals that a row keeps of each channel."""


class Case(NamedTuple):
    """One campaign; `number` is unlike for every population and index."""

    number: int
    population: str
    seed: int


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=2, help="of each population")
    parser.add_argument("--only", nargs="+", default=[], help="populations")
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--commit", help="of the rows of the page; left out: the latest")
    parser.add_argument("--starts", type=int, default=16, help="of the search of a fit")
    parser.add_argument("--discover", action="store_true", help="discovery in place of the fit")
    parser.add_argument("--table", action="store_true", help="write the page, run nothing")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/open_world"))
    return parser.parse_args()


def cases(campaigns: int, only: list[str], first_seed: int = FIRST_SEED) -> Iterator[Case]:
    """Index by index: what is stopped early has whole rounds, and compiled programs serve again."""
    from second_simulator import POPULATIONS

    for i in range(campaigns):
        for place, population in enumerate(POPULATIONS):
            if not only or population in only:
                yield Case(1000 * place + i, population, first_seed + i)


def truths(truth: dict) -> dict[str, float]:
    """SI by label of a fit's table; `kappa q` is kappa times the pump's scale."""
    rig = truth["rig"]
    known = {name: rig[name] for name in ("k_LC", "k_oil", "mu")}
    for hertz in HERTZ:
        turn = 2j * np.pi * hertz * np.array(rig["tau_branch"])
        sum_ = rig["mu"] + (np.array(rig["mu_branch"]) / (1.0 + turn)).sum()
        known[f"abs_mu[{hertz:g} Hz]"] = float(abs(sum_))
    for run in truth["runs"]:
        where = f"{run['name']},{run['cylinder']}"
        known |= {f"kappa[{where}]": f for _, f in run["valve"] if f > 0.0}
        if run["strap"]:
            known[f"release_time[{where}]"] = run["strap"][1]
    return known


def channel_row(channel) -> dict:
    """Gap of a channel, where its residuals are largest, and how they hang together."""
    residual = np.asarray(channel.residual)
    there = np.isfinite(residual)
    size = np.where(there, np.abs(residual), 0.0)
    worst = np.argsort(-size)[:LARGEST]
    x = residual[there]
    lag = float(x[1:] @ x[:-1] / (x @ x)) if x.size > 2 else None
    return {
        "record": f"{channel.record},{channel.cylinder}", "quantity": channel.quantity,
        "gap": float(channel.gap), "lag_1": lag, "memory_s": float(channel.correlation_time),
        "largest": [[float(channel.time[i]), float(residual[i])] for i in worst],
        "without_largest": float(np.sqrt(np.mean(np.delete(residual, worst)[
            np.delete(there, worst)] ** 2))),
    }  # fmt: skip


def fitted(spec: Path, truth: dict, seed: int) -> dict:
    """Fit a campaign and set the table beside the truth."""
    import rigid
    from rigid.io.errors import RigidError

    try:
        found = rigid.load(spec).fit(seed=seed, quiet=True)
    except RigidError as refusal:
        return {"refused": str(refusal)}
    known, table = truths(truth), {}
    for row in found.result.parameters:
        s = row.summary
        if row.name in known:
            stands = {"median": s.median, "sd": s.sd, "q05": s.q05, "q95": s.q95}
            table[row.name] = stands | {"truth": known[row.name]}
    return {
        "usable": found.usable,
        "checks": [[c.name, bool(c.ok), c.says] for c in found.checks],
        "gap": found.result.gap.overall,
        "parameters": table,
        "channels": [channel_row(max(found.calibrated.shown, key=lambda one: one.gap))],
    }


def discovered(spec: Path, seed: int, folder: Path) -> dict:
    """Run discovery on a campaign as the command does; gives its status and the KEPT."""
    from rigid import discover as command
    from rigid.io.cli import Options
    from rigid.io.errors import RigidError

    chosen = Options(str(spec), folder, seed, resume=False, quiet=True, as_json=True)
    try:
        status = command.discover(chosen)
    except (RigidError, ValueError) as error:  # the latter a defect: counted, and the run goes on
        return no_answer(error, folder.parent)
    told = (folder / "discovery.json").read_text("utf-8").replace(f"{folder}/", "")
    return {"status": status} | {key: json.loads(told)[key] for key in KEPT}


def one(case: Case, discover: bool, starts: int) -> dict:
    """Simulate a campaign and put truth and answer into one row."""
    from second_simulator import campaign

    with tempfile.TemporaryDirectory() as made:
        folder, began = Path(made), time.monotonic()
        spec = campaign(case.population, case.seed, folder)
        truth = json.loads((folder / "truth.json").read_text("utf-8"))
        with spec.open("a", encoding="utf-8") as file:
            file.write(f"\n[sampler]\nstarts = {starts}\n")
        made_s = time.monotonic() - began
        began, busy = time.monotonic(), time.process_time()
        if discover:
            answer = discovered(spec, case.seed, folder / "out")
        else:
            answer = fitted(spec, truth, case.seed)
        seconds, core_s = time.monotonic() - began, time.process_time() - busy
    row = {"case": case._asdict(), "simulated": True, "nearest": truth["nearest"]}
    row |= {"scale": truth["rig"]["pump_scale"], "hidden": truth["hidden"]}
    row |= {"truth": acting(truth), "starts": starts, "made_s": round(made_s, 1)}
    row["straps"] = [run["strap"] for run in truth["runs"] if run["strap"]]
    return row | {"seconds": round(seconds, 1), "core_s": round(core_s, 1), "answer": answer}


def says(row: dict) -> object:
    answer = row["answer"]
    return answer.get("refused") or answer.get("verdict") or (answer["usable"], answer["gap"])


def command(args: argparse.Namespace) -> str:
    """The command line that a row is from, without where it was written and which part it is."""
    words = [PROGRAM, *(["--discover"] if args.discover else []), f"--campaigns {args.campaigns}"]
    words += [f"--first-seed {args.first_seed}", f"--starts {args.starts}"]
    return " ".join(words + (["--only", *args.only] if args.only else []))


def work(args: argparse.Namespace, kind: str) -> None:
    """Run the campaigns of a part that have no row of this code yet."""
    from rigid.io.runtime import prepare

    prepare()
    part, parts = map(int, args.part.split("/"))
    name, told = f"{kind}-{args.first_seed}-{commit()}", command(args)
    done = {row["case"]["number"] for row in lines_of(args.out.glob(f"{name}.*.jsonl"))}
    mine = list(cases(args.campaigns, args.only, args.first_seed))[part::parts]

    def run(case: Case) -> dict:
        found = one(case, args.discover, args.starts)
        return {"first_seed": args.first_seed, "command": told} | found

    left = [case for case in mine if case.number not in done]
    carry_out(args.out / f"{name}.{part}.jsonl", left, run, says)


def written(args: argparse.Namespace, kind: str) -> str:
    """The page of a kind of rows: those of the first seed and of one commit."""
    from second_simulator import POPULATIONS

    rows = lines_of(sorted(args.out.glob(f"{kind}*.jsonl")))
    # rows from before there was a choice are from the first seed of development
    rows = [row for row in rows if row.get("first_seed", FIRST_SEED) == args.first_seed]
    code: OneCode = of_one_commit(rows, args.commit)
    if kind == "fit":
        return page(code, origin(args.first_seed))
    known = json.loads(LOOKALIKES.read_text("utf-8"))
    return page_of_discovery(code, known, args.only or list(POPULATIONS), origin(args.first_seed))


def origin(first_seed: int) -> str:
    """Where the seeds are from."""
    if first_seed in range(FIRST_SEED, FIRST_SEED + DEVELOPED):
        return "Seeds are for development: these figures say what to work on, they are no bar."
    return f"Seeds are from {first_seed} on; those of development start at {FIRST_SEED}."


def main() -> None:
    args = options()
    kind = "discover" if args.discover else "fit"
    if not args.table:
        work(args, kind)
    name = f"{args.out.name}_discovery.md" if args.discover else f"{args.out.name}.md"
    args.out.with_name(name).write_text(written(args, kind), "utf-8")


if __name__ == "__main__":
    main()
