"""Several ensembles of walkers, advanced in blocks until they agree and hold enough draws."""

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rigid.inference import convergence
from rigid.inference.chain import Block, ChainShape
from rigid.inference.checkpoint import Checkpoint
from rigid.inference.ensemble import Ensemble
from rigid.inference.proposal import LogProb, MixtureProposal
from rigid.io.errors import InputError

Monitor = Callable[[NDArray[np.float64]], Mapping[str, NDArray[np.float64]]]

WARMUP = 4  # one block in four is dropped, the first ones, at least one
MONITORED_PER_BLOCK = 20_000  # draws of a block kept for the monitor: some MB for a hundred figures
MONITORED_DRAWS = 20_000  # draws a diagnosis looks at, or MONITORED_PER_ESS of each wanted one
MONITORED_PER_ESS = 6
MONITORED_STEPS = 64  # and no fewer steps of each walker, so that a chain can be cut in two
LATE = 50.0  # nats below every draw of the later half: a walker that was still under way


@dataclass(frozen=True)
class Settings:
    """How to sample and when to stop.

    - ensembles: independent groups of walkers, at least 2; walkers: in each, at least 2 d and 8
    - block: steps between two looks at the chain, at least 10; max_steps: where to give up
    - r_hat: limit; ess: bulk ESS to reach, the tail needs half of it
    - seed: of everything random in the chain; apart: every other ensemble begins away from the
      proposal, so that R-hat sees what it misses
    """

    ensembles: int = 8
    walkers: int = 64
    block: int = 100
    max_steps: int = 10_000
    r_hat: float = 1.01
    ess: float = 2_000.0
    seed: int = 1
    apart: bool = True


