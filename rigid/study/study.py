"""A study: a spec with its records, and what can be asked of them."""

import contextlib
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import jax
import xarray as xr
from jax import Array
from jax.typing import ArrayLike

from rigid.friction.models import place_of, without_friction
from rigid.inference.calibrate import Asked, Listener, calibrate
from rigid.inference.demand import demand
from rigid.inference.search import Found
from rigid.inference.solver_choice import left_open, with_solver
from rigid.inference.summary import write_result_json
from rigid.io.cli import Options
from rigid.io.errors import InputError, together
from rigid.io.files import locked
from rigid.io.progress import WRITE, say, stage
from rigid.io.provenance import running
from rigid.likelihood.assemble import assemble, chosen_effects
from rigid.likelihood.listing import given_priors
from rigid.likelihood.problem import Problem
from rigid.records.read import read_records
from rigid.records.record import Record
from rigid.report.calibration import preliminary
from rigid.spec import Spec, find_spec, load_spec
from rigid.spec.opening import require_none_of_its_own
from rigid.spec.write import build_spec
from rigid.study.bands import Written, bands, smoothing, write_all
from rigid.study.check import Checked
from rigid.study.density import LogPosterior
from rigid.study.discovery import Discovery, Question, answer, candidates
from rigid.study.fit import Fit
from rigid.study.laws import Laws, compare_laws
from rigid.study.parted import Parted, part
from rigid.study.plan import Plan, plan
from rigid.study.result import held_folder
from rigid.study.simulation import Readings, simulate
from rigid.study.validation import Replicates, Validation, validate
from rigid.validation.campaign import Base

Result = TypeVar("Result", Discovery, Laws, Plan, Parted, Validation)


