"""Make the example pages of docs/gallery.md: the runs behind them, and `reports/examples/`.

python docs/figures/examples.py FOLDER [NAME ...]

Runs go to FOLDER, by the commands that a user would type there, and take some 20 minutes on two
cores; a run whose page is there is not made again. Only the page is kept: links to the files beside
it are taken off, and of paths the last part alone is kept.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "reports" / "examples"
FILES = re.compile(r' ?<span class="files">.*?</span>|<p>The same as files: .*?</p>\n', re.DOTALL)
LINK = re.compile(r'<a href="(?!#)[^"]*">(.*?)</a>', re.DOTALL)
FOLDERS = re.compile(r"(?<=[ >;])/(?:[\w.-]+/)+(?=[\w.-])")
RIG = "docs/tutorial/my-rig.toml"
DRAGS = (120.0, 120.0, 150.0)
"""N s/m of the carts of three campaigns."""


class Runs:
    """Runs in a folder, each made once."""

    def __init__(self, work: Path):
        self.work = work

    def made(self, name: str, module: str, *given: str) -> Path:
        """Run a command whose reports go to `reports/NAME`; returns that folder."""
        out = self.work / "reports" / name
        if not (out / "index.html").exists():
            self.run(module, *given, "--out", f"reports/{name}")
        return out

    def run(self, module: str, *given: str) -> None:
        """Run a module of the package."""
        command = [sys.executable, "-m", f"rigid.{module}", *given]
        subprocess.run(command, cwd=self.work, check=True, stdout=subprocess.DEVNULL)

    def campaign(self, name: str, *given: str) -> str:
        """Have the generator write a campaign; returns the name of its spec."""
        if not (self.work / name / "truth.json").exists():
            self.run("generator", "--out", name, *given)
        return f"{name}/calibration.toml"

    def tutorial(self) -> Path:
        """Copy the tutorial to where its text says it is; returns its spec."""
        spec = self.work / RIG
        if not spec.exists():
            shutil.copytree(ROOT / "docs" / "tutorial", spec.parent)
        return spec


def _calibration(runs: Runs) -> Path:
    """The tutorial's three files."""
    runs.tutorial()
    return runs.made("my-rig", "fit", RIG)


def _laws(runs: Runs) -> Path:
    """Which friction model they speak for."""
    runs.tutorial()
    return runs.made("laws", "laws", RIG)


def _compare(runs: Runs) -> Path:
    """The same without and with the release, which is the last record of the spec."""
    spec = runs.tutorial()
    text = spec.read_text("utf-8").replace('campaign"', 'campaign, without the release"', 1)
    fewer = spec.with_name("without-release.toml")
    fewer.write_text(text[: text.rindex("[[records]]")], "utf-8")
    runs.made("without-release", "fit", f"docs/tutorial/{fewer.name}")
    _calibration(runs)
    return runs.made("compare", "compare", "reports/without-release", "reports/my-rig")


def _discovery(runs: Runs) -> Path:
    """A hose whose pressure drop the model lacks."""
    hidden = ("--hide", "hose-pressure-drop", "--strength", "8")
    return runs.made("discovery", "discover", runs.campaign("campaign", "--seed", "110", *hidden))


def _plan(runs: Runs) -> Path:
    """What another record tells of k_LC, and which tells two effects apart."""
    hidden = ("--hide", "stribeck-friction", "--strength", "5")
    spec = runs.campaign("friction", "--seed", "882", *hidden)
    out = runs.work / "reports" / "plan"
    if not (out / "index.html").exists():
        both = ("--between", "coulomb-friction", "stribeck-friction")
        runs.run("plan", spec, *both, "--out", "reports/plan")
        runs.run("plan", spec, "--out", "reports/plan", "--resume")
    return out


def _bands(runs: Runs) -> Path:
    """A field test with both cylinders, after its own calibration."""
    calibration = runs.work / runs.campaign("clean", "--seed", "110")
    runs.made("clean", "fit", "clean/calibration.toml")
    text = calibration.read_text("utf-8")
    _, _, rest = text.partition("\n")
    title = 'title = "Field test on the ice, both cylinders"\n'
    posterior = '\n[bands]\nposterior = "../reports/clean/posterior.nc"\n'
    calibration.with_name("field-test.toml").write_text(title + rest + posterior, "utf-8")
    return runs.made("bands", "bands", "clean/field-test.toml")


def _season(runs: Runs) -> Path:
    """Three campaigns of a cart, the third with more drag."""
    sys.path.insert(0, str(ROOT))
    from tests.cart import write_cart

    folder = runs.work / "carts"
    folder.mkdir(exist_ok=True)
    for number, drag in enumerate(DRAGS, 1):
        write_cart(folder, f"cart-{number}", drag, seed=number)
    return runs.made("season", "batch", "carts")


def _paper(runs: Runs) -> Path:
    """The paper's equations, numbers and figures, computed again."""
    return runs.made("paper", "paper")


PAGES: dict[str, Callable[[Runs], Path]] = {
    "calibration": _calibration,
    "laws": _laws,
    "compare": _compare,
    "discovery": _discovery,
    "plan": _plan,
    "bands": _bands,
    "season": _season,
    "paper": _paper,
}


def put(name: str, folder: Path, work: Path) -> Path:
    """Write the page of a run to `reports/examples/NAME/index.html`."""
    text = (folder / "index.html").read_text("utf-8").replace(f"{work.as_posix()}/", "")
    target = EXAMPLES / name / "index.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    text = LINK.sub(r"\1", FILES.sub("", text))
    target.write_text(FOLDERS.sub("", text), "utf-8")
    return target


def main() -> None:
    """Make the pages that are named, or all of them."""
    work = Path(sys.argv[1]).resolve()
    work.mkdir(parents=True, exist_ok=True)
    # All runs first: a page that has changed would make the commit of the next run a dirty one.
    made = {name: PAGES[name](Runs(work)) for name in sys.argv[2:] or PAGES}
    for name, folder in made.items():
        put(name, folder, work)


if __name__ == "__main__":
    main()
