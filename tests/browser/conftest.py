"""A browser, and the pages that are shown in it."""

import shutil
from pathlib import Path

import fake_calibration as fake
import pytest

from rigid.report.calibration.section import KIND
from rigid.report.section import write_report
from rigid.report.templating import FOLDER

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
EXAMPLES = Path(__file__).parents[2] / "reports" / "examples"


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no extra `browser` is installed"
    )
    if CHROMIUM is None:
        pytest.skip("no Chromium on this system")
    with playwright.sync_playwright() as started:
        # The sandbox of Chromium does not run as root, which is who runs tests in containers.
        made = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield made
        made.close()


@pytest.fixture(scope="session")
def calibration(tmp_path_factory):
    return write_report(KIND, fake.calibration(), tmp_path_factory.mktemp("calibration"))


@pytest.fixture
def example(tmp_path):
    """Give the page of a committed example with the style sheet of today."""

    def today(name: str) -> Path:
        head, rest = (EXAMPLES / name / "index.html").read_text("utf-8").split("<style>")
        style = (FOLDER / "style.css").read_text("utf-8")
        page = tmp_path / "index.html"
        page.write_text(f"{head}<style>{style}</style>{rest.split('</style>', 1)[1]}", "utf-8")
        return page

    return today
