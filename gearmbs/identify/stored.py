"""What an identification has simulated, kept in a folder: each result is a file that appears when it is whole.

Results are found again by the case, its parameters' values included, what was asked of it and the code that simulated
it: another version of the program, or another case, simulates anew; other rows of a table, in another order, or other
parameters beside those that are known do not.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearmbs.files import write_whole

if TYPE_CHECKING:
    from gearmbs.identify.parameters import Free
    from gearmbs.studies import Case

Levels = dict[tuple[str, int], float]

STEM = 24
"""Digits of a file's name: of a million results two share one with a probability of 1e-17."""


@dataclass(frozen=True)
class Stored:
    """A folder of results.

    Attributes
    ----------
    folder : Path
    """

    folder: Path

    def levels(self, case: Case, by: str, way: str) -> Levels | None:
        """Return the levels of a case, by component and harmonic; None if they are not there."""
        return self._levels_of("levels", case.model_dump_json(), by, way)

    def keep_levels(self, case: Case, by: str, way: str, levels: Levels) -> None:
        """Keep the levels of a case; those of one that failed are none."""
        self._write(_rows(levels), "levels", case.model_dump_json(), by, way)

    def slopes(self, case: Case, by: Free, way: str) -> Levels | None:
        """Return the derivatives of the logarithms of a case's levels by a parameter; None if they are not there."""
        return self._levels_of("slopes", case.model_dump_json(), _shown(by), way)

    def keep_slopes(self, case: Case, by: Free, way: str, slopes: Levels) -> None:
        """Keep the derivatives of the logarithms of a case's levels by a parameter."""
        self._write(_rows(slopes), "slopes", case.model_dump_json(), _shown(by), way)

    def _levels_of(self, *what: Any) -> Levels | None:
        found = self._read(*what)
        return None if found is None else {(c, int(h)): float(v) for c, h, v in found}

    def _path(self, *what: Any) -> Path:
        from gearmbs.studies.run.code import code_of

        text = json.dumps([code_of().digest, *what])
        return self.folder / f"{hashlib.sha256(text.encode()).hexdigest()[:STEM]}.json"

    def _read(self, *what: Any) -> Any:
        try:
            return json.loads(self._path(*what).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            # not there, or damaged: simulated again
            return None

    def _write(self, result: Any, *what: Any) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        write_whole(self._path(*what), json.dumps(result))


def _rows(levels: Levels) -> list[list[Any]]:
    return [[c, h, v] for (c, h), v in levels.items()]


def _shown(by: Free) -> list[Any]:
    """Return what a parameter moves of a case, whatever it is called."""
    return sorted([path.rpartition(":")[2], factor] for path, factor in by.also.items())