@dataclass(frozen=True, eq=False)
class Study:
    """A spec with its records; each method is what the command of its name does.

    - `spec`: as `rigid.load` reads it.

    Records are read and the model is put together when they are first needed. Methods that take
    `seed`, `resume` and `quiet` mean by them what the commands' options do; `out` is a folder for
    all files that the command writes, None: nothing is written.
    """

    spec: Spec

    @cached_property
    def records(self) -> tuple[Record, ...]:
        """The records that are fitted, read and checked.

        Raises InputError where a file is not what the spec says; effects and laws that are not
        known are told along with it.
        """
        model = (partial(chosen_effects, self.spec), partial(given_priors, self.spec))
        return together(*model, partial(read_records, self.spec))[-1]

    @property
    def solved(self) -> Spec:
        """The spec with what solves it: for an effect of the user's own, steps only if they hold.

        Asking that takes some seconds to a minute, and the answer is told on standard error.
        """
        return self._solved[0]

    @property
    def problem(self) -> Problem:
        """Model, priors and data put together."""
        return self._solved[1]

    @cached_property
    def _solved(self) -> tuple[Spec, Problem]:
        with jax.ensure_compile_time_eval():  # kept beyond the trace that may be under way
            problem = assemble(self.spec, self.records)
            if not left_open(self.spec, problem):
                return self.spec, problem
            solved = with_solver(self.spec, problem)
        sys.stderr.write(f"{solved.why_solver}\n")
        full = solved.solve.method == "diffrax"
        return solved, problem.with_tolerance(solved.solve.tolerance) if full else problem

    @property
    def _asked(self) -> Asked:
        return Asked(self.solved, self.records, self.problem)

    @cached_property
    def log_posterior(self) -> LogPosterior:
        """Log-posterior density as a function of a vector z."""
        return LogPosterior(self.problem)

    @property
    def names(self) -> tuple[str, ...]:
        """Labels of the uncertain numbers, in the order of z."""
        return self.problem.parameters.labels

    @property
    def units(self) -> dict[str, str]:
        """SI unit of every uncertain number, by label."""
        return {p.label: p.unit for p in self.problem.parameters.sampled}

    @property
    def times(self) -> dict[str, Array]:
        """Sample times [s] of every record by "record,cylinder", (samples,)."""
        return {track.label: jax.numpy.asarray(track.times) for track in self.problem.tracks}

    def simulate(self, values: Mapping[str, ArrayLike], key: Array | None = None) -> Readings:
        """Return what all sensors read, by "record,cylinder" and quantity, (samples,) in SI.

        - `values`: SI scalars by label, as `log_posterior.values(z)` or a posterior has them; those
          left out are at their prior medians. `gain[load,A]`, `zero[load,A]` correct a sensor.
        - `key`: of random numbers, for noise and rounding; None: as an ideal sensor reads.

        Compiled; to be differentiated by the values and mapped over them.

        Raises InputError for labels that nothing answers to.
        """
        return simulate(self.problem, values, key)

    def fit(
        self,
        out: Path | str | None = None,
        *,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
    ) -> Fit:
        """Fit the spec to its records.

        Raises InputError for a spec of published numbers and where the machine has not the memory,
        EnvironmentFaultError where the folder cannot be used.
        """
        if self.spec.published is not None:
            raise InputError(
                f"{self.spec.path}: has [published] numbers; `python -m rigid.fit` takes them"
            )
        began = time.monotonic()
        options = self._options(out, seed, resume, quiet)
        problem = self.problem  # what is wrong with records shows before a folder is made
        takes = demand(problem, self.solved.sampler)
        takes.require_room(self.spec.path)
        say(quiet, takes.says)
        with self._running("fit"), held_folder(options) as folder:
            done = calibrate(self._asked, options, folder, self._first(options, began))
            found = Fit(self.solved, done, time.monotonic() - began)
            if out is not None:
                with stage(quiet, WRITE):
                    found.write(folder)
        return found

    def bands(
        self,
        fit: Fit | xr.DataTree | None = None,
        record: str | None = None,
        *,
        seed: int | None = None,
        quiet: bool = False,
    ) -> xr.Dataset:
        """Return ice load and motion of a field record with bands: quantiles over time, in SI.

        - `fit`: whose posterior is taken, or a posterior as read from posterior.nc; None: those
          that the spec names in [bands].
        - `record`: name of the field record; None where the spec has one alone.

        Raises InputError where there is no posterior or no such record.
        """
        options = self._options(None, seed, False, quiet)
        posterior = fit.posterior if isinstance(fit, Fit) else fit
        return bands(self.spec, posterior, record, self._seed(seed), options)

    def write_bands(
        self,
        out: Path | str,
        *,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
    ) -> Written:
        """Make the bands of every field record and write all files of the command.

        Raises InputError where the spec names no posterior, or one that is of another rig.
        """
        options = self._options(out, seed, resume, quiet)
        given = () if self.spec.bands is None else self.spec.bands.sources
        named = ", ".join(str(path) for path, _ in given) or "not named"
        say(options.quiet, f"spec {self.spec.path}: posterior {named}")
        asked = smoothing(self.spec, self._seed(seed))
        with self._running("write_bands"), held_folder(options) as folder:
            return write_all(asked, folder, options)

    @cached_property
    def question(self) -> Question:
        """What `discover` asks: records, problem, and the effects that could be missing.

        Raises InputError for candidates that nothing answers to.
        """
        spec, problem = self.solved, self.problem
        return Question(spec, self.records, problem, candidates(spec, problem))

    def discover(
        self,
        out: Path | str | None = None,
        *,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
    ) -> "Discovery[Study]":
        """Find where model and records disagree, name the missing effect and add it."""
        options, asked = self._options(out, seed, resume, quiet), self.question
        return self._written(
            "discover", options, lambda: answer(asked, self._seed(seed), options, Study)
        )

    def laws(
        self,
        out: Path | str | None = None,
        *,
        joint: str | None = None,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
    ) -> Laws:
        """Compare the friction models.

        - `joint`: of a machine that the spec puts together, where they are compared; None: the only
          one that rubs.

        Raises InputError for a joint that is not there, or where it must be said which is meant.
        """
        place = place_of(self.solved, joint)
        options = self._options(out, seed, resume, quiet)
        problem = assemble(without_friction(self.solved, place), self.records)
        asked = self.solved, self.records, problem, place, self._seed(seed), options
        return self._written("laws", options, lambda: compare_laws(*asked))

    def plan(
        self,
        quantities: tuple[str, ...] = (),
        out: Path | str | None = None,
        *,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
    ) -> Plan:
        """Rank records that could be taken next by what each would tell.

        - `quantities`: names in a fit's table, `k_LC` or `abs_mu[80 Hz]`, the first of which ranks;
          empty: those of the spec's [plan], or the usual ones.

        Raises InputError for a quantity, a record or a setting that is not there.
        """
        options = self._options(out, seed, resume, quiet)
        asked = self._asked
        with self._running("plan"), held_folder(options) as folder:
            found = plan(asked, quantities, self._seed(seed), options, folder)
            if out is not None:
                with stage(quiet, WRITE):
                    found.write(folder)
        return found

    def plan_between(
        self,
        first: str,
        other: str,
        out: Path | str | None = None,
        *,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
    ) -> Parted:
        """Rank records that could be taken next by how far each parts two effects.

        - `first`, `other`: names of effects that the model lacks.

        Raises InputError for an effect that could not be missing, or a record or a setting that is
        not there.
        """
        options, names = self._options(out, seed, resume, quiet), (first, other)
        asked = self.question
        return self._written("plan", options, lambda: part(asked, names, self._seed(seed), options))

    def validate(
        self,
        asked: Replicates | None = None,
        out: Path | str | None = None,
        *,
        seed: int | None = None,
        resume: bool = False,
        quiet: bool = False,
        workers: int | str | None = None,
    ) -> Validation:
        """Draw campaigns from this spec, fit them, and test what the posteriors say of the truths.

        - `asked`: how many, fitted how; None: 100, fast. - `workers`: processes to start, or the
          address of a Dask scheduler; None: this process.

        Raises InputError for a spec without records of its own to draw.
        """
        if self.spec.published is not None:
            raise InputError(f"{self.spec.path}: has [published] numbers and no records to draw")
        options = replace(self._options(out, seed, resume, quiet), workers=workers)
        base = Base(self.solved, self.records, self.problem)
        given = base, asked or Replicates(), self._seed(seed), options
        return self._written("validate", options, lambda: validate(*given))

    def check(self) -> Checked:
        """Return what a fit would do: records, parameters with their priors, sampler.

        Raises InputError where spec or records are at fault.
        """
        fitted = self.spec.published is None and any(r.fit for r in self.spec.records)
        if not fitted:
            return Checked(self.spec, (), None)
        return Checked(self.solved, self.records, self.problem)

    def _written(self, method: str, options: Options, find: Callable[[], Result]) -> Result:
        """Return what a method finds, its files written where the options name a folder."""
        held = contextlib.nullcontext() if options.out is None else locked(options.out)
        with self._running(method), held:
            found = find()
            if options.out is not None:
                with stage(options.quiet, WRITE):
                    found.write(options.out)
        return found

    def _running(self, method: str) -> contextlib.AbstractContextManager[None]:
        """Say for the report which method was called, unless a command says what it is."""
        return running(f"rigid.load({self.spec.path.name!r}).{method}(...)")

    def _seed(self, given: int | None) -> int:
        return self.spec.sampler.seed if given is None else given

    def _first(self, options: Options, began: float) -> Listener:
        """What is done with what the search of a fit finds: the first answer."""
        seed = self._seed(options.seed)

        def first(found: Found) -> None:
            answer = preliminary.preliminary(self.spec, found, seed, began)
            say(options.quiet, preliminary.table(answer))
            if options.out is not None:
                write_result_json(options.out / "result.json", answer)

        def searched(found: Found, told: Found | None) -> None:
            if told is None or not preliminary.stands(told, found):
                first(found)
            if (doubt := preliminary.doubt(self.spec, found, seed)) is not None:
                say(options.quiet, doubt)

        return Listener(first, searched)

    def _options(
        self, out: Path | str | None, seed: int | None, resume: bool, quiet: bool
    ) -> Options:
        where = None if out is None else Path(out)
        return Options(str(self.spec.path), where, seed, resume, quiet, as_json=False)


def load(name: Path | str, *, own_code: bool = True) -> Study:
    """Return the study of a spec: a path, NAME of ./fits/NAME.toml, or a shipped example.

    - `own_code`: False refuses a spec that runs code of its own (`module:Class`).

    Raises InputError where there is no such spec, with one line for each mistake in it.
    """
    spec = load_spec(find_spec(str(name)))
    if not own_code:
        require_none_of_its_own(spec)
    return Study(spec)


def build(name: str, folder: Path | str = ".", **tables: Any) -> Study:
    """Return a study made of values in place of a file.

    - `name`: of the spec. - `folder`: from which files are named.
    - `tables`: `records`, `rig`, `model`, `priors`, `sensors`, `channels`, `sampler`, `bands`,
      `title`, `simulated`, as a spec has them: `rigid.Record(...)`, `rigid.Rig(...)`, or plain
      tables.

    Raises InputError with one line for each mistake.
    """
    return Study(build_spec(name, Path(folder), tables))
