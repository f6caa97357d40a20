"""The chain on disk: going on with it, and what is refused."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from targets import gaussian

from rigid.inference import sample
from rigid.inference.checkpoint import FOLDER, Checkpoint
from rigid.inference.sample import Settings
from rigid.io import files
from rigid.io.errors import EnvironmentFaultError, InputError
from rigid.io.files import locked, replacing, write_text

SETTINGS = Settings(ensembles=2, walkers=8, block=20, max_steps=240, ess=1e6, seed=4)
PRINTS = {"spec": "aa", "record frame-1": "bb", "rigid": "0.1.0"}


def target(z):
    log_prob, _, _, _ = gaussian()
    return log_prob(z)


def go(directory, settings=SETTINGS, resume=True, log_prob=target, report=None, prints=PRINTS):
    _, proposal, _, _ = gaussian()
    extra = {} if report is None else {"report": report}
    checkpoint = Checkpoint(directory, prints, resume=resume)
    return sample.sample(log_prob, proposal, settings, checkpoint=checkpoint, **extra)


def same(one, two):
    assert one.z.tobytes() == two.z.tobytes()
    assert one.log_prob.tobytes() == two.log_prob.tobytes()
    assert one.acceptance.tobytes() == two.acceptance.tobytes()
    left = (one.warmup, one.evaluations, one.failed, one.converged, one.says)
    assert left == (two.warmup, two.evaluations, two.failed, two.converged, two.says)


@pytest.fixture(scope="module")
def whole():
    """The chain drawn in one go, without a file."""
    _, proposal, _, _ = gaussian()
    return sample.sample(target, proposal, SETTINGS)


def stops(at):
    def report(status):
        if status.steps == at:
            raise KeyboardInterrupt

    return report


def test_a_file_changes_nothing(tmp_path, whole):
    same(go(tmp_path), whole)


def test_a_resumed_chain_is_the_uninterrupted_one(tmp_path, whole):
    for at in (20, 60, 180, 220):
        with pytest.raises(KeyboardInterrupt):
            go(tmp_path, report=stops(at))
    same(go(tmp_path), whole)
    same(go(tmp_path), whole)  # and a chain that has ended is only read


def test_an_interruption_within_a_block_leaves_the_last_complete_one(tmp_path, whole):
    calls = []

    def interrupted(z):
        calls.append(len(z))
        if len(calls) == 500:
            raise KeyboardInterrupt
        return target(z)

    with pytest.raises(KeyboardInterrupt):
        go(tmp_path, log_prob=interrupted)
    assert 0 < blocks(tmp_path) < 12
    same(go(tmp_path), whole)


KILLED = """
import sys, time
sys.path[:0] = {paths!r}
from test_checkpoint import go, target

def slow(z):
    time.sleep(3e-3)
    return target(z)

