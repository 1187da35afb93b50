"""What the site carries so that it is read without a network, and no more of it than pages use."""

from __future__ import annotations

import importlib
import re
import shutil
from pathlib import Path

MATHJAX = (
    "tex-chtml.js",
    "output/chtml",
    "input/tex/extensions",
    "a11y",
    "sre/mathmaps/base.json",
    "sre/mathmaps/en.json",
)
"""Of MathJax: the reader of TeX, output as text with its fonts, and what reads formulas aloud; 3 of 24 MB."""


def carry_mathjax(app, failed) -> None:
    """Copy the parts of MathJax to the site."""
    if failed or app.builder.format != "html":
        return
    source = Path(importlib.import_module("sphinx-mathjax-offline").__file__).parent / "static" / "mathjax"
    target = Path(app.outdir, "_static", "mathjax")
    for part in MATHJAX:
        if (source / part).is_dir():
            shutil.copytree(source / part, target / part, dirs_exist_ok=True)
        else:
            (target / part).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / part, target / part)


UNSTYLED = re.compile(r'<span class="(?:n|p|w|o)">([^<]*)</span>')
"""Names, punctuation, blanks and operators of a source: the style gives them no colour worth their marks."""


def lighten_sources(app, failed) -> None:
    """Take the marks of uncoloured words from the pages of sources, half of what they hold."""
    for page in () if failed else Path(app.outdir, "_modules").rglob("*.html"):
        page.write_text(UNSTYLED.sub(r"\1", page.read_text(encoding="utf-8")), encoding="utf-8")


def level_headings(*given) -> None:
    """Give the captions of the sidebar, which the theme makes headings, the level that screen readers ask for."""
    context = given[3]
    tree = context.get("furo_navigation_tree")
    if tree:
        context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')


def refuse_servers(app, failed) -> None:
    """Raise an error if a page needs a script from a server: the site is to be read without a network."""
    for page in () if failed else Path(app.outdir).rglob("*.html"):
        found = re.search(r'<script[^>]+src="(https?://[^"]+)', page.read_text(encoding="utf-8"))
        if found:
            raise RuntimeError(f"{page.name} loads {found[1]}; give the script with the site")
