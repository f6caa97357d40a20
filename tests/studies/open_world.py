"""Which kind of rig or record breaks a fit first? Campaigns of the second simulator, by population.

    python tests/studies/open_world.py --campaigns 2
    python tests/studies/open_world.py --campaigns 2 --part 0/2
    python tests/studies/open_world.py --campaigns 1 --only plain stage --discover
    python tests/studies/open_world.py --table

Simulates campaigns by tests/second_simulator (docs/studies/populations.md), fits each in process as
`rigid.fit` does, and writes a line a campaign to OUT/fit.K.jsonl and the page to OUT.md.
`--discover` runs discovery on them as well, lines in OUT/discover.K.jsonl. Resumable: a campaign
that has its line is not run again. Seeds are for development; none of them may stand in a report on
sealed campaigns.
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
from open_world_page import page
from rows import carry_out, lines_of

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where second_simulator lies

FIRST_SEED = 910_000
"""Of development; campaign i of every population has seed FIRST_SEED + i."""
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
    parser.add_argument("--discover", action="store_true", help="discovery in place of the fit")
    parser.add_argument("--table", action="store_true", help="write the page, run nothing")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/open_world"))
    return parser.parse_args()


def cases(campaigns: int, only: list[str]) -> Iterator[Case]:
    """Index by index, so that lengths of records recur and compiled programs serve again."""
    from second_simulator import POPULATIONS

    for i in range(campaigns):
        for place, population in enumerate(POPULATIONS):
            if not only or population in only:
                yield Case(1000 * place + i, population, FIRST_SEED + i)


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
        stands = {"median": s.median, "sd": s.sd, "q05": s.q05, "q95": s.q95}
        table[row.name] = stands | {"truth": known.get(row.name)}
    return {
        "usable": found.usable,
        "checks": [[c.name, bool(c.ok), c.says] for c in found.checks],
        "gap": found.result.gap.overall,
        "parameters": table,
        "channels": [channel_row(channel) for channel in found.calibrated.shown],
    }


def discovered(spec: Path, seed: int, folder: Path) -> dict:
    """Run discovery on a campaign as the command does."""
    from rigid import discover as command
    from rigid.io.cli import Options
    from rigid.io.errors import RigidError

    chosen = Options(str(spec), folder, seed, resume=False, quiet=True, as_json=True)
    try:
        status = command.discover(chosen)
    except RigidError as refusal:
        return {"refused": str(refusal)}
    return {"status": status} | json.loads((folder / "discovery.json").read_text("utf-8"))


def one(case: Case, discover: bool) -> dict:
    """Simulate a campaign and put truth and answer into one row."""
    from second_simulator import campaign

    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        spec = campaign(case.population, case.seed, folder)
        truth = json.loads((folder / "truth.json").read_text("utf-8"))
        began = time.monotonic()
        if discover:
            answer = discovered(spec, case.seed, folder / "out")
        else:
            answer = fitted(spec, truth, case.seed)
    row = {"case": case._asdict(), "simulated": True, "nearest": truth["nearest"]}
    row |= {"scale": truth["rig"]["pump_scale"], "hidden": truth["hidden"]}
    row["straps"] = [run["strap"] for run in truth["runs"] if run["strap"]]
    return row | {"seconds": round(time.monotonic() - began, 1), "answer": answer}


def says(row: dict) -> object:
    answer = row["answer"]
    return answer.get("refused") or answer.get("verdict") or (answer["usable"], answer["gap"])


def main() -> None:
    args = options()
    kind = "discover" if args.discover else "fit"
    if not args.table:
        from rigid.io.runtime import prepare

        prepare()
        part, parts = map(int, args.part.split("/"))
        path = args.out / f"{kind}.{part}.jsonl"
        others = [other for other in args.out.glob(f"{kind}.*.jsonl") if other != path]
        done = {row["case"]["number"] for row in lines_of(others)}
        mine = [c for c in cases(args.campaigns, args.only) if c.number not in done]
        carry_out(path, mine[part::parts], lambda case: one(case, args.discover), says)
    fits, discoveries = (
        lines_of(sorted(args.out.glob(f"{name}.*.jsonl"))) for name in ("fit", "discover")
    )
    args.out.with_suffix(".md").write_text(page(fits, discoveries), "utf-8")


if __name__ == "__main__":
    main()
