"""The pages of docs/ become a site that can be read anywhere."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.browser import OWN, headless, needs_browser, opened, requests_of

pytest.importorskip("sphinx")
pytest.importorskip("myst_nb")
pytest.importorskip("pydata_sphinx_theme")

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
DEVELOPING = (DOCS / "developing.md").read_text()
COMMAND = re.search(r"python (-m sphinx -W .*) docs site/html  #", DEVELOPING)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A build in which every warning is an error, a link that leads nowhere among them."""
    folder = tmp_path_factory.mktemp("site") / "html"
    words = [sys.executable, *shlex.split(COMMAND[1]), "--keep-going", "-q", str(DOCS), str(folder)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def test_every_page_and_notebook_is_in_the_site(site):
    for path in (path for kind in ("*.md", "*.ipynb") for path in DOCS.rglob(kind)):
        assert (site / path.relative_to(DOCS)).with_suffix(".html").is_file()


def test_the_site_describes_every_public_function_and_class(site):
    text = (site / "api" / "api.html").read_text()
    for package in ("grasp_core", "scenes", "sim_validate"):
        for name in __import__(package).__all__:
            assert re.search(rf"<h3>(class )?<code[^>]*><span class=\"pre\">\w+\.{name}\b", text), (
                name
            )


@needs_browser
def test_pages_open_without_errors_and_ask_nothing_of_a_network(site, tmp_path):
    with headless(tmp_path) as browser:
        for path in (path for path in site.rglob("*.html") if "_static" not in path.parts):
            opened(browser, path)
            assert [said for said in browser.get_log("browser") if said["level"] != "INFO"] == []
            asked = requests_of(browser)
            assert len(asked) >= 4
            assert [url for url in asked if not url.startswith(OWN)] == []
