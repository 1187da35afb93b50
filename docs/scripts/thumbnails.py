"""Pictures of the front page and of the gallery: each the figure of a page that this build executes, made small.

Pages with a card on another page are read first, so that the figure is there when the card is. The figure is the
first of the cell with the tag ``card``, otherwise the first of the page.
"""

from __future__ import annotations

import re
from pathlib import Path

from docutils import nodes
from PIL import Image

CARD = re.compile(r"_generated/cards/([\w-]+)\.png")
FRONTS = ("index", "notebooks/index")
"""Pages with cards."""
WIDTH, HEIGHT = 480, 300
"""Size of a picture in pixels: twice that of a card on the page, for dense displays."""


def drawn_first(app, _, docnames: list[str]) -> None:
    """Let pages with figures be read before those with cards, which are read again if a card's page is."""
    fronts = [name for name in docnames if name in FRONTS]
    others = [name for name in docnames if name not in FRONTS]
    there = [name for name in FRONTS if Path(app.srcdir, f"{name}.md").is_file()]
    shown = {card for front in there for card in _cards(Path(app.srcdir, f"{front}.md"))}
    if any(name.rpartition("/")[2] in shown for name in others):
        fronts = there
    docnames[:] = [*others, *fronts]


def draw(app, doctree: nodes.document) -> None:
    """Write the card of a page that has just been read."""
    source = _figure(doctree)
    if source is None or app.env.docname in FRONTS:
        return
    folder = Path(app.srcdir, "_generated", "cards")
    folder.mkdir(parents=True, exist_ok=True)
    with Image.open(Path(app.srcdir, source)) as image:
        small = image.convert("RGB")
        small.thumbnail((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
        card = Image.new("RGB", (WIDTH, HEIGHT), "white")
        card.paste(small, ((WIDTH - small.width) // 2, (HEIGHT - small.height) // 2))
        card.quantize(128).save(folder / f"{app.env.docname.rpartition('/')[2]}.png", optimize=True)


def _cards(page: Path) -> list[str]:
    """Return the names of the pages whose cards a page shows."""
    return CARD.findall(page.read_text(encoding="utf-8"))


def _figure(doctree: nodes.document) -> str | None:
    """Return the path of a page's figure within the documentation, none if it has no figure."""
    chosen = [n for n in doctree.findall(nodes.container) if "tag_card" in n.get("classes", ())]
    for part in (*chosen, doctree):
        for image in part.findall(nodes.image):
            if image["uri"].endswith(".png"):
                return image["uri"]
    return None
