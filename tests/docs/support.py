"""Code blocks and links of Markdown pages, for the tests of the documentation."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^(?P<fence>`{3,}|:{3,})(?P<info>[^\n`]*)\n(?P<code>.*?)^(?P=fence)\s*$", re.M | re.S)
LINK = re.compile(r"(?<!!)\[[^\]]*\]\((?P<target>[^)\s]+)\)|!\[[^\]]*\]\((?P<image>[^)\s]+)\)")


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its text and the line on which the text begins."""

    language: str
    code: str
    line: int


def pages() -> list[Path]:
    """Return the Markdown pages of the documentation."""
    return sorted(p for p in DOCS.rglob("*.md") if not {"_build", "_generated"} & set(p.parts))


def blocks(path: Path) -> Iterator[Block]:
    """Yield the fenced blocks of a page."""
    text = path.read_text(encoding="utf-8")
    for match in FENCE.finditer(text):
        info = match["info"].strip()
        language = "code-cell" if info.startswith("{code-cell}") else info.split(" ")[0]
        code = re.sub(r"\A(:[a-z-]+:.*\n)+", "", match["code"])
        yield Block(language, code, text.count("\n", 0, match.start("code")) + 1)


def run_blocks(path: Path, language: str) -> dict[str, object]:
    """Execute a page's blocks of a language in one namespace, as a notebook does; return the namespace."""
    namespace: dict[str, object] = {"__name__": "__main__"}
    scripts = str(DOCS / "scripts")
    if scripts not in sys.path:
        sys.path.insert(0, scripts)
    for block in blocks(path):
        if block.language == language:
            run_cell(block.code, f"{path.name}:{block.line}", namespace)
    return namespace


def run_cell(code: str, name: str, namespace: dict[str, object]) -> object:
    """Execute one cell and return the value of its last expression."""
    tree = ast.parse(code, name)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, name, "exec", dont_inherit=True), namespace)
    if last is None:
        return None
    value = eval(compile(ast.Expression(last.value), name, "eval"), namespace)
    for method in ("_repr_html_", "_repr_markdown_"):
        if hasattr(value, method):
            getattr(value, method)()
    repr(value)
    return value


def links(path: Path) -> list[str]:
    """Return the targets of a page's Markdown links and images, outside code."""
    text = FENCE.sub("", path.read_text(encoding="utf-8"))
    text = re.sub(r"`[^`\n]*`", "", text)
    return [m["target"] or m["image"] for m in LINK.finditer(text)]
