"""The tables of the page on architecture, written into it from what the tests hold the imports to.

``python docs/scripts/architecture.py`` brings the page up to date; a test fails if it is not.
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "architecture.md"

sys.path.insert(0, str(ROOT))

from tests.test_architecture import EXCEPTIONS, MAY_KNOW  # noqa: E402


def holds(package: str) -> str:
    """Return what a package holds, the first paragraph of its docstring."""
    path = ROOT / "gearmbs" / Path(*package.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    about = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(about.partition("\n\n")[0].split())


def packages(inside: bool) -> str:
    """Return the table of what packages hold, of those inside ``gearmbs.dae`` or of the others."""
    names = [name for name in reversed(MAY_KNOW) if name.startswith("dae.") == inside]
    return "\n".join(["| package | holds |", "|---|---|", *(f"| `gearmbs.{n}` | {holds(n)} |" for n in names)])


def imports() -> str:
    """Return the table of what each package may import."""
    rows = ["| package | imports | for one purpose only |", "|---|---|---|"]
    for name in reversed(MAY_KNOW):
        known = ", ".join(f"`{other}`" for other in sorted(MAY_KNOW[name])) or "nothing"
        purposes = "; ".join(f"`{b}`: {why}" for (a, b), why in sorted(EXCEPTIONS.items()) if a == name)
        rows.append(f"| `{name}` | {known} | {purposes} |")
    return "\n".join(rows)


def page() -> str:
    """Return the page with its tables as they must be."""
    text = PAGE.read_text(encoding="utf-8")
    for name, table in (("packages", packages(False)), ("dae", packages(True)), ("imports", imports())):
        begin, end = f"<!-- {name}: written by docs/scripts/architecture.py -->\n", f"\n<!-- end of {name} -->\n"
        text = re.sub(
            f"(?<={re.escape(begin)}).*?(?={re.escape(end)})", lambda _, t=table: f"\n{t}\n", text, flags=re.S
        )
    return text


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
