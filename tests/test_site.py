"""The pages of docs/ become a site whose links lead somewhere, and which can be read anywhere."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tests.browser import CONTRASTS, OWN, READABLE, headless, needs_browser, opened, requests_of

pytest.importorskip("sphinx")
pytest.importorskip("myst_nb")
pytest.importorskip("pydata_sphinx_theme")

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
DEVELOPING = (DOCS / "developing.md").read_text()
COMMAND = re.search(r"python (-m sphinx -W .*) docs site/html  #", DEVELOPING)
TEXTS = "body *:not(script, style)"
PHONE = 390
"""Width of a screen [pixels]."""


def built(docs, folder):
    words = [sys.executable, *shlex.split(COMMAND[1]), "--keep-going", "-q", str(docs), str(folder)]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site") / "html"
    done = built(DOCS, folder)
    assert done.returncode == 0, done.stderr
    return folder


class Page(HTMLParser):
    """Addresses that a page links to, addresses that it loads, and places that it has."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.places = [], [], {""}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.places.add(given.get("id"))
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        elif address := given.get("src") or (tag == "link" and given.get("href")):
            self.loads.append(address)


@pytest.fixture(scope="module")
def pages(site):
    files = [path for path in site.rglob("*.html") if "_static" not in path.parts]
    return {path.resolve(): Page(path) for path in files}


def test_every_page_and_notebook_is_in_the_site_and_can_be_searched(site):
    sources = [path.relative_to(DOCS) for kind in ("*.md", "*.ipynb") for path in DOCS.rglob(kind)]
    assert len(sources) >= 24
    index = (site / "searchindex.js").read_text()
    found = json.loads(index.partition("(")[2].rpartition(")")[0])["docnames"]
    assert sorted(found) == sorted(str(path.with_suffix("")) for path in sources)
    for path in sources:
        assert (site / path).with_suffix(".html").is_file()


def test_links_lead_to_pages_and_places_of_the_site(pages):
    count = 0
    for path, page in pages.items():
        for address in page.links:
            parts = urlsplit(address)
            assert not parts.scheme, address
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.is_file(), (path.name, address)
            if target in pages:
                assert unquote(parts.fragment) in pages[target].places, (path.name, address)
            count += 1
    assert count > 1000


def test_pages_load_what_lies_beside_them(pages):
    for path, page in pages.items():
        assert len(page.loads) >= 5
        for address in page.loads:
            parts = urlsplit(address)
            assert not parts.scheme, address
            assert not parts.netloc, address
            assert not parts.path or (path.parent / unquote(parts.path)).is_file(), address


def test_formulas_are_set(site):
    for name, least in (("mathematics", 30), ("regions", 8), ("execution", 5)):
        text = (site / f"{name}.html").read_text()
        assert text.count("<math ") >= least
        prose = re.sub(r"<(pre|math)\b.*?</\1>", "", text, flags=re.DOTALL)
        assert not re.search(r"\$|\\(frac|sum|theta)", prose)


def test_pictures_of_notebooks_are_shown(site):
    text = (site / "notebooks" / "your-mesh-to-a-proved-grasp.html").read_text()
    (address,) = re.findall(r'<img[^>]*src="(\.\./_images/[^"]+)"', text)
    assert (site / "notebooks" / address).is_file()


def test_what_is_wrong_in_a_page_ends_the_build(tmp_path):
    """A negative control: a link, a place and a formula that are none."""
    docs = shutil.copytree(DOCS, tmp_path / "work" / "docs")
    shutil.copy(ROOT / "README.md", tmp_path / "work")
    with (docs / "faults.md").open("a") as page:
        page.write("\n[a](nowhere.md) [b](files.md#no-such-place) $\\nosuchcommand$\n")
    done = built(docs, tmp_path / "html")
    assert done.returncode != 0
    for said in ("nowhere", "no-such-place", "nosuchcommand"):
        assert said in done.stderr


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    driver = headless(tmp_path_factory.mktemp("profile"))
    yield driver
    driver.quit()


@needs_browser
def test_pages_open_without_errors_and_ask_nothing_of_a_network(browser, pages):
    for path in pages:
        opened(browser, path)
        assert [said for said in browser.get_log("browser") if said["level"] != "INFO"] == []
        asked = requests_of(browser)
        assert len(asked) >= 4
        assert [url for url in asked if not url.startswith(OWN)] == []


BESIDE = """
const inside = "pre, .pst-scrollable-table-container, .formula";
return [...document.querySelectorAll("article *")].filter((node) => !node.closest(inside)
  && node.getBoundingClientRect().right > innerWidth).map((node) => node.textContent);
"""


@needs_browser
def test_pages_fit_on_a_phone(browser, pages):
    """Only code, tables and formulas may be wider, and scroll by themselves."""
    for path in pages:
        opened(browser, path, width=PHONE, touch=True)
        wide = browser.execute_script("return document.documentElement.scrollWidth")
        assert wide <= PHONE, path.name
        assert browser.execute_script(BESIDE) == [], path.name


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_text_can_be_read_by_day_and_by_night(browser, pages, dark):
    for path in pages:
        opened(browser, path, dark=dark)
        found = browser.execute_script(CONTRASTS, TEXTS)
        assert len(found) > 30
        assert [text for contrast, text in found if contrast < READABLE] == [], path.name
    light = browser.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (light == "rgb(255, 255, 255)") != dark


@needs_browser
def test_a_word_can_be_searched_for(browser, site):
    from selenium.webdriver.support.wait import WebDriverWait

    opened(browser, site / "search.html")
    browser.get(f"{(site / 'search.html').as_uri()}?q=regulus")
    found = WebDriverWait(browser, 60).until(
        lambda driver: driver.execute_script(
            "return [...document.querySelectorAll('#search-results li a')].map((a) => a.href)"
        )
    )
    assert any("mathematics.html" in address for address in found)