@dataclass(frozen=True)
class Status:
    """Where the run stands after a block; the figures are those of the last look at the chain.

    - r_hat, r_hat_name, ess, ess_name: worst R-hat and least bulk ESS; None before the first look
    - evaluations: likelihoods so far; acceptance: share of steps that moved, in the last block
    - seconds: spent sampling, earlier runs included
    """

    steps: int
    r_hat: float | None
    r_hat_name: str | None
    ess: float | None
    ess_name: str | None
    evaluations: int
    acceptance: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Draws:
    """The draws after warm-up, and how they came about.

    - z: (ensembles, steps, walkers, d); log_prob: (ensembles, steps, walkers)
    - warmup: steps dropped before them; acceptance: (ensembles,), share of kept steps that moved
    - evaluations, failed: points asked of the likelihood, and those without a finite value
    - converged, says: may they be used; if not, what is lacking and in which quantity
    - seconds: spent sampling, over all runs
    - weighed: whether walkers are parts of lots of weighted draws, resampled by their weights
    """

    z: NDArray[np.float64]
    log_prob: NDArray[np.float64]
    warmup: int
    acceptance: NDArray[np.float64]
    evaluations: int
    failed: int
    converged: bool
    says: str
    seconds: float
    weighed: bool = False

    def thinned(self, most: int) -> "Draws":
        """Every n-th step, with the least n that leaves at most `most` steps of each walker."""
        every = -(-self.z.shape[1] // most)
        last = slice((self.z.shape[1] - 1) % every, None, every)
        return replace(self, z=self.z[:, last], log_prob=self.log_prob[:, last])


def components(z: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """The components of z (n, d) by number, (n,) each."""
    return {f"z[{i}]": column for i, column in enumerate(z.T)}


def sample(
    log_prob: LogProb,
    proposal: MixtureProposal,
    settings: Settings,
    monitor: Monitor = components,
    checkpoint: Checkpoint | None = None,
    report: Callable[[Status], None] = lambda _: None,
) -> Draws:
    """Draw from the posterior until the stopping rule is met or `settings.max_steps` are done.

    - log_prob: (walkers // 2, d) -> (walkers // 2,), always that shape; called from several threads
    - proposal: where walkers begin and most of their steps come from
    - monitor: z (n, d), n the same at every call -> quantities (n,) by name that must have
      converged; left out: the components of z
    - checkpoint: open; takes each block, and what it holds is gone on with, proposal included
    - report: called after each block

    The result does not depend on the number of threads, nor on an interruption.

    Raises InputError for settings that cannot work, UnusableResultError when no start is found.
    """
    _check(settings, proposal.dimension)
    layout = _layout(settings, proposal.dimension)
    if checkpoint is not None:
        proposal = checkpoint.begin(layout, proposal)
    watch = _Watch(settings, proposal, monitor, report)
    for block in checkpoint.read() if checkpoint is not None else ():
        watch.add(block)
    ensemble = Ensemble(log_prob, proposal, layout)
    with ThreadPoolExecutor(min(settings.ensembles, cores())) as pool:
        over = watch.finished()
        while not over:
            block = _next_block(pool, ensemble, watch.blocks)
            if checkpoint is not None:
                checkpoint.append(block)
            watch.add(block)
            over = watch.finished()
            watch.tell()
    return watch.draws()


def cores() -> int:
    """Number of threads worth starting."""
    return os.cpu_count() or 1


def _check(settings: Settings, d: int) -> None:
    least = {"ensembles": 2, "walkers": max(2 * d, 8), "block": 10, "max_steps": 2 * settings.block}
    for key, bound in least.items():
        if getattr(settings, key) < bound:
            found, twice = getattr(settings, key), key == "walkers" and bound > 8
            why = f" (twice the {d} parameters)" if twice else ""
            raise InputError(f"[sampler] {key} = {found}: must be at least {bound}{why}")
    if settings.walkers % 2:
        raise InputError(f"[sampler] walkers = {settings.walkers}: must be even")


def _layout(settings: Settings, d: int) -> ChainShape:
    s = settings
    return ChainShape(s.ensembles, s.block, s.walkers, d, s.seed, s.apart)


def _next_block(pool: ThreadPoolExecutor, ensemble: Ensemble, done: list[Block]) -> Block:
    began = time.perf_counter()
    n = ensemble.layout.ensembles
    before = [part.state for part in done[-1].ensembles] if done else [None] * n
    tasks = [pool.submit(ensemble.block, i, before[i]) for i in range(n)]
    try:
        parts = tuple(task.result() for task in tasks)
    except BaseException:
        ensemble.stop.set()
        for task in tasks:
            task.cancel()
        raise
    return Block(parts, time.perf_counter() - began)


class _Watch:
    """The blocks so far, what they say about convergence, and whether to go on."""

    def __init__(
        self,
        settings: Settings,
        proposal: MixtureProposal,
        monitor: Monitor,
        report: Callable[[Status], None],
    ) -> None:
        self.settings, self.proposal = settings, proposal
        self.monitor, self.report = monitor, report
        self.blocks: list[Block] = []
        self.watched: list[NDArray[np.float64]] = []  # (ensembles, steps, walkers, quantities)
        self.modes: list[NDArray[np.intp]] = []
        self.names: tuple[str, ...] = ()
        self.found: list[convergence.Diagnosis] = []
        self.says: list[str] = []

    @property
    def steps(self) -> int:
        return len(self.blocks) * self.settings.block

    @property
    def dropped(self) -> int:
        """Blocks of warm-up."""
        return max(1, -(-len(self.blocks) // WARMUP))

    def add(self, block: Block) -> None:
        """Take in a block and the monitored quantities of some of its draws."""
        self.blocks.append(block)
        e, w, d = self.settings.ensembles, self.settings.walkers, self.proposal.dimension
        every = max(1, -(-e * w * self.settings.block // MONITORED_PER_BLOCK))
        z = np.stack([part.z[::every] for part in block.ensembles])
        flat = z.reshape(-1, d)
        seen = self.monitor(flat)
        self.names = tuple(seen)
        columns = np.stack([np.asarray(v, dtype=float) for v in seen.values()], axis=1)
        self.watched.append(columns.reshape(e, -1, w, len(self.names)))
        self.modes.append(self.proposal.mode_of(flat).reshape(e, -1, w))

    def finished(self) -> bool:
        """Look at the chain if it is time to, and say whether to stop."""
        over = self.steps >= self.settings.max_steps
        if not over and not _time_to_look(len(self.blocks)):
            return False
        self._look()
        return over or not self.says

    def _look(self) -> None:
        values = np.concatenate(self.watched[self.dropped :], axis=1)
        modes = np.concatenate(self.modes[self.dropped :], axis=1)
        chains = self.settings.ensembles * self.settings.walkers
        most = max(MONITORED_DRAWS, int(MONITORED_PER_ESS * self.settings.ess))
        every = max(1, values.shape[1] // max(MONITORED_STEPS, most // chains))
        values, modes = values[:, ::every], modes[:, ::every]
        several = modes if len(self.proposal.modes) > 1 else None
        self.found = [
            convergence.diagnose(name, values[..., i], several) for i, name in enumerate(self.names)
        ]
        limits = self.settings.r_hat, self.settings.ess
        self.says = self._stuck() + self._late() + convergence.lacking(self.found, *limits)

    def _stuck(self) -> list[str]:
        kept = self.blocks[self.dropped :]
        moved = np.sum([[part.accepted for part in block.ensembles] for block in kept], axis=0)
        stuck = int(np.sum(moved == 0))
        return [f"{stuck} walker(s) have not moved since the warm-up"] if stuck else []

    def _late(self) -> list[str]:
        """Walkers that came in when draws counted already: the ranks of R-hat do not see a few."""
        kept = self.blocks[self.dropped :]
        levels = np.concatenate([[part.log_prob for part in b.ensembles] for b in kept], axis=1)
        early, later = np.array_split(levels, 2, axis=1)
        late = int(np.sum(np.any(early < later.min() - LATE, axis=1)))
        return [f"{late} walker(s) were still on the way to the posterior"] if late else []

    def tell(self) -> None:
        """Report where the run stands."""
        r_hat = convergence.worst_r_hat(self.found)
        ess = convergence.least_ess(self.found)
        parts = self.blocks[-1].ensembles
        self.report(
            Status(
                steps=self.steps,
                r_hat=r_hat.r_hat if r_hat else None,
                r_hat_name=r_hat.name if r_hat else None,
                ess=ess.ess_bulk if ess else None,
                ess_name=ess.name if ess else None,
                evaluations=self._total("evaluations"),
                acceptance=float(np.mean([p.accepted for p in parts])) / self.settings.block,
                seconds=sum(block.seconds for block in self.blocks),
            )
        )

    def _total(self, count: str) -> int:
        return sum(getattr(part, count) for block in self.blocks for part in block.ensembles)

    def draws(self) -> Draws:
        """Everything after the warm-up, with the verdict."""
        kept = self.blocks[self.dropped :]
        n = self.settings.ensembles
        parts = [[block.ensembles[i] for block in kept] for i in range(n)]
        moved = np.array([np.mean([part.accepted for part in row]) for row in parts])
        says = f"after {self.steps} steps: " + ("; ".join(self.says) or "converged")
        return Draws(
            z=np.stack([np.concatenate([part.z for part in row]) for row in parts]),
            log_prob=np.stack([np.concatenate([part.log_prob for part in row]) for row in parts]),
            warmup=self.dropped * self.settings.block,
            acceptance=moved / self.settings.block,
            evaluations=self._total("evaluations"),
            failed=self._total("failed"),
            converged=not self.says,
            says=says,
            seconds=sum(block.seconds for block in self.blocks),
        )


def _time_to_look(blocks: int) -> bool:
    """After each of the first blocks, then whenever the chain has grown by a tenth.

    By the number of blocks alone: a resumed run looks where an uninterrupted one does.
    """
    look = 2
    while look < blocks:
        look = max(look + 1, int(1.1 * look))
    return look == blocks
