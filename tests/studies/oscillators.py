"""Is what a measured motion lacks found on machines of any size? By population, simulated.

    python tests/studies/oscillators.py --campaigns 10 --first-seed 30001
    python tests/studies/oscillators.py --page --first-seed 30001

A mass of 1 to 100 kg on a spring, 0.5 to 8 Hz, is shaken by a force of many frequencies, or let go;
SciPy integrates it. The spec knows springs and drag by wide priors and states none of what may be
missing. Hidden: nothing, a cubic spring, dry friction, a force that is late, drag with the square
of the speed (which has no entry), dry friction in free decay. Seeds below 1000 are of development.
Writes OUT-SEED.jsonl, a line a campaign, and OUT.md; resumable.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rows import carry_out, lines_of, no_answer, of_one_commit
from scipy.integrate import solve_ivp
from scipy.stats import beta

from rigid.effects import CATALOGUE

DRY = {"coulomb-friction", "stribeck-friction", "lugre-friction"}
RIGHT: dict[str, set[str]] = {
    "nothing": {"nothing-missing"},
    "cubic": {"spring-hardening"},
    "dry": DRY,
    "late": {"force-clock-offset"},
    "square": {"force over speed"},
    "decay": DRY,
}
"""By population, what may be said first; "force over speed" is something unnamed."""
SPEC = """title = "Oscillator"
simulated = true
[model]
body = "mass"
effects = ["viscous-friction", "joint-spring"]
[priors]
M_Pl = {mass}
mu = {{ lognormal = {{ median = {drag:.4g}, factor = 5.0 }} }}
k_spring = {{ lognormal = {{ median = {stiffness:.4g}, factor = 2.0 }} }}
[sensors]
force = {{ noise = {sheet:.4g}, gain_sd = 0.01, zero_sd = {zero:.4g} }}
[[records]]
name = "swing"
kind = "motion"
file = "swing.csv"
corner = {corner:.5g}
[records.channels]
time = {{ column = "t", unit = "s" }}
position = {{ column = "x", unit = "m" }}
force = {{ column = "F", unit = "N" }}
"""


class Case(NamedTuple):
    """One campaign."""

    number: int
    population: str
    seed: int


class Drawn(NamedTuple):
    """An oscillator: mass [kg], frequency [Hz], damping ratio, swing [m], share that is hidden."""

    mass: float
    frequency: float
    damping: float
    size: float
    share: float

    @property
    def omega(self) -> float:
        return 2.0 * np.pi * self.frequency

    @property
    def stiffness(self) -> float:
        return self.mass * self.omega**2

    @property
    def drag(self) -> float:
        return 2.0 * self.damping * self.mass * self.omega


def cases(campaigns: int, first_seed: int) -> Iterator[Case]:
    for i in range(campaigns):
        for place, population in enumerate(RIGHT):
            yield Case(1000 * place + i, population, first_seed + i)


def drawn(rng: np.random.Generator) -> Drawn:
    return Drawn(
        mass=10.0 ** rng.uniform(0.0, 2.0), frequency=10.0 ** rng.uniform(-0.3, 0.9),
        damping=10.0 ** rng.uniform(-2.3, -0.7), size=10.0 ** rng.uniform(-3.0, -1.0),
        share=10.0 ** rng.uniform(-1.3, -0.3),
    )  # fmt: skip


def simulated(population: str, one: Drawn, rng: np.random.Generator) -> np.ndarray:
    """Time, position and force (3, samples), without noise."""
    periods = 40.0 if population == "decay" else 120.0
    t = np.arange(0.0, periods, 1.0 / 80.0) / one.frequency
    lines = np.arange(0.15, 2.2, 0.05) * one.frequency
    angles = rng.uniform(0.0, 2.0 * np.pi, len(lines))
    level = one.stiffness * one.size * 2.0 * np.sqrt(one.damping) / 6.0
    late = 0.5 * 10.0 ** rng.uniform(-1.8, -1.0) / one.frequency

    def shaking(at: float | np.ndarray) -> np.ndarray:
        angle = 2.0 * np.pi * lines * np.asarray(at)[..., None] + angles
        return (population != "decay") * level * np.sum(np.sin(angle), axis=-1)

    dry, fast = 2.0 * one.share * level, one.size * one.omega
    if population == "decay":
        dry = 0.03 * one.share * one.stiffness * one.size
    hidden: dict[str, Callable[[float, float], float]] = {
        "cubic": lambda x, _: one.share * one.stiffness / one.size**2 * x**3,
        "dry": lambda _, v: dry * np.tanh(v / (1e-3 * fast)),
        "decay": lambda _, v: dry * np.tanh(v / (1e-3 * fast)),
        "square": lambda _, v: 15.0 * one.share * one.drag / fast * v * abs(v),
    }
    extra = hidden.get(population, lambda *_: 0.0)

    def rates(at: float, y: np.ndarray) -> list[float]:
        force = float(shaking(at)) - one.drag * y[1] - one.stiffness * y[0] - extra(y[0], y[1])
        return [y[1], force / one.mass]

    begin = [one.size if population == "decay" else 0.0, 0.0]
    stiff = population in ("dry", "decay")
    found = solve_ivp(
        rates, (0.0, float(t[-1])), begin, t_eval=t, rtol=1e-7, atol=1e-10 * one.size,
        max_step=0.5 * t[1] if stiff else np.inf,
    )  # fmt: skip
    return np.stack([t, found.y[0], shaking(t - late if population == "late" else t)])


def written(case: Case, folder: Path) -> Path:
    """Write record and spec of a campaign; returns the spec's path."""
    rng = np.random.default_rng([case.seed, list(RIGHT).index(case.population)])
    one = drawn(rng)
    t, x, force = simulated(case.population, one, rng)
    usual = force.std() or one.stiffness * x.std()
    loud = usual * 10.0 ** rng.uniform(-3.3, -2.0)
    x = x + 1e-4 * x.std() * 10.0 ** rng.uniform(-0.7, 0.3) * rng.standard_normal(len(t))
    force = force + loud * rng.standard_normal(len(t))
    rows = (f"{a:.9g},{b:.9g},{c:.9g}" for a, b, c in zip(t, x, force, strict=True))
    (folder / "swing.csv").write_text("\n".join(["t,x,F", *rows]) + "\n", "utf-8")
    mass = one.mass * np.exp(0.2 * rng.standard_normal())
    known = case.population == "decay"  # where no force acts, all of them grow together
    text = SPEC.format(
        mass=f"{{ fixed = {one.mass:.6g} }}" if known
        else f"{{ lognormal = {{ median = {mass:.4g}, factor = 1.3 }} }}",
        drag=one.drag * np.exp(0.8 * rng.standard_normal()),
        stiffness=one.stiffness * np.exp(0.3 * rng.standard_normal()),
        sheet=0.4 * loud * 10.0 ** rng.uniform(-0.1, 0.4), zero=0.01 * usual,
        corner=5.0 * one.frequency,
    )  # fmt: skip
    (folder / "swing.toml").write_text(text, "utf-8")
    return folder / "swing.toml"


