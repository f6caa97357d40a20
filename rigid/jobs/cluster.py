"""Jobs on the workers of a Dask scheduler, what is sent to them and what to do when they die.

Only text and the content of files travel, and only when a worker lacks them. A job in whose turn
workers died again and again may be the cause or a neighbour: it is taken out, and tried once more
when nothing else runs. If its worker dies then too, the job is named as what kills workers.
"""

import json
import logging
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from rigid.io.errors import EnvironmentFaultError
from rigid.io.version import __version__
from rigid.jobs.work import Done, carry_out

if TYPE_CHECKING:
    from distributed import Client, Future

LIVES = 1
"""Workers of this machine that may die in a job's turn before it is taken out, less one."""
AHEAD = 16
"""Jobs that the scheduler holds beyond those that run: no worker waits for the next one."""
LOOK_S = 2.0
"""How often workers are counted while nothing ends [s]."""
PATIENCE_S = 600.0
"""How long all workers may be gone before the run ends [s]; a batch system may take minutes to
start others."""
CONNECT_S = 30.0
"""How long a scheduler may take to answer [s]."""


class Order(NamedTuple):
    """A job as the scheduler gets it.

    - `name`; `text`: what is ordered. - `contents`: gives the files, where they have to be sent.
    """

    name: str
    text: str
    contents: Callable[[], dict[str, bytes]]


@contextmanager
def client_of(workers: int | str) -> Iterator["Client"]:
    """Connect to a scheduler by its address, or start so many worker processes here.

    Raises EnvironmentFaultError where Dask is not installed or no scheduler answers.
    """
    try:
        from dask.config import set as configured
        from distributed import Client, LocalCluster
    except ImportError:
        raise EnvironmentFaultError(
            "--workers takes Dask, which is not installed here; run pip install with the package's "
            "extra 'cluster', or pip install distributed"
        ) from None
    if isinstance(workers, str):
        try:
            client = Client(workers, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise EnvironmentFaultError(
                f"--workers {workers}: no Dask scheduler answers there ({error}); start one with "
                "'dask scheduler' and give the address that it prints"
            ) from None
        with client:
            yield client
        return
    settings = {
        "distributed.scheduler.allowed-failures": LIVES,
        # as in this process: how many threads linear algebra has can move last bits
        "distributed.nanny.pre-spawn-environ": {},
    }
    with (
        configured(settings),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=0,  # workers let go of programs themselves; a paused one would never end
            dashboard_address=":0",  # any port: the usual one may be another run's
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


def over(client: "Client", orders: list[Order]) -> Iterator[tuple[str, Done, int]]:
    """Give name and outcome of each job as it ends, and the number of workers.

    Raises EnvironmentFaultError when scheduler or all workers are gone.
    """
    yield from _Crowd(client, orders).ends()


class _Crowd:
    """The jobs of a run: those that wait, those that the scheduler has, those under suspicion."""

    def __init__(self, client: "Client", orders: list[Order]):
        self.client = client
        self.run = uuid.uuid4().hex[:8]
        self.waiting, self.suspects = deque(orders), deque[Order]()
        self.flying: dict[Future, tuple[Order, bool]] = {}
        self.seen, self.count = time.monotonic(), 0

    def ends(self) -> Iterator[tuple[str, Done, int]]:
        while self.waiting or self.suspects or self.flying:
            self._count()
            while self.waiting and len(self.flying) < self.count + AHEAD:
                self._submit(self.waiting.popleft())
            if not self.flying and self.suspects:
                self._submit(self.suspects.popleft(), alone=True)
            for future in self._ended():
                order, alone = self.flying.pop(future)
                done = self._outcome(future, order, alone)
                future.release()
                if done is not None:
                    yield order.name, done, self.count

    def _count(self) -> None:
        """Count the workers, and lose patience where there have been none for long."""
        try:
            found: Any = self.client.nthreads()
            threads = sum(found.values())
        except (OSError, ValueError, TimeoutError) as error:
            raise self._gone(f"the scheduler is gone ({error})") from None
        if threads or not self.count:  # a batch system's first workers may be hours away
            self.seen = time.monotonic()
        elif time.monotonic() - self.seen > PATIENCE_S:
            raise self._gone(f"all workers are gone, for {PATIENCE_S:.0f} s now")
        self.count = threads or self.count

    def _gone(self, says: str) -> EnvironmentFaultError:
        return EnvironmentFaultError(f"{says}; what is done is kept, --resume goes on")

    def _submit(self, order: Order, alone: bool = False, send: bool = False) -> None:
        contents = order.contents() if send else None
        key = f"rigid-{self.run}-{order.name}-{uuid.uuid4().hex[:8]}"
        future = self.client.submit(
            carry_out, order.text, __version__, contents, key=key, pure=False
        )
        self.flying[future] = order, alone

    def _ended(self) -> list["Future"]:
        from distributed import wait

        with self.client.as_current(), suppress(TimeoutError):
            wait(list(self.flying), timeout=LOOK_S, return_when="FIRST_COMPLETED")
        return [future for future in self.flying if future.status != "pending"]

    def _outcome(self, future: "Future", order: Order, alone: bool) -> Done | None:
        """What a job gave; None where it goes back to the scheduler or under suspicion."""
        if future.status == "finished":
            done = Done(*future.result())
            if "needs" not in json.loads(done.text):
                return done
            self._submit(order, alone, send=True)
            return None
        if future.status != "error":  # cancelled or lost: the scheduler's doing, not the job's
            if self.client.status != "running":
                raise self._gone("the scheduler is gone")
            self._submit(order, alone)
            return None
        error = future.exception()
        killed = type(error).__name__ == "KilledWorker"
        if killed and not alone:
            self.suspects.append(order)
            return None
        says = (
            "every worker process that took this job died, the last time with no other job about; "
            "it was set aside"
            if killed
            else f"{type(error).__name__}: {error}"
        )
        failed = {"status": 3, "says": says, "killed_workers": killed}
        return Done(json.dumps({"failed": failed, "cost": {"cpu_s": None, "wall_s": None}}), {})
