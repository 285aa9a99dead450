"""How Sphinx makes a site of these pages: `python -m sphinx -W -b html docs DIR`.

The site asks nothing of a network: formulas are MathML, which browsers set themselves, and fonts
are those of the reader's machine.
"""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

sys.path.insert(0, str(Path(__file__).parent))
import api_reference

from sim_validate.schemas.file_schemas import KINDS, schema_text

project = "graspproof"
version = release = version_of("graspproof")
extensions = ["myst_nb"]
exclude_patterns = ["site"]
templates_path = ["site"]

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = {"math"}  # what GitHub typesets as well
myst_heading_anchors = 4
nb_execution_mode = "off"  # `python -m tests.notebooks` keeps their outputs, and tests compare them

html_title = project
html_theme = "pydata_sphinx_theme"
html_theme_options = {
    "navbar_center": [],
    "navbar_end": ["theme-switcher"],
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
    "footer_start": [],
    "footer_end": [],
}
html_context = {"default_mode": "auto"}  # light or dark, as the reader's machine is
html_sidebars = {"**": ["all-pages.html"]}
html_css_files = ["site.css"]
html_static_path = ["site/static"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False


def setup(app: Sphinx) -> None:
    """Have formulas written as MathML, the page of all functions made, and the schemas of files."""
    app.add_html_math_renderer("mathml", (written_inline, None), (written_as_block, None))
    app.connect("builder-inited", lambda app: api_reference.write(app.srcdir / "api" / "api.md"))
    app.connect("build-finished", write_schemas)


def write_schemas(app: Sphinx, fault: Exception | None) -> None:
    """Write the schemas of all kinds of files, of which a release has copies at their addresses."""
    if fault is None:
        folder = Path(app.outdir, "schemas")
        folder.mkdir(exist_ok=True)
        for name in KINDS:
            (folder / f"{name}.json").write_text(schema_text(name), encoding="utf-8")


def written_inline(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    writer.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def written_as_block(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula on lines of its own, which scroll by themselves on narrow screens."""
    writer.body.append(f'<div class="formula">{mathml(node, as_block=True)}</div>')
    raise nodes.SkipNode


def mathml(node: nodes.math | nodes.math_block, *, as_block: bool) -> str:
    """Return a formula as MathML; one that docutils cannot read is a warning."""
    try:
        return tex2mathml(node.astext(), as_block=as_block)
    except MathError as error:
        logging.getLogger(__name__).warning("no formula: %s", error, location=node)
        return ""
