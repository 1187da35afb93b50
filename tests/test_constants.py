"""Every float constant of the package says what it is: its formula, its source, or that it is tuned."""

import re
from pathlib import Path

import gearmbs

ROOT = Path(gearmbs.__file__).parent
FLOAT = re.compile(r"^(_?[A-Z][A-Z0-9_]*)(?:: float)? = -?(?:\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+)\s*(#.*)?$")


def silent(text: str) -> list[str]:
    """Return the float constants of a module without a docstring, a comment on their line or one above."""
    lines = ["", *text.splitlines(), ""]
    found = []
    for before, line, after in zip(lines, lines[1:], lines[2:]):
        constant = FLOAT.match(line)
        if constant and not (constant[2] or before.startswith("#") or after.startswith('"""')):
            found.append(constant[1])
    return found


def test_every_float_constant_has_a_word():
    wrong = {}
    for path in sorted(ROOT.rglob("*.py")):
        names = silent(path.read_text(encoding="utf-8"))
        if names:
            wrong[str(path.relative_to(ROOT))] = names
    assert not wrong


def test_what_counts_as_a_word():
    assert silent("A = 1e-3\nB = 2.5\n") == ["A", "B"]
    assert silent('A = 1e-3\n"""Why."""\nB = 2.5  # why\n# why\nC = -1.0\nD = 3\nE = (1.0, 2.0)\n') == []
