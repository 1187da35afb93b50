"""Results that take long, kept with a key of all code that they come from, and made again by one command.

A page shows what is kept while the key is that of the code; else the build makes it again, which takes as long as it
takes. ``python docs/scripts/kept.py`` makes and keeps all whose code has changed.
"""

from __future__ import annotations

import hashlib
import io
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


@dataclass(frozen=True)
class Kept:
    """A table, how it is made, and the files and folders whose code decides it.

    Attributes
    ----------
    make : callable
    sources : tuple of str
        Relative to the root of the checkout.
    """

    make: Callable[[], pd.DataFrame]
    sources: tuple[str, ...]

    def key(self) -> str:
        """Return a digest of what the sources do; comments and docstrings do not count."""
        from gearmbs.studies.run.code import what_counts

        digest = hashlib.sha256()
        for source in self.sources:
            place = ROOT / source
            for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
                digest.update(f"{path.relative_to(ROOT).as_posix()} {what_counts(path.read_bytes())}\n".encode())
        return digest.hexdigest()[:24]


def _speed_search() -> pd.DataFrame:
    import speed_search

    return speed_search.outcomes(40, first_seed=1000)


SPEED_SEARCH = (
    "docs/scripts/speed_search.py",
    *(
        f"gearmbs/signals/{name}.py"
        for name in ("filters", "resampling", "spectra", "rotation/phase", "rotation/speed")
    ),
    "gearmbs/signals/signal/signal.py",
)
"""What finds a speed, without the ways in for files and data of other shapes."""

TABLES = {"speed_search": Kept(_speed_search, SPEED_SEARCH)}


def place(name: str) -> Path:
    """Return the file of a table."""
    return HERE.parent / "data" / f"{name}.kept.json"


def kept(name: str) -> pd.DataFrame:
    """Return a table: what is kept of this code, or made now."""
    table, path = TABLES[name], place(name)
    if path.is_file():
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["key"] == table.key():
            return pd.read_json(io.StringIO(json.dumps(found["table"])), orient="split")
    return table.make()


def keep(name: str) -> Path:
    """Make a table, keep it with its key and return the file."""
    table = TABLES[name]
    content = {"key": table.key(), "table": json.loads(table.make().to_json(orient="split", double_precision=6))}
    place(name).write_text(json.dumps(content) + "\n", encoding="utf-8")
    return place(name)


if __name__ == "__main__":
    sys.path.insert(0, str(HERE))
    for name, table in TABLES.items():
        path = place(name)
        if not path.is_file() or json.loads(path.read_text(encoding="utf-8"))["key"] != table.key():
            print(f"kept {keep(name)}")
