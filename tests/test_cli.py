"""What a command promises to whoever starts it: first line, statuses, what goes where."""

import errno
import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import rigid
from rigid.io import cli
from rigid.io.cli import Interrupted, signals
from rigid.io.errors import EnvironmentFaultError, InputError, UnusableResultError
from rigid.io.files import locked

ROOT = Path(rigid.__file__).parents[1]
HEAVY = {"jax", "jaxlib", "numpy", "scipy", "pydantic", "matplotlib", "arviz", "xarray", "h5py"}

SPEC = """\
[[records]]
name = "run"
kind = "free-run"
file = "run.csv"
channels = { time = { column = "t", unit = "s" }, stroke = { column = "x", unit = "mm" } }
"""


@pytest.fixture
def command(monkeypatch, capsys):
    """Run a body as a command; gives status, standard output and standard error."""

    def run(body, *arguments):
        monkeypatch.setattr(sys, "argv", ["rigid.test", *(arguments or ("some-spec",))])
        try:
            status = cli.run("test", "Tests.", body)
        except SystemExit as stop:
            status = stop.code
        out, err = capsys.readouterr()
        return status, out, err

    return run


def fail(error):
    def body(_options):
        raise error

    return body


def start(module, *arguments, cwd, **more):
    """Start a module as users do; gives the finished process."""
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, *module, *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=env,
        timeout=300,
        **more,
    )


# The first line


def test_modules_of_a_command_load_nothing_heavy(tmp_path):
    program = "import sys, rigid.io.cli, rigid.fit; print(*{m.split('.')[0] for m in sys.modules})"
    done = start(("-c",), program, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert not HEAVY & set(done.stdout.split())


def test_the_first_line_comes_before_the_body(command):
    def body(_options):
        sys.stderr.write("body\n")
        return 0

    status, out, err = command(body, "my-spec")
    assert (status, out) == (0, "")
    assert err.splitlines() == [f"rigid {rigid.__version__}: test my-spec", "body"]


def test_the_first_line_comes_before_jax(tmp_path):
    program = (
        "import sys; from rigid.io.cli import run\n"
        "def body(options):\n"
        "    assert not {'jax', 'numpy', 'pydantic'} & set(sys.modules)\n"
        "    return 0\n"
        "sys.argv = ['x', 'spec']; sys.exit(run('fit', 'Says.', body))"
    )
    done = start(("-c",), program, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, f"rigid {rigid.__version__}: fit spec\n")


# Options


def test_options_reach_the_body(command):
    seen = []
    given = ("s", "--out", "here", "--seed", "7", "--resume", "--quiet", "--json")
    status, _, err = command(lambda o: seen.append(o) or 0, *given)
    assert (status, err) == (0, "")
    assert seen == [cli.Options("s", Path("here"), 7, True, True, True)]
    assert seen[0].folder(Path("fits/s.toml")) == Path("here")


def test_results_lie_in_reports_by_the_name_of_the_spec():
    options = cli.parse("test", "Tests.", ["../somewhere/my rig.toml"])
    assert options == cli.Options("../somewhere/my rig.toml", None, None, False, False, False)
    assert options.folder(Path("../somewhere/my rig.toml")) == Path("reports/my rig")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("s", "--bogus"), "unrecognized arguments: --bogus"),
        (("s", "--res"), "unrecognized arguments: --res"),
        (("s", "t"), "unrecognized arguments: t"),
        (("--quiet",), "required: spec"),
        (("s", "--seed", "x"), "'x' is no seed; it is a whole number, 0 or more"),
        (("s", "--seed=-1"), "'-1' is no seed"),
        (
            ("s", "--workers", "tcp://10.0.0.1:8786"),
            "this command is one job and runs in this process; leave",
        ),
    ],
)
def test_a_wrong_command_line_is_status_2(command, arguments, says):
    status, out, err = command(lambda _: 0, *arguments)
    assert (status, out) == (2, "")
    assert says in err


def test_help_names_every_option_of_the_contract(command):
    status, out, _ = command(lambda _: 0, "--help")
    assert status == 0
    for option in ("--out", "--seed", "--resume", "--quiet", "--json"):
        assert option in out


# Statuses


@pytest.mark.parametrize("status", [0, 1])
def test_the_bodys_status_is_the_commands(command, status):
    assert command(lambda _: status)[0] == status


FAILURES = {
    "input": (InputError("here: this; do that"), 2, "here: this; do that"),
    "unusable": (UnusableResultError("not converged"), 1, "not converged"),
    "environment": (EnvironmentFaultError("no room"), 3, "no room"),
    "disk": (OSError(errno.ENOSPC, "No space left on device"), 3, "No space left on device"),
    "memory": (MemoryError(), 3, "out of memory; fewer walkers"),
    "defect": (ZeroDivisionError("by\nzero"), 3, "a defect of the program: ZeroDivisionError: by"),
}


@pytest.mark.parametrize("case", FAILURES)
def test_a_failure_is_one_line_and_its_status(command, case):
    error, expected, says = FAILURES[case]
    status, out, err = command(fail(error))
    _, *rest = err.splitlines()
    assert (status, out, len(rest)) == (expected, "", 1)
    assert says in rest[0]
    assert "Traceback" not in err


def test_a_defect_shows_where_it_is_on_demand(command, monkeypatch):
    monkeypatch.setenv(cli.TRACEBACK, "1")
    with pytest.raises(ZeroDivisionError):
        command(fail(ZeroDivisionError()))


def test_messages_of_failures_come_in_spite_of_quiet(command):
    assert command(fail(InputError("this")), "s", "--quiet") == (2, "", "this\n")


