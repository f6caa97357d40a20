"""Functions of jobs that tests send to workers."""

import errno
import os
import signal
import time
from pathlib import Path

import numpy as np


def noise(given) -> dict:
    """Numbers of a seed, through linear algebra and a compiled program."""
    import jax.numpy as jnp

    draws = np.random.default_rng(given.arguments["seed"]).normal(size=(40, 40))
    return {
        "sum": float(np.linalg.inv(draws).sum()),
        "double": str(jnp.sin(jnp.asarray(draws)).dtype),
        "compiled": float(jnp.linalg.norm(jnp.exp(jnp.asarray(draws)))),
    }


def who(given) -> dict:
    """The process that does it, after a while."""
    time.sleep(given.arguments.get("wait", 0.0))
    return {"pid": os.getpid()}


def killed_once(given) -> dict:
    """Kill the worker at the first turn of the job that is told to."""
    mark = Path(given.arguments["mark"])
    if given.arguments["kills"] and not mark.exists():
        mark.write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": given.arguments["x"] ** 2}


def kills_always(given) -> dict:
    """Kill the worker whenever the job is one that does."""
    if given.arguments["kills"]:
        with Path(given.arguments["mark"]).open("a") as file:
            file.write(f"{os.getpid()}\n")
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.2)
    return {"square": given.arguments["x"] ** 2}


def refused(given) -> dict:
    """What a full disk says in the middle of a job."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), given.arguments["file"])


def fails(given) -> dict:
    """Fail in the way that is asked for."""
    from rigid.io.errors import InputError

    how = given.arguments["how"]
    if how == "input":
        raise InputError("spec.toml: k_LC is no number")
    if how == "defect":
        raise ZeroDivisionError("by zero")
    if how == "nan":
        return {"x": float("nan")}
    return {"x": 1.0}


def reads(given) -> dict:
    """Read the job's file and leave another."""
    path = given.path(given.arguments["path"])
    (given.out / "more").mkdir()
    (given.out / "more" / "copy.txt").write_text(path.read_text())
    (given.out / ".lock").write_text("")
    return {"content": path.read_text(), "elsewhere": str(path) != given.arguments["path"]}
