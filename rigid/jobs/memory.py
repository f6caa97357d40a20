"""Memory that is free, and that of a process that computes for long: programs that fill it go."""

import ctypes
import gc
import os
from pathlib import Path

import psutil

MAPS, STATM = Path("/proc/self/maps"), Path("/proc/self/statm")
GROUP = Path("/sys/fs/cgroup")
"""Where Linux says what a container may hold."""
MOST_MAPS = 50_000
"""Mapped regions of memory beyond which compiled programs are let go; Linux grants 65,530, and a
process that has compiled for some forty campaigns of unlike records comes to its end there."""
MOST_MEMORY = 4 << 30
"""Bytes by which a process may grow before they are let go: two that had run some forty campaigns
each held 8 and 9 GB, and one was killed."""


def resident() -> int:
    """Bytes of memory that the process holds; 0 where that is not told."""
    return int(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if STATM.exists() else 0


def available() -> int:
    """Bytes of memory that a process can still take, within the bounds of its container."""
    free = psutil.virtual_memory().available
    bound = GROUP / "memory.max"
    if not bound.exists() or (most := bound.read_text().strip()) == "max":
        return free
    held = dict(line.split() for line in (GROUP / "memory.stat").read_text().splitlines())
    return min(free, max(int(most) - int(held["anon"]), 0))


def shed(held: int) -> bool:
    """Let go of compiled programs where they fill the room for them; say whether it was so.

    - `held`: bytes of memory that the process held when it had none.
    """
    crowded = MAPS.exists() and MAPS.read_bytes().count(b"\n") >= MOST_MAPS
    if not crowded and resident() - held < MOST_MEMORY:
        return False
    from rigid.io.compiled import forget

    forget()
    give_back()
    return True


def give_back() -> None:
    """Hand memory that is free back to the system, where the C library can.

    It keeps what it has had otherwise: a process of 1.0 GB that lets go of its programs holds as
    much after that, and 0.3 GB after this.
    """
    gc.collect()
    if STATM.exists():
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)
