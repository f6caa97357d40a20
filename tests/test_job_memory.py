"""Compiled programs of a process that computes for long are let go in time."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rigid.jobs import memory


@pytest.mark.skipif(not memory.MAPS.exists(), reason="no list of mapped memory on this system")
@pytest.mark.parametrize("bound", ["MOST_MAPS", "MOST_MEMORY"])
def test_compiled_programs_are_let_go_where_they_fill_their_room(monkeypatch, bound: str):
    program = jax.jit(lambda x: jnp.cumsum(x))
    for size in range(3, 20):
        program(jnp.ones(size))
    held = memory.resident()
    assert held > 1 << 20
    for roomy in ("MOST_MAPS", "MOST_MEMORY"):  # tests before this one may have filled the process
        monkeypatch.setattr(memory, roomy, 1 << 40)
    assert not memory.shed(held)
    assert program._cache_size() == 17
    monkeypatch.setattr(memory, bound, -(1 << 40))  # memory may also have shrunk since
    assert memory.shed(held)
    assert program._cache_size() == 0


@pytest.mark.skipif(not memory.STATM.exists(), reason="memory of a process is not told here")
def test_memory_between_what_is_still_held_goes_back_to_the_system():
    """Blocks too small to be mapped one by one: half a gigabyte, of which one in fifty stays."""
    size, count = 64 << 10, 8_000
    blocks = [np.ones(size, dtype=np.uint8) for _ in range(count)]
    full = memory.resident()
    kept = blocks[::50]
    del blocks
    memory.give_back()
    assert len(kept) == count // 50
    assert full - memory.resident() > 0.8 * size * count
