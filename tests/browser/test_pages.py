"""Pages as a browser shows them: nothing missing, nothing cut, nothing that shuts a reader out.

Needs a Chromium of the system and the packages of docs/requirements.txt; run with `-m browser`.
"""

from pathlib import Path

import pytest

from rigid.report.page import Section, rebuild, write_section

Axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe

pytestmark = pytest.mark.browser
EXAMPLES = sorted(
    path.parent.name
    for path in (Path(__file__).parents[2] / "reports" / "examples").glob("*/index.html")
)
WIDTHS = (1280, 390)
GRAVE = ("serious", "critical")
OPEN_ALL = "document.querySelectorAll('details').forEach(one => one.open = true)"
BROKEN = """<div style="width: 3000px">wide</div><img src="missing.png">
<script>undefined_name()</script>
<input><div style="overflow: auto; height: 1em"><p>a</p><p>b</p><p>c</p></div>"""


def faults(browser, path: Path, width: int, scheme: str = "light") -> list[str]:
    """What is wrong with a page at a width, all its layers open."""
    found = []
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page = context.new_page()
    page.on("console", lambda one: found.append(f"console: {one.text}"))
    page.on("pageerror", lambda one: found.append(f"script: {one}"))
    page.on("requestfailed", lambda one: found.append(f"not fetched: {one.url}"))
    page.goto(path.as_uri())
    for _ in range(2):  # as it opens, then with everything open
        wide = page.evaluate("document.documentElement.scrollWidth")
        if wide > width:
            found.append(f"{wide} px wide")
        page.evaluate(OPEN_ALL)
    hidden = page.evaluate(
        "[...document.querySelectorAll('figure svg')].filter(s => !s.getBoundingClientRect().width)"
        ".length"
    )
    found += [f"{hidden} drawings have no size"] if hidden else []
    found += [
        f"{one['id']}: {one['nodes'][0]['html'][:200]}"
        for one in Axe().run(page).response["violations"]
        if one["impact"] in GRAVE
    ]
    context.close()
    return found


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_fresh_page_has_no_fault(browser, calibration, width, scheme):
    assert faults(browser, calibration, width, scheme) == []


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_committed_examples_have_no_fault_with_the_style_of_today(browser, example, name):
    assert [fault for width in WIDTHS for fault in faults(browser, example(name), width)] == []


def test_a_calibration_prints_on_two_pages_and_more_where_layers_are_open(browser, calibration):
    page = browser.new_page()
    page.goto(calibration.as_uri())
    printed = [page.pdf(format="A4").count(b"/Type /Page\n")]
    page.evaluate(OPEN_ALL)
    printed.append(page.pdf(format="A4").count(b"/Type /Page\n"))
    page.close()
    assert 1 <= printed[0] <= 2 < printed[1]


def test_a_broken_page_is_found_out(browser, tmp_path):
    write_section(tmp_path, Section("broken", 10, "Broken", BROKEN))
    found = " ".join(faults(browser, rebuild(tmp_path), 1280))
    for sort in ("px wide", "missing.png", "undefined_name", "image-alt", "label"):
        assert sort in found
