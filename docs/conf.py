"""Sphinx: docs/ as a book. tools/book builds it, and gives the paths below."""

import logging
import os
import re

project = "Mantle"
author = "The Mantle authors"
copyright = author
release = version = os.environ["MANTLE_BOOK_VERSION"]

extensions = ["myst_parser", "breathe", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
suppress_warnings = ["myst.mathjax"]  # what it would tell about MathJax 3; this is 2
exclude_patterns = ["_static"]
nitpicky = False

breathe_projects = {"mantle": os.environ["MANTLE_BOOK_XML"]}
breathe_default_project = "mantle"
breathe_default_members = ("members",)
breathe_show_include = False
primary_domain = "cpp"
highlight_language = "none"

html_theme = "furo"
html_title = f"Mantle {release}"
html_static_path = ["_static", os.environ["MANTLE_BOOK_MATHJAX"]]
html_css_files = ["book.css"]
html_copy_source = False
html_show_sphinx = False
# The summaries under a search's results are fetched, which a browser refuses from file://.
html_show_search_summary = False
html_theme_options = {"navigation_with_keys": True}

# MathJax of the distribution, copied into the book. Formulas are drawn as SVG: their shapes come with
# the scripts, where fonts would be refused from file://.
mathjax_path = "mathjax/MathJax.js"
mathjax_options = {"async": "async"}
mathjax2_config = {
    "jax": ["input/TeX", "output/SVG"],
    "extensions": ["tex2jax.js", "TeX/AMSmath.js", "TeX/AMSsymbols.js", "TeX/noErrors.js"],
    "tex2jax": {
        "inlineMath": [["\\(", "\\)"]],
        "displayMath": [["\\[", "\\]"]],
        "ignoreClass": "tex2jax_ignore|mathjax_ignore",
        "processClass": "tex2jax_process|mathjax_process|math|output_area",
    },
    "messageStyle": "none",
    "showMathMenu": False,
    "SVG": {"font": "TeX", "linebreaks": {"automatic": True}},
}


def setup(app):
    """Every header opens its namespaces anew, which is no second definition of them."""
    opened = re.compile(r"Declaration is '\.\. cpp:type:: mantle(::[a-z_]+)*'\.$")
    logging.getLogger("sphinx.sphinx.domains.cpp").addFilter(lambda record: not opened.search(record.getMessage()))
