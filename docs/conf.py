"""Sphinx configuration of the gearmbs documentation."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = HERE / "scripts"
sys.path.insert(0, str(SCRIPTS))

import api_pages  # noqa: E402
import asked_kernels  # noqa: E402
import offline  # noqa: E402
import thumbnails  # noqa: E402

import gearmbs  # noqa: E402

# executed pages import the drawing and checking scripts; one thread each, as in the studies
os.environ["PYTHONPATH"] = os.pathsep.join([str(SCRIPTS), str(HERE.parent), os.environ.get("PYTHONPATH", "")])
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
os.environ["GEARMBS_PROGRESS"] = "0"

# the kernels' remark about their transport is no fault of a page
profile = HERE / "_build" / "ipython" / "profile_default"
profile.mkdir(parents=True, exist_ok=True)
(profile / "ipython_kernel_config.py").write_text("get_config().IPKernelApp.log_level = 40\n", encoding="utf-8")
os.environ["IPYTHONDIR"] = str(profile.parent)
(profile / "startup").mkdir(exist_ok=True)
(profile / "startup" / "kernels_of_a_page.py").write_text(asked_kernels.STARTUP, encoding="utf-8")


def code_stamp() -> str:
    """Return a number of the code and data that executed pages depend on, so that none is kept beyond a change."""
    digest = hashlib.sha256()
    root = HERE.parent
    code = [(root / "gearmbs", "*.py"), (root / "gearmbs", "*.pyi"), (root / "benchmarks", "*.py")]
    sources = [*code, (SCRIPTS, "*.py"), (HERE / "data", "*.*")]
    for folder, ending in sources:
        for path in sorted(folder.rglob(ending)):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


project = "gearmbs"
author = "the gearmbs developers"
copyright = "2026, the gearmbs developers"
release = version = gearmbs.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_copybutton",
    "sphinx_design",
]
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
exclude_patterns = ["_build", "scripts", "data", "**/.ipynb_checkpoints"]
myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE / "_build" / f"executed-{code_stamp()}")
os.environ[asked_kernels.NOTES] = f"{nb_execution_cache_path}-kernels.txt"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_show_tb = True
nb_merge_streams = True
nb_render_markdown_format = "myst"

autosummary_generate = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

mathjax_path = "mathjax/tex-chtml.js"

templates_path = ["_templates"]
html_theme = "furo"
html_title = f"gearmbs {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_copy_source = False
html_split_index = True
short = [f"sidebar/{part}.html" for part in ("brand", "search", "scroll-start", "ideas", "scroll-end")]
html_sidebars = {"_generated/objects/**": short, "_modules/**": short}
html_theme_options = {"navigation_with_keys": True}
pygments_style = "default"
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True


def setup(app) -> None:
    """Write the API pages and let autodoc see through compiled functions and docstrings' vertical bars."""
    api_pages.write(HERE / "_generated")
    api_pages.unwrap_compiled()
    app.connect("html-page-context", offline.level_headings, priority=900)
    app.connect("env-before-read-docs", thumbnails.drawn_first)
    app.connect("doctree-read", thumbnails.draw)
    app.connect("autodoc-process-docstring", api_pages.escape_bars, priority=100)
    app.connect("build-finished", asked_kernels.check)
    app.connect("build-finished", offline.carry_mathjax)
    app.connect("build-finished", offline.lighten_sources)
    app.connect("build-finished", offline.lighten_figures)
    app.connect("build-finished", offline.lighten_pages)
    app.connect("build-finished", offline.without_full_index)
    app.connect("build-finished", offline.refuse_servers)
    app.connect("build-finished", offline.hold_size)
