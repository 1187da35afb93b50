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


def refuse_servers(app, failed) -> None:
    """Raise an error if a page needs a script from a server: the site is to be read without a network."""
    for page in () if failed else Path(app.outdir).rglob("*.html"):
        found = re.search(r'<script[^>]+src="(https?://[^"]+)', page.read_text(encoding="utf-8"))
        if found:
            raise RuntimeError(f"{page.name} loads {found[1]}; give the script with the site")
