"""What the site carries so that it is read without a network, and no more of it than pages use."""

from __future__ import annotations

import importlib
import io
import json
import re
import shutil
from collections.abc import Iterable
from pathlib import Path

from PIL import Image, ImageChops, ImageStat

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


ICONS = re.compile(r'<svg xmlns="[^"]*" style="display: none;">.*?</svg>\s*(?=<input)', re.DOTALL)
"""The icons of the theme, which it writes into each page: 6 of the 15 kB of a short one."""

SYMBOL = re.compile(r'<symbol id="(svg-[\w-]+)".*?</symbol>', re.DOTALL)
WITHOUT_SCRIPTS = ("svg-toc", "svg-menu", "svg-arrow-right")
"""Icons that do something where scripts are off; the others are of buttons of a script, which brings them."""

AS_WRITTEN = re.compile(r"(<(pre|script|style|textarea)\b.*?</\2>|<iframe\b.*?</iframe>)", re.DOTALL)
"""What is shown, or read, with its blanks."""

STYLE = re.compile(r"(?<=<style>).*?(?=</style>)", re.DOTALL)
PLAIN_FOLDERS = ("_modules", "_generated")
"""Folders of pages without outputs of notebooks, cards and tabs."""
OF_OTHERS = re.compile(r"<(link|script)\b[^>]*/(mystnb|sphinx-design|design-tabs)\b[^>]*>(</script>)?\n")
"""What these do not need."""

PLACE = re.compile(r'data-content_root="([^"]*)"')


def lighten_pages(app, failed) -> None:
    """Give all pages one script with the theme's icons in the place of a copy each, and take indents of tags away."""
    if failed or app.builder.format != "html":
        return
    known: dict[str, str] = {}
    for page in Path(app.outdir).rglob("*.html"):
        text = lightened(page.read_text(encoding="utf-8"), known)
        if page.relative_to(app.outdir).parts[0] in PLAIN_FOLDERS:
            text = OF_OTHERS.sub("", text)
        page.write_text(text, encoding="utf-8")
    if not known:
        # of a build that has written no page anew
        return
    script = "document.body.insertAdjacentHTML('beforeend', " + json.dumps(_in_svg(known.values())) + ");\n"
    Path(app.outdir, "_static", "icons.js").write_text(script, encoding="utf-8")


def lightened(text: str, known: dict[str, str]) -> str:
    """Return a page without indents, and with those icons alone that work without scripts; collect the others.

    Parameters
    ----------
    text : str
    known : dict of str to str
        Icons of the script, by name; more are added.
    """
    place = PLACE.search(text)
    icons = ICONS.search(text)
    if place and icons:
        symbols = {m[1]: _plain(m[0]) for m in SYMBOL.finditer(icons[0])}
        used = {name for name in symbols if f'href="#{name}"' in text}
        known |= {name: symbols[name] for name in used if name not in WITHOUT_SCRIPTS}
        kept = _in_svg(symbols[name] for name in WITHOUT_SCRIPTS if name in used)
        script = f'<script defer src="{place[1]}_static/icons.js"></script>\n'
        text = text[: icons.start()] + kept + "\n" + script + text[icons.end() :]
    text = STYLE.sub(lambda m: _plain(m[0]), text)
    parts = AS_WRITTEN.split(text)
    # groups of the pattern: what is kept, and its tag
    return "".join(_plain(part) if k % 3 == 0 else part for k, part in enumerate(parts) if k % 3 != 2)


def _in_svg(symbols: Iterable[str]) -> str:
    return f'<svg xmlns="http://www.w3.org/2000/svg" style="display: none;">{"".join(symbols)}</svg>'


def _plain(text: str) -> str:
    return re.sub(r"\s*\n\s*", "\n", text)


CLOSE = 1.5
"""Mean error of a figure with few colours, of 255: more is seen in shades that run into each other."""


def lighten_figures(app, failed) -> None:
    """Give figures 256 colours, which takes half of their bytes, where nobody sees it."""
    for path in () if failed else Path(app.outdir, "_images").glob("*.png"):
        with Image.open(path) as image:
            full = image.convert("RGB") if image.convert("RGBA").getextrema()[3] == (255, 255) else None
        if full is None:
            continue
        few = full.quantize(256, dither=Image.Dither.NONE)
        moved = ImageStat.Stat(ImageChops.difference(full, few.convert("RGB")))
        content = io.BytesIO()
        few.save(content, "PNG", optimize=True)
        if max(moved.rms) <= CLOSE and content.tell() < path.stat().st_size:
            path.write_bytes(content.getvalue())


def without_full_index(app, failed) -> None:
    """Take away the index of all letters, the largest page: each letter has its own; and maps of scripts."""
    if failed or app.builder.format != "html":
        return
    out = Path(app.outdir)
    for path in (out / "genindex-all.html", *(out / "_static").rglob("*.map")):
        path.unlink(missing_ok=True)
    start = out / "genindex.html"
    if start.is_file():
        start.write_text(FULL_INDEX.sub("", start.read_text(encoding="utf-8")), encoding="utf-8")


FULL_INDEX = re.compile(r'<p>\s*<a href="genindex-all\.html">.*?</p>', re.DOTALL)


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


MOST, OF_A_PAGE = 40e6, 300e3
"""Bytes of the site, and of a page where nothing moves."""


def hold_size(app, failed) -> None:
    """Raise an error if the site, or a page without a scene to turn, has become too large."""
    if failed or app.builder.format != "html":
        return
    out = Path(app.outdir)
    files = [path for path in out.rglob("*") if path.is_file() and ".doctrees" not in path.parts]
    size = sum(path.stat().st_size for path in files)
    large = [
        path.name
        for path in files
        if path.suffix == ".html" and path.stat().st_size > OF_A_PAGE and b"<iframe" not in path.read_bytes()
    ]
    if size > MOST or large:
        raise RuntimeError(f"the site has {size / 1e6:.1f} MB of {MOST / 1e6:g}; too large are {large or 'no pages'}")