@pytest.mark.parametrize(("number", "expected"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_run_in_order(command, number, expected):
    closed = []

    def body(_options):
        try:
            signal.raise_signal(number)
        finally:
            closed.append(True)
        return 0

    before = signal.getsignal(number)
    status, _, err = command(body)
    assert (status, closed) == (expected, [True])
    assert err.splitlines()[1:] == ["interrupted; --resume goes on from the last complete block"]
    assert signal.getsignal(number) is before


def test_a_signal_from_outside(tmp_path):
    program = (
        "import sys, time; from rigid.io.cli import run\n"
        "sys.argv = ['x', 'spec']\n"
        "sys.exit(run('fit', 'Says.', lambda o: print('up', flush=True) or time.sleep(60)))"
    )
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=env,
        cwd=tmp_path,
    ) as process:
        assert process.stdout.readline() == b"up\n"
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 143


# Standard output


def test_standard_output_holds_what_the_body_writes_alone(command):
    def body(options):
        cli.say(options.quiet, "progress")
        sys.stdout.write("result\n")
        return 0

    assert command(body, "s")[1] == "result\n"
    assert command(body, "s", "--quiet")[1:] == ("result\n", "")


WRITER = """\
import sys; from rigid.io.cli import run
sys.argv = ['x', 'spec', '--quiet']
sys.exit(run('fit', 'Says.', lambda o: sys.stdout.write('x' * {size}) * 0 + {status}))
"""


@pytest.mark.parametrize("size", [10, 200_000])
def test_a_reader_that_goes_away_is_no_failure(tmp_path, size):
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-c", WRITER.format(size=size, status=0)],
        stdout=writing,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        timeout=60,
    )
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_under_standard_output_is_told(tmp_path):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", WRITER.format(size=10, status=0)],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            check=False,
            timeout=60,
        )
    assert done.returncode == 3
    assert done.stderr.startswith("the system refused: ")
    assert len(done.stderr.splitlines()) == 1


# The fit itself, up to where the work begins


def test_an_unknown_spec(tmp_path):
    done = start(("-m", "rigid.fit"), "calibratoin", "--out", "out", cwd=tmp_path)
    first, message = done.stderr.splitlines()
    assert (done.returncode, done.stdout) == (2, "")
    assert first == f"rigid {rigid.__version__}: fit calibratoin"
    assert message.startswith("no spec 'calibratoin': did you mean 'calibration'? there is no file")
    assert not (tmp_path / "out").exists()


@pytest.fixture
def spec(tmp_path):
    """A spec of one free run; its file is up to the test."""
    (tmp_path / "own.toml").write_text(SPEC, "utf-8")
    return tmp_path / "own.toml"


def fit(command, *arguments):
    from rigid.fit import fit

    return command(fit, *map(str, arguments))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "there is no such file"),
        ("t,x\n0,1\n0.1,broken\n0.2,3\n", "line 3 holds 'broken'"),
        ("t,y\n0,1\n0.1,2\n0.2,3\n", "the file has no column 'x'; it has 't', 'y'"),
        ("", "the file is empty"),
    ],
)
def test_a_broken_record_leaves_nothing_behind(command, spec, content, says):
    if content is not None:
        (spec.parent / "run.csv").write_text(content, "utf-8")
    before = sorted(spec.parent.iterdir())
    status, out, err = fit(command, spec, "--out", spec.parent / "out")
    assert (status, out) == (2, "")
    assert says in err
    assert "Traceback" not in err
    assert sorted(spec.parent.iterdir()) == before


def good_record(folder):
    rows = [f"{0.01 * k:.2f},{0.22 * (k // 3):.2f}" for k in range(300)]
    (folder / "run.csv").write_text("\n".join(["t,x", *rows]) + "\n", "utf-8")


def test_a_folder_in_use_is_status_3(command, spec):
    good_record(spec.parent)
    with locked(spec.parent / "out"):
        status, out, err = fit(command, spec, "--out", spec.parent / "out")
    assert (status, out) == (3, "")
    assert f"in use by another run (process {os.getpid()} on " in err


def test_a_fault_found_after_the_records_leaves_no_result(command, spec):
    good_record(spec.parent)
    spec.write_text(SPEC + "[priors]\nk_lc = { lognormal = { median = 6e7, factor = 2 } }\n")
    status, out, err = fit(command, spec, "--out", spec.parent / "out")
    assert (status, out) == (2, "")
    assert "[priors]: unknown name 'k_lc'; did you mean 'k_LC'?" in err
    left = {path.name for path in (spec.parent / "out").rglob("*")}
    assert left <= {".lock"}  # nothing half-written


def test_a_law_that_does_not_exist(command, spec):
    good_record(spec.parent)
    spec.write_text(SPEC + "[priors]\nk_LC = { lognormall = { median = 6e7, factor = 2 } }\n")
    status, _, err = fit(command, spec, "--out", spec.parent / "out")
    assert status == 2
    assert "[priors] k_LC: unknown prior 'lognormall'" in err


def test_a_signal_where_python_ignores_errors_still_ends_the_run():
    """The collector's callbacks are such a place, and JAX has one."""

    def callback(*_):
        gc.callbacks.remove(callback)
        signal.raise_signal(signal.SIGTERM)

    def run():
        with signals():
            gc.collect()
            time.sleep(20.0)

    before = signal.getsignal(signal.SIGALRM), sys.unraisablehook
    gc.callbacks.append(callback)
    with pytest.raises(Interrupted) as ended:
        run()
    assert ended.value.number == signal.SIGTERM
    assert (signal.getsignal(signal.SIGALRM), sys.unraisablehook) == before
