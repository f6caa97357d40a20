"""The page: well formed, self-contained, deterministic, honest about simulation, escaped."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import fake_calibration as fake
import pytest
from markupsafe import Markup

from rigid.effects import CATALOGUE
from rigid.io.errors import EnvironmentFaultError
from rigid.report import wording
from rigid.report.calibration.for_paper import references
from rigid.report.calibration.section import KIND
from rigid.report.content import Answer, Check, Front, KeyNumber, Published
from rigid.report.page import Section, read_section, rebuild, write_section
from rigid.report.section import section, write_report
from rigid.report.templating import columns, prose, symbol_html

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Balance(HTMLParser):
    """Refuses tags that do not pair up, and collects ids and what would be fetched."""

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.targets, self.fetched, self.tables = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        self._note(tag, dict(attrs))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self._note(tag, dict(attrs))

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def _note(self, tag, attrs):
        if "id" in attrs:
            self.ids.append(attrs["id"])
        for name in ("src", "href", "data", "action", "poster"):
            if name in attrs and attrs[name].startswith("#"):
                self.targets.append(attrs[name][1:])
            elif name in attrs:
                self.fetched.append((tag, attrs[name]))
        if tag == "th":
            self.tables.append(attrs.get("scope"))
        assert tag not in ("script", "iframe", "object", "embed")
        assert not any(name.startswith("on") for name in attrs)


def parsed(html):
    parser = Balance()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser


@pytest.fixture(scope="module")
def content():
    return fake.calibration()


@pytest.fixture(scope="module")
def page(content, tmp_path_factory):
    return written(content, tmp_path_factory.mktemp("report"))


def small(**changes):
    """A content without the figures that take time."""
    bare = {"friction": None, "fits": (), "draws": None, "traces": (), "roots": None}
    return fake.calibration(**(bare | changes))


def written(content, folder):
    return write_report(KIND, content, folder).read_text(encoding="utf-8")


def test_the_page_is_well_formed_and_fetches_nothing(page):
    found = parsed(page)
    # Files of the figures lie beside the page; they are there to be opened, none is fetched.
    assert {tag for tag, _ in found.fetched} == {"a"}
    beside = re.compile(r"(figures/[\w-]+\.(svg|pdf|png|csv)|for-paper\.(txt|tex|bib))$")
    assert all(beside.match(name) for _, name in found.fetched)
    assert not re.search(r"url\((?!#)|@import", page)
    assert len(found.ids) == len(set(found.ids))
    assert set(found.targets) <= set(found.ids)
    assert len(page.encode()) < 5e6


def test_every_table_header_has_a_scope_and_every_figure_a_caption(page):
    assert set(parsed(page).tables) == {"col", "row"}
    figures = re.findall(r"<figure .*?</figure>", page, flags=re.DOTALL)
    assert len(figures) == 5 + 4
    for figure in figures:
        assert re.search(r'role="img" aria-label="[^"]{20,}"', figure)
        assert re.search(r"<figcaption>.{40,}", figure)


@pytest.mark.slow
def test_the_same_content_gives_the_same_bytes(page, tmp_path):
    assert written(fake.calibration(), tmp_path) == page


def test_simulated_data_are_said_on_the_page_and_in_every_figure(page):
    assert "<strong>Simulated data</strong>" in page
    figures = re.findall(r"<figure .*?</figure>", page, flags=re.DOTALL)
    assert all("SIMULATED DATA" in figure for figure in figures)
    assert all("Simulated data." in figure for figure in figures)


@pytest.mark.slow
def test_measured_data_are_not_called_simulated(tmp_path):
    content = fake.calibration(
        simulated=False,
        fits=fake.fits()[-1:],
        provenance=vars_replaced(fake.provenance(), spec_text=""),
        draws=None,
    )
    assert "simulated data" not in written(content, tmp_path).lower()


def vars_replaced(value, **changes):
    return type(value)(**(vars(value) | changes))


def test_whatever_the_spec_says_is_text(tmp_path):
    evil = "<script>alert(1)</script> --> \" ' & {{ 7 * 7 }}"
    content = small(
        title=evil,
        front=Front(
            evil, "bad", evil, (evil,), (Answer(evil, evil, evil, evil),), (evil,), (evil,)
        ),
        checks=(Check(evil, False, evil),),
        key_numbers=(KeyNumber(evil, evil, "N", 1.0, 0.1, 0.8, 1.2, (), evil),),
        provenance=vars_replaced(fake.provenance(), spec_text=evil, command=evil),
    )
    html = written(content, tmp_path)
    parsed(html)
    assert "<script" not in html
    assert "{{ 7 * 7 }}" in html
    assert read_section(next((tmp_path / "sections").iterdir())).subject == evil


def test_the_spec_stands_there_verbatim(page):
    import html

    assert html.escape(fake.SPEC, quote=False).strip() in page.replace("&#34;", '"')


def test_a_failed_check_is_the_first_thing_said(tmp_path):
    checks = (Check("ess", True, "fine"), Check("r_hat", False, "1.12 where 1.01 is allowed"))
    front = Front("What is it?", "bad", wording.verdict(False, checks), (checks[1].says,))
    front = replace(front, answers=(Answer("k", "1 N/m"),))
    html = written(small(usable=False, checks=checks, front=front), tmp_path)
    assert "Not usable as it stands: r_hat failed." in html
    assert 'class="front bad"' in html
    assert "Not to be quoted" in html
    assert html.index("1.12 where 1.01 is allowed") < html.index('class="answers"')


@pytest.mark.parametrize(
    ("usable", "oks", "says"),
    [
        (True, (True, True), "Usable: all 2 checks passed."),
        (True, (True, False), "Usable, with reserve: b did not pass and must be kept in mind."),
        (False, (False, False), "Not usable as it stands: a and b failed."),
        (False, (), "Not usable as it stands."),
    ],
)
def test_verdicts(usable, oks, says):
    checks = tuple(Check(name, ok, "") for name, ok in zip("ab", oks, strict=False))
    assert wording.verdict(usable, checks) == says


def test_readings_place_published_values():
    published = (Published(0.5, "x"), Published(1.0, "y"), Published(2.0, "z"))
    number = KeyNumber("a", "a", "-", 1.0, 0.1, 0.8, 1.2, published)
    assert wording.reading(number) == (
        "0.5 (x) lies below the interval; 1 (y) lies within the interval; "
        "2 (z) lies above the interval."
    )


def test_a_skewed_number_has_no_plus_minus():
    number = KeyNumber("a", "a", "N s/m", 1.5e6, 4.6e5, 1.1e6, 2.6e6)
    assert "±" not in wording.main_form(number)


def test_rebuild_keeps_the_sections_of_other_commands(tmp_path):
    write_section(tmp_path, Section("bands", 20, "Bands", '<h3 id="bands-a">Loads</h3>'))
    written(small(), tmp_path)
    html = written(small(title="Second run"), tmp_path)
    assert html.count('id="section-calibration"') == 1
    assert html.index('id="section-calibration"') < html.index('id="section-bands"')
    assert '<a href="#bands-a">Loads</a>' in html
    assert "<h1>Second run</h1>" in html
    files = sorted(path.name for path in (tmp_path / "sections").iterdir())
    assert files == ["10-calibration.html", "20-bands.html"]


def test_a_section_that_moves_leaves_nothing_behind(tmp_path):
    write_section(tmp_path, Section("bands", 20, "Bands", ""))
    write_section(tmp_path, Section("bands", 25, "Bands", ""))
    assert [path.name for path in (tmp_path / "sections").iterdir()] == ["25-bands.html"]


def test_a_section_reads_back_as_it_was_written(tmp_path):
    made = Section("bands", 20, "Loads -> bands", "<p>ä\n</p>\n", "A -- b", True)
    assert read_section(write_section(tmp_path, made)) == made


def test_a_stray_file_is_named_and_left_out(tmp_path):
    write_section(tmp_path, Section("bands", 20, "Bands", "<p>kept</p>"))
    (tmp_path / "sections" / "99-stray.html").write_text("<p>not ours</p>")
    html = rebuild(tmp_path).read_text()
    assert "<p>kept</p>" in html
    assert "sections/99-stray.html" in html
    assert "not ours" not in html


def test_a_failed_write_leaves_the_old_page(tmp_path, monkeypatch):
    write_section(tmp_path, Section("bands", 20, "Bands", "<p>old</p>"))
    old = rebuild(tmp_path).read_text()

    def full(*_):
        raise OSError("disk full")

    monkeypatch.setattr("rigid.io.files.os.fsync", full)
    with pytest.raises(EnvironmentFaultError, match="disk full"):
        rebuild(tmp_path)
    assert (tmp_path / "index.html").read_text() == old
    assert {path.name for path in tmp_path.iterdir()} == {"index.html", "sections"}


def test_a_page_of_nothing_optional_still_stands(tmp_path):
    html = written(small(products=(), alternatives=(), modes=(), records=()), tmp_path)
    parsed(html)
    assert "<figure" not in html
    assert "Not to be quoted" not in html


@pytest.mark.parametrize(
    ("tex", "html"),
    [
        ("k_{LC}", "<i>k</i><sub>LC</sub>"),
        (r"\mu_0", "μ<sub>0</sub>"),
        (r"F_\mathrm{c}^2", "<i>F</i><sub>c</sub><sup>2</sup>"),
        ("a<b", "<i>a</i>&lt;<i>b</i>"),
        (r"\lambda\varepsilon\Omega", "λεΩ"),
        ("{", ""),
    ],
)
def test_symbols(tex, html):
    assert symbol_html(tex) == html


def test_the_section_stands_without_a_page():
    assert section(KIND, small()).html.count("<h3 id=") == 9


def test_a_cell_bears_the_heading_of_its_column_where_columns_have_no_room(page):
    rows = Markup(
        '<tr class="x"><th>1</th><td>2 <b>3</b></td></tr>'
        "<tr><th>4</th><td></td></tr><tr><td>5</td><th>6</th></tr>"
    )
    made = columns(rows, ["A <b", ">C"], labelled=True)
    assert '<tr class="x"><th scope="row">1</th>' in made
    assert '<td class="n" data-label="C"><span>2 <b>3</b></span></td>' in made
    assert '<td class="n"></td>' in made
    assert '<td data-label="A &lt;b"><span>5</span></td><th scope="row">6</th>' in made
    assert "data-label" not in columns(rows, ["A <b", ">C"], labelled=False)
    cards = re.findall(r'<div class="scroll cards".*?</div>', page, flags=re.DOTALL)
    assert cards
    for card in cards:
        heads = len(re.findall('<th scope="col"', card))
        for row in re.findall(r"<tr>(.*?)</tr>", card, flags=re.DOTALL)[1:]:
            assert row.count("<td") == heads - 1


REVIEWER = Path(__file__).parents[1] / "docs" / "reviewer.md"


def test_the_page_has_every_heading_that_a_reviewer_is_sent_to(tmp_path):
    html = written(small(fits=fake.fits()[-1:]), tmp_path)
    headings = re.findall(r'<h3 id="[^"]*">([^<(]*)', html)
    rows = re.findall(r"(?m)^\| (\d+) \| [^|]* \| ([^|]*) \|$", REVIEWER.read_text("utf-8"))
    assert [int(number) for number, _ in rows] == list(range(1, 21))
    named = set()
    for number, answered in rows:
        found = {heading for heading in map(str.strip, headings) if heading in answered}
        first = "first screen" in answered or "top of the page" in answered
        assert found or first or "figure" in answered, number
        named |= found
        for part in re.findall(r"\*([^*]+)\*", answered):
            assert part.lower() in html.lower(), part
    assert {"Uncertainty budget", "Convergence", "Provenance", "Checks of the result"} <= named


def test_the_paper_is_cited_once_and_other_sources_each():
    names = ("load-cell-spring", "oil-compressibility", "frequency-dependent-friction")
    told = references([CATALOGUE[name] for name in names])
    assert re.findall(r"(?m)^@misc\{(.*),$", told) == [
        "rigid",
        "rig-paper",
        "frequency-dependent-friction",
    ]
    assert r"load cell spring: eq. (8); oil compressibility: eqs. (4), (5), (9);" in told
    assert r"k\_oil" in told
    assert "paper, eq" not in told


def test_backticks_are_code_and_all_else_is_text():
    assert prose("run `rigid <fit>` & see") == "run <code>rigid &lt;fit&gt;</code> &amp; see"