def run(case: Case) -> dict:
    """Simulate a campaign and discover in it; the row of the study."""
    from rigid.io.errors import RigidError
    from rigid.study.study import load

    row = {"case": case._asdict(), "simulated": True}
    with tempfile.TemporaryDirectory() as folder:
        path, begun = written(case, Path(folder)), time.process_time()
        try:
            found = load(path).discover(quiet=True)
        except RigidError as error:
            return row | no_answer(error, Path(folder))
        result = found.result
        steps = [
            {"said": told["effect"] or called(step.hidden), "probability": told["probability"]}
            for told, step in zip(result["steps"], found.outcome.steps, strict=True)
        ]
        return row | {
            "verdict": result["verdict"], "steps": steps,
            "failed": [check.name for check in found.checks if not check.ok],
            "gap": [result["gap"]["initial"], result["gap"]["final"]],
            "core_s": round(time.process_time() - begun, 1),
        }  # fmt: skip


def called(inferred: Any) -> str:
    """Something unnamed in few words: "force over speed"."""
    hidden = getattr(inferred.hidden, "of", inferred.hidden)
    if hidden.sort == "input":
        return f"force over {hidden.variable}"
    return hidden.about.name


def said(row: dict) -> str:
    """What is said first."""
    return row["steps"][0]["said"] if row["steps"] else row["verdict"]


HEAD = """# What a measured motion lacks

Simulated oscillators of 1 to 100 kg, shaken or let go; populations stand apart. *Right*: what is
said first is the hidden cause, or another that leaves the same trace; of drag with the square of
the speed, which has no entry, a force over the speed without a name. Bounds are one-sided, 95 %,
after Clopper and Pearson. Of the checks that failed nearly all are those of residuals: what an
acceleration adds to the noise of the force stands on no sheet.

`{command}`, code of {commit} of {date}.

| hidden | campaigns | right first | at least | wrong name at 0.9 | said otherwise | {loud} | {gap} | {cost} |
|---|---|---|---|---|---|---|---|---|
"""  # noqa: E501
HEADINGS = {
    "loud": "residuals too large",
    "gap": "gap before, after, medians",
    "cost": "median, core-s",
}


def page(rows: Sequence[dict], told: Mapping[str, str]) -> str:
    """The table, a row a population."""
    lines = []
    for population, names in RIGHT.items():
        mine = [row for row in rows if row["case"]["population"] == population]
        if mine:
            lines.append("| " + " | ".join([population, *cells(mine, names)]) + " |")
    return HEAD.format(**told, **HEADINGS) + "\n".join([*lines, ""])


def cells(mine: Sequence[dict], names: set[str]) -> Iterator[str]:
    """What the table holds of the campaigns of a population; `names`: what is right."""
    right = sum(said(row) in names for row in mine)
    least = float(beta.ppf(0.05, right, len(mine) - right + 1)) if right else 0.0
    sure = [step["said"] for row in mine for step in row["steps"] if step["probability"] >= 0.9]
    other = Counter(said(row) for row in mine if said(row) not in names)
    before, after = (
        statistics.median(row["gap"][i] for row in mine if "gap" in row) for i in (0, 1)
    )
    yield from (str(len(mine)), str(right), f"{100 * least:.0f} %")
    yield str(sum(one in CATALOGUE and one not in names for one in sure))
    yield ", ".join(f"{name} {count}" for name, count in other.items()) or "-"
    yield str(sum("residuals" in row.get("failed", ()) for row in mine))
    yield f"{before:.3g}, {after:.3g}"
    yield f"{statistics.median(row.get('core_s', 0.0) for row in mine):.0f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=10, help="of each population")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("docs/studies/oscillators"))
    parser.add_argument("--page", action="store_true", help="write the page from what there is")
    asked = parser.parse_args()
    rows = asked.out.with_name(f"{asked.out.name}-{asked.first_seed}.jsonl")
    command = (
        f"python tests/studies/oscillators.py --campaigns {asked.campaigns} "
        f"--first-seed {asked.first_seed}"
    )
    if not asked.page:
        import rigid

        rigid.prepare()
        carry_out(rows, cases(asked.campaigns, asked.first_seed), run, said)
    one = of_one_commit(lines_of([rows]))
    told = {"command": command, "commit": one.commit, "date": one.date[:10]}
    asked.out.with_suffix(".md").write_text(page(one.rows, told), "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
