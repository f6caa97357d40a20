"""Commands whose whole runs are slow, run through themselves on a cart: seconds a fit."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from cart import write_cart

from rigid import __main__ as rigid_command
from rigid import batch, discover

DRY, SLOW = 30.0, 0.05
"""N of dry friction that the spec does not name, and m/s over which it turns round."""


def with_dry_friction(folder: Path) -> Path:
    """The spec of a cart that slides on something, with dry friction as the one candidate."""
    path = write_cart(folder, seconds=8.0)
    head, *rows = (folder / "cart.csv").read_text("utf-8").splitlines()
    time, place, force = np.array([row.split(",") for row in rows], dtype=float).T
    force += DRY * np.tanh(np.gradient(place, time) / SLOW)
    lines = [f"{a:.4f},{b:.9f},{c:.4f}" for a, b, c in zip(time, place, force, strict=True)]
    (folder / "cart.csv").write_text("\n".join([head, *lines]) + "\n", "utf-8")
    effects = 'effects = ["viscous-friction"]\n'
    more = effects + 'candidates = ["coulomb-friction"]\n'
    path.write_text(path.read_text("utf-8").replace(effects, more), "utf-8")
    return path


def test_discover_names_what_a_cart_hides(tmp_path, capsys):
    path, out = with_dry_friction(tmp_path), tmp_path / "out"
    assert discover.main([str(path), "--quiet", "--seed", "1", "--out", str(out)]) in (0, 1)
    printed = capsys.readouterr().out
    made = json.loads((out / "discovery.json").read_text("utf-8"))
    (step,) = made["steps"]
    assert (made["verdict"], step["effect"]) == ("named", "coulomb-friction")
    assert printed.startswith("verdict: named")
    assert "coulomb-friction (probability" in printed
    low, high = (step["parameters"]["F_C"][q] for q in ("q05", "q95"))
    assert low - 0.1 * DRY < DRY < high + 0.1 * DRY  # a bristle's turn is another than tanh's
    assert step["gap"]["after"] < step["gap"]["before"]
    page = (out / "index.html").read_text("utf-8")
    for figure in ("against-1", "matrix", "where"):
        assert f'id="fig-discovery-{figure}"' in page
        assert (out / "figures" / f"discovery-{figure}.csv").is_file()


def test_batch_puts_all_carts_on_one_page(tmp_path, capsys):
    folder, out = tmp_path / "spring", tmp_path / "out"
    folder.mkdir()
    for number, drag in enumerate((120.0, 130.0)):
        write_cart(folder, f"day-{number + 1}", drag, seed=number, seconds=8.0)
    assert batch.main([str(folder), "--quiet", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    made = json.loads((out / "batch.json").read_text("utf-8"))
    assert [one["name"] for one in made["campaigns"]] == ["day-1", "day-2"]
    assert all(one["status"] == "usable" for one in made["campaigns"])
    assert "2 of 2 campaigns gave a usable result" in printed
    assert 'id="fig-batch-season' in (out / "index.html").read_text("utf-8")
    assert (out / "day-1" / "posterior.nc").is_file()


@pytest.mark.parametrize(
    ("given", "status", "says"),
    [
        (["--version"], 0, "rigid 0."),
        (["--help"], 0, "usage: rigid COMMAND SPEC"),
        (["fti", "spec"], 2, "unknown command 'fti'"),
        (["check", "nowhere"], 2, "nowhere"),
    ],
)
def test_every_command_goes_by_its_name(given, status, says, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["rigid", *given])
    assert rigid_command.main() == status
    printed = capsys.readouterr()
    assert says in printed.out + printed.err
