"""Discovery asked of clean campaigns that are drawn from a spec: a job each."""

from dataclasses import replace
from typing import Any

from rigid.io.cli import Options
from rigid.jobs.job import Given, Job
from rigid.jobs.run import run, told
from rigid.spec import Spec
from rigid.study.discovery import Question, answer, candidates
from rigid.validation.alarms import Alarms, alarms
from rigid.validation.campaign import Base, draw, read_base
from rigid.validation.design import FAST, Design, arguments, read_arguments


def one(given: Given) -> dict[str, Any]:
    """Draw the campaign of a job and ask discovery what is missing from it.

    Returns the `verdict`, what was `blamed` (None: nothing, or nothing with a name), its
    `probability`, and how many draws the readers `refused` before.
    """
    spec, design, number = read_arguments(given)
    made = draw(read_base(spec, design.around), design, number)
    asked = Question(spec, made.records, made.problem, candidates(spec, made.problem))
    options = Options(str(spec.path), None, design.seed, resume=False, quiet=True, as_json=False)
    outcome = answer(asked, design.seed, options, _itself).outcome
    step = outcome.steps[0] if outcome.steps else None
    return {
        "number": number,
        "verdict": outcome.verdict,
        "blamed": None if step is None else step.chosen,
        "probability": {k: round(float(v), 3) for k, v in step.probability.items()} if step else {},
        "refused": made.refused,
    }


def _itself(spec: Spec) -> Spec:
    return spec


def count_alarms(base: Base, count: int, design: Design, options: Options) -> Alarms:
    """Ask discovery of clean campaigns that have no row yet, and count what it found missing.

    - `count`: campaigns, the same as the first replicates of `design`. - `options`: as of
      `rigid.study.validation.validate`; rows lie beside those of the replicates.
    """
    design = replace(design, fit=FAST)
    name = design.name.replace("fast", "discover")
    files = tuple(dict.fromkeys(r.path.absolute() for r in base.records))
    jobs = [
        Job(f"{name}-{number}", arguments(base.spec, design, number), files)
        for number in range(count)
    ]
    rows = None if options.out is None else options.out / f"{name}.jsonl"
    with told(options, "discover what is missing from clean campaigns", count) as report:
        return alarms(
            list(run(one, jobs, options.workers, rows, resume=options.resume, report=report))
        )
