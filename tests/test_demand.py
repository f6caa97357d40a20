"""Memory and time that a fit takes: counted, told, and refused where the machine has less."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from cart import write_cart
from machines.loading import machine

import rigid
from rigid import check, fit
from rigid.inference import demand as counted
from rigid.inference.newton import is_noise, joined, local
from rigid.jobs import memory
from rigid.likelihood.problem import evaluate, walkers

HOUR = 3600.0


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    """A cart whose record is long enough for its arrays to be what fills memory."""
    return rigid.load(write_cart(tmp_path_factory.mktemp("long"), seconds=HOUR))


@pytest.fixture
def little(monkeypatch):
    """A machine with 100 MiB left."""
    monkeypatch.setattr(counted, "available", lambda: 100 << 20)


def taken(program, *given):
    """Bytes that a compiled program holds while it runs, as XLA has laid them out."""
    laid = program.lower(*given).compile().compiled.memory_analysis()
    return laid.temp_size_in_bytes


@pytest.mark.slow
def test_arrays_are_counted_as_the_compiler_lays_them_out(long):
    problem = long.problem
    size, noise = problem.parameters.size, is_noise(problem)
    w = jnp.asarray(joined(problem, np.zeros(size), np.zeros((len(problem.sensors), 2))))
    wide = walkers(problem) // 2
    cases = [
        (counted._local(problem), taken(local, problem, w, jnp.zeros(int(noise.sum())))),
        (
            counted._batch(problem, wide),
            taken(evaluate, problem, jnp.zeros((wide, size))),
        ),
    ]
    assert all(laid > 4 << 20 and 0.5 < told / laid < 2.0 for told, laid in cases), cases


@pytest.mark.slow
def test_states_of_a_machine_are_counted_as_it_has_them(tmp_path):
    problem = machine("press", tmp_path).question.problem
    (group,) = problem.groups
    values = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))
    built, *_ = group.inputs(values)
    assert counted._states(group) == len(built.scales)


@pytest.mark.slow
def test_more_of_anything_takes_more(long):
    rule = long.spec.sampler
    base = counted.demand(long.problem, rule, 2)
    assert base.most == "predictions beside the records"
    assert (
        counted.demand(long.problem, rule, 8).stages["derivatives of the search"]
        > (base.stages["derivatives of the search"])
    )
    chain = "the chain and its tables"
    many = counted.demand(long.problem, rule.model_copy(update={"ess": 1e6, "max_steps": 10**6}), 2)
    assert many.steps > 100 * base.steps
    assert many.most == "predictions beside the records"  # which are made while the chain is held
    assert many.stages[chain] > base.stages[chain] + many.steps * 32 * 4 * 8
    assert many.seconds > 10 * base.seconds


@pytest.mark.parametrize("as_json", [False, True])
def test_a_machine_with_too_little_refuses_before_anything_runs(tmp_path, capsys, little, as_json):
    path = write_cart(tmp_path)
    out = tmp_path / "out"
    assert fit.main([str(path), "--out", str(out)]) == 2
    says = capsys.readouterr().err
    assert f"{path}: a fit would hold about 0.68 GiB of memory" in says
    assert "most of it for predictions beside the records; 0.098 GiB are free" in says
    assert not out.exists()
    assert check.main([str(path), *(["--json"] if as_json else [])]) == 0
    found = capsys.readouterr().out
    takes = json.loads(found)["sampler"]["takes"] if as_json else found
    assert "a fit takes about" in takes
    assert "it would be refused" in takes


@pytest.mark.slow
def test_what_a_fit_takes_is_told_before_it_begins(tmp_path, capsys):
    assert fit.main([str(write_cart(tmp_path)), "--out", str(tmp_path / "out")]) == 0
    says = capsys.readouterr().err
    assert says.index("a fit takes about") < says.index("compile:")


def test_a_container_has_what_its_bounds_leave(tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "GROUP", tmp_path)
    whole = memory.available()
    (tmp_path / "memory.max").write_text("max\n")
    assert memory.available() > 0.5 * whole
    (tmp_path / "memory.max").write_text(f"{300 << 20}\n")
    (tmp_path / "memory.stat").write_text(f"anon {100 << 20}\nfile {150 << 20}\n")
    assert memory.available() == 200 << 20
