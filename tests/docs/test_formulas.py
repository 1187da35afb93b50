"""Formulas of a page of the site, built with the site's configuration, are typeset where there is no network."""

import re
import subprocess
import sys

import pytest

from tests.browser import browsed, needs_browser
from tests.docs.support import DOCS

PAGE = """# Formulas

Inline $G(t, y, \\dot y) = 0$ and $\\tfrac{1}{2} m v^2$, displayed

$$
\\mathbf M(\\mathbf q)\\,\\dot{\\mathbf v} + \\mathbf C^{\\mathsf T}\\boldsymbol\\lambda = \\mathbf f
$$ (motion)

```{math}
\\begin{aligned} a &= b \\\\ c &= \\sum_{k=1}^{n} k \\end{aligned}
```
"""


@needs_browser
@pytest.mark.slow
def test_formulas_are_typeset_without_a_network(tmp_path):
    for module in ("sphinx", "myst_nb", "furo", "numpydoc", "sphinx_copybutton", "sphinx_design"):
        pytest.importorskip(module, reason="the documentation's packages are not installed (extra 'docs')")
    source, site = tmp_path / "source", tmp_path / "site"
    source.mkdir()
    (source / "index.md").write_text(PAGE, encoding="utf-8")
    build = [sys.executable, "-m", "sphinx", "-q", "-c", DOCS, "-D", "html_static_path=", "-b", "html", source, site]
    made = subprocess.run(build, capture_output=True, text=True, timeout=300, check=False)
    assert made.returncode == 0, made.stderr
    page = site / "index.html"
    asked = page.read_text(encoding="utf-8").count('class="math notranslate')
    assert asked == 4
    shown = browsed(page.as_uri(), "--dump-dom", tmp_path, milliseconds=20000)
    assert shown.count("<mjx-container") == asked
    assert "<mjx-merror" not in shown
    # letters are drawn by the fonts that come with the site
    assert re.search(r"<mjx-c[ >]", shown)
