"""What an identification has simulated, kept in a folder: each result is a file that appears when it is whole.

Results are found again by the case, its parameters' values included, what was asked of it and the code that simulated
it: another version of the program, or another case, simulates anew.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.files import write_whole

if TYPE_CHECKING:
    from gearmbs.identify.parameters import Free
    from gearmbs.studies import Case

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

    def levels(self, case: Case, by: str, way: str) -> dict[tuple[str, int], float] | None:
        """Return the levels of a case, by component and harmonic; None if they are not there."""
        found = self._read("levels", case.model_dump_json(), by, way)
        return None if found is None else {(c, int(h)): float(v) for c, h, v in found}

    def keep_levels(self, case: Case, by: str, way: str, levels: dict[tuple[str, int], float]) -> None:
        """Keep the levels of a case; those of one that failed are none."""
        self._write([[c, h, v] for (c, h), v in levels.items()], "levels", case.model_dump_json(), by, way)

    def slopes(
        self, case: Case, free: Sequence[Free | None], rows: Sequence[tuple[str, int]], way: str
    ) -> np.ndarray | None:
        """Return the derivatives of rows of a table, shape (rows, parameters); None if they are not there."""
        found = self._read("slopes", case.model_dump_json(), _shown(free), list(rows), way)
        return None if found is None else np.array(found, dtype=float).reshape(len(rows), len(free))

    def keep_slopes(
        self, case: Case, free: Sequence[Free | None], rows: Sequence[tuple[str, int]], way: str, slopes: np.ndarray
    ) -> None:
        """Keep the derivatives of rows of a table."""
        self._write(slopes.tolist(), "slopes", case.model_dump_json(), _shown(free), list(rows), way)

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


def _shown(free: Sequence[Free | None]) -> list[Any]:
    return [None if item is None else [item.name, sorted(item.also.items())] for item in free]