go({directory!r}, log_prob=slow)
"""


def test_a_killed_run_can_be_resumed(tmp_path, whole):
    here = Path(__file__).parent
    code = KILLED.format(paths=[str(here.parent), str(here)], directory=str(tmp_path))
    process = subprocess.Popen([sys.executable, "-c", code])
    began = time.monotonic()
    while blocks(tmp_path) < 3:  # killed while it draws or writes, wherever it is
        assert process.poll() is None
        assert time.monotonic() - began < 100
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert 3 <= blocks(tmp_path) < 12
    same(go(tmp_path), whole)
    assert all(path.suffix == ".kept" for path in (tmp_path / FOLDER).iterdir())


def blocks(path):
    """Complete blocks."""
    return len(list((path / FOLDER).glob("block-*.kept")))


@pytest.mark.parametrize("name", ["block-000002", "block-000004", "begin"])
def test_a_damaged_entry_is_told_and_set_aside_and_the_chain_is_the_same(
    tmp_path, whole, capsys, name
):
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path, report=stops(100))
    path = tmp_path / FOLDER / f"{name}.kept"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    same(go(tmp_path), whole)
    assert f"{path}: damaged (its SHA-256" in capsys.readouterr().err
    assert path.with_name(f"{name}.kept.damaged").read_bytes() == bytes(content)


def test_a_fault_while_writing_leaves_the_block_out(tmp_path, whole, monkeypatch):
    real = files.fsync
    count = []

    def full(path):
        count.append(path)
        if len(count) == 9:  # two for each entry: the numbers of the fourth block are not yet safe
            raise OSError(28, "No space left on device")
        real(path)

    monkeypatch.setattr(files, "fsync", full)
    with pytest.raises(EnvironmentFaultError, match=r"No space left.*free some space.*--resume"):
        go(tmp_path)
    monkeypatch.undo()
    assert blocks(tmp_path) == 3
    same(go(tmp_path), whole)


def test_without_resume_a_chain_begins_anew(tmp_path, whole):
    go(tmp_path, settings=replace(SETTINGS, seed=9, max_steps=60))
    same(go(tmp_path, resume=False), whole)


def test_a_tighter_rule_goes_on_with_the_chain(tmp_path, whole):
    loose = go(tmp_path, settings=replace(SETTINGS, ess=50.0, r_hat=1.2))
    assert loose.converged
    assert loose.evaluations < whole.evaluations
    same(go(tmp_path), whole)


def test_the_proposal_is_kept(tmp_path, whole):
    """Another proposal, as a search on another machine may end with, does not change the chain."""
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path, report=stops(100))
    _, proposal, _, _ = gaussian()
    other = replace(proposal, dof=3.0)
    same(
        sample.sample(target, other, SETTINGS, checkpoint=Checkpoint(tmp_path, PRINTS, True)), whole
    )


def test_a_chain_of_another_input_is_refused_and_says_which(tmp_path):
    go(tmp_path, settings=replace(SETTINGS, max_steps=40))
    path = tmp_path / FOLDER / "begin.kept"
    before = path.read_bytes()
    other = {**PRINTS, "record frame-1": "cc", "record frame-2": "dd"}
    with pytest.raises(InputError, match=r"another record frame-1, record frame-2.*without --res"):
        go(tmp_path, prints=other)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("key", "value", "called"),
    [
        *(("ensembles", 3, "ensembles"), ("walkers", 10, "walkers"), ("block", 10, "block")),
        *(("seed", 5, "seed"), ("apart", False, "way to begin its ensembles")),
    ],
)
def test_a_chain_of_another_layout_is_refused(tmp_path, key, value, called):
    go(tmp_path, settings=replace(SETTINGS, max_steps=40))
    with pytest.raises(InputError, match=f"drawn with another {called}, so it"):
        go(tmp_path, settings=replace(SETTINGS, **{key: value}))


HOLDS = """
import sys, time
sys.path.insert(0, {root!r})
from rigid.io.files import locked
with locked({directory!r}):
    print("held", flush=True)
    time.sleep(60)
"""


def test_two_runs_cannot_use_one_folder(tmp_path):
    root = str(Path(__file__).parent.parent)
    code = HOLDS.format(root=root, directory=str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        says = rf"in use by another run \(process {process.pid} on \S+ since 20\d\d-.* UTC\)"
        with pytest.raises(EnvironmentFaultError, match=says), locked(tmp_path):
            pass
        process.kill()
    with locked(tmp_path), pytest.raises(EnvironmentFaultError), locked(tmp_path):
        pass


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "new" / "a.txt"
    write_text(path, "one\n")
    assert path.read_bytes() == b"one\n"
    with pytest.raises(UnicodeEncodeError), replacing(path) as temporary:
        temporary.write_text("half, then \ud800")
    assert path.read_bytes() == b"one\n"
    assert os.listdir(path.parent) == ["a.txt"]
    with pytest.raises(EnvironmentFaultError, match="could not be written"):
        write_text(path / "below-a-file.txt", "x")
