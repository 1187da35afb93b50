"""What the build takes from pages leaves what is read, and what the site may weigh is held."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest
from PIL import Image

from tests.docs.support import DOCS
from tests.says import says

sys.path.insert(0, str(DOCS / "scripts"))
import offline

THEME = """<!doctype html>
<html lang="en" data-content_root="../">
  <head><style>
    body {
      color: black;
    }
  </style></head>
  <body>

<svg xmlns="http://www.w3.org/2000/svg" style="display: none;">
  <symbol id="svg-menu" viewBox="0 0 24 24">
    <title>Menu</title>
  </symbol>
  <symbol id="svg-sun" viewBox="0 0 24 24">
    <path d="M0 0"/>
  </symbol>
  <symbol id="svg-eye" viewBox="0 0 24 24"></symbol>
</svg>

<input type="checkbox">
      <svg><use href="#svg-menu"></use></svg>
      <svg><use href="#svg-sun"></use></svg>
    <p>a
       b</p>
<pre>def f():
    return 1
</pre>
<iframe srcdoc="<script>
    // a line
    const x = 1;</script>"></iframe>
  </body>
</html>
"""


@pytest.fixture
def site(tmp_path):
    (tmp_path / "_static").mkdir()
    (tmp_path / "_images").mkdir()
    return SimpleNamespace(builder=SimpleNamespace(format="html"), outdir=str(tmp_path))


def test_pages_share_the_icons_of_scripts_and_keep_the_others_and_what_is_shown_as_written():
    known: dict[str, str] = {}
    page = offline.lightened(THEME, known)
    assert list(known) == ["svg-sun"]
    assert 'symbol id="svg-menu"' in page
    assert 'symbol id="svg-sun"' not in page
    assert 'symbol id="svg-eye"' not in page
    assert '<script defer src="../_static/icons.js"></script>' in page
    for kept in ("<pre>def f():\n    return 1\n</pre>", "    // a line\n    const x = 1;", "<p>a\nb</p>"):
        assert kept in page
    assert len(page) < 0.9 * len(THEME)
    assert offline.lightened(page, known) == page


def test_the_icons_stay_where_a_build_writes_no_page_anew(site, tmp_path):
    (tmp_path / "page.html").write_text(THEME, encoding="utf-8")
    offline.lighten_pages(site, None)
    script = (tmp_path / "_static" / "icons.js").read_text(encoding="utf-8")
    assert 'id=\\"svg-sun\\"' in script
    offline.lighten_pages(site, None)
    assert (tmp_path / "_static" / "icons.js").read_text(encoding="utf-8") == script


def test_pages_of_objects_load_nothing_of_notebooks(site, tmp_path):
    link = '<link rel="stylesheet" href="../_static/mystnb.1.css" />\n'
    for folder in ("_modules", "howto"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "page.html").write_text(link + THEME, encoding="utf-8")
    offline.lighten_pages(site, None)
    assert "mystnb" not in (tmp_path / "_modules" / "page.html").read_text(encoding="utf-8")
    assert "mystnb" in (tmp_path / "howto" / "page.html").read_text(encoding="utf-8")


def test_figures_have_few_colours_where_nobody_sees_it(site, tmp_path):
    lines = Image.new("RGB", (200, 200), "white")
    for k in range(200):
        lines.putpixel((k, k), (k, 0, 255 - k))
    seen = Image.effect_noise((200, 200), 100.0)
    noise = Image.merge("RGB", (seen, Image.effect_noise((200, 200), 100.0), Image.effect_noise((200, 200), 100.0)))
    clear = Image.new("RGBA", (50, 50), (0, 0, 0, 0))
    for name, image in {"lines": lines, "noise": noise, "clear": clear}.items():
        image.save(tmp_path / "_images" / f"{name}.png")
    offline.lighten_figures(site, None)
    modes = {path.stem: Image.open(path).mode for path in (tmp_path / "_images").iterdir()}
    assert modes == {"lines": "P", "noise": "RGB", "clear": "RGBA"}


def test_the_index_of_all_letters_goes_with_its_link(site, tmp_path):
    (tmp_path / "genindex-all.html").write_text("all", encoding="utf-8")
    (tmp_path / "genindex.html").write_text('a\n<p>\n <a href="genindex-all.html">All\n</a></p>b', encoding="utf-8")
    offline.without_full_index(site, None)
    assert not (tmp_path / "genindex-all.html").exists()
    assert (tmp_path / "genindex.html").read_text(encoding="utf-8") == "a\nb"


def test_what_the_site_weighs_is_held(site, tmp_path, monkeypatch):
    (tmp_path / "page.html").write_text("x" * 400_000, encoding="utf-8")
    with pytest.raises(RuntimeError, match=says("0.4", "page.html")):
        offline.hold_size(site, None)
    (tmp_path / "page.html").write_text("<iframe></iframe>" + "x" * 400_000, encoding="utf-8")
    offline.hold_size(site, None)
    monkeypatch.setattr(offline, "MOST", 3e5)
    with pytest.raises(RuntimeError, match=says("0.4", "0.3")):
        offline.hold_size(site, None)
