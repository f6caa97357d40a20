"""What is declared of the package: dependencies, script, types, how it is cited."""

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import rigid
from rigid.__main__ import COMMANDS

PACKAGE = Path(rigid.__file__).parent
ROOT = PACKAGE.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
NOT_IMPORTED = {"flatbuffers", "h5netcdf"}
"""jax.export and xarray take them by their names."""
CLUSTER = {"dask", "distributed"}
"""Of the extra `cluster`, imported where --workers asks for them; the second brings the first."""


def plain(name: str) -> str:
    return re.split(r"[<>=!~;\[ ]", name)[0].lower().replace("_", "-")


def imported(package: Path) -> set[str]:
    found = set()
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.split(".")[0])
    return found - {package.name, *sys.stdlib_module_names}


def test_what_is_imported_is_declared_and_the_other_way_round():
    homes = importlib.metadata.packages_distributions()
    needed = {plain(homes[name][0]) for name in imported(PACKAGE)}
    declared = {plain(name) for name in PROJECT["dependencies"]}
    assert needed - CLUSTER == declared - NOT_IMPORTED
    extra = PROJECT["optional-dependencies"]
    assert {plain(name) for name in extra["cluster"]} <= CLUSTER <= needed
    assert set(extra["cluster"]) <= set(extra["test"])
    pinned = (ROOT / "requirements.txt").read_text("utf-8")
    for name in declared:
        assert re.search(rf"(?m)^{re.escape(name)}==", pinned), name


def test_the_script_is_there_and_the_types_are_published():
    assert PROJECT["scripts"] == {"rigid": "rigid.__main__:main"}
    assert (PACKAGE / "py.typed").is_file()
    assert "urls" not in PROJECT  # the project has no public address of its own yet
    page = (ROOT / PROJECT["readme"]).read_text("utf-8")
    assert not re.findall(r"\]\((?!https?:)", page), "a link that the package index cannot follow"


def test_the_citation_is_of_this_version():
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {rigid.__version__}\n" in text


def script(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "rigid", *arguments],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
        timeout=120,
    )


def test_the_script_names_the_commands():
    done = script()
    assert done.returncode == 0
    for name in COMMANDS:
        assert re.search(rf"(?m)^  {name} ", done.stdout)
    assert script("--version").stdout == f"rigid {rigid.__version__}\n"
    wrong = script("fti")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith("rigid: unknown command 'fti'; it is one of new, check, fit")
    assert script("fit", "--help").stdout.startswith("usage: rigid fit [-h]")


def test_a_command_of_the_script_is_that_of_the_module():
    done = script("check", "calibratoin")
    assert done.returncode == 2
    first, message = done.stderr.splitlines()
    assert first == f"rigid {rigid.__version__}: check calibratoin"
    assert message.startswith("no spec 'calibratoin': did you mean 'calibration'?")
