"""An ADAMS deck with ``${parameters}`` as the subject of a campaign."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.subjects.base import Kept, Subject, kept_by_functions

PLACE = re.compile(r"\$\{([A-Za-z_][A-Za-z0-9_]*)\}")


class DeckSubject(Subject):
    """A deck whose text holds ``${name}`` where a parameter goes, in the deck's own units.

    Keeps ``requests``: of every column of the requests the last, mean, RMS about the mean, least and largest value, as
    ``NAME.COLUMN.max``.

    Parameters
    ----------
    text : str
        The deck.
    parameters : dict of float
        Values of its places.
    end : float
        End of the analysis, in the deck's unit of time.
    steps : int
        Output steps.
    """

    kind: ClassVar[str] = "deck"
    keeps: ClassVar[tuple[str, ...]] = ("requests",)

    def __init__(self, text: str, parameters: dict[str, float], *, end: float, steps: int = 100) -> None:
        places = set(PLACE.findall(text))
        if places != set(parameters):
            raise CampaignError(
                f"deck: it has the places {', '.join(sorted(places)) or 'none'}, parameters are given for "
                f"{', '.join(sorted(parameters)) or 'none'}; give a value to each place ${{name}}"
            )
        self.text, self.parameters = text, {k: float(v) for k, v in parameters.items()}
        self.end, self.steps = float(end), int(steps)

    @classmethod
    def from_file(cls, path: str | Path, parameters: dict[str, float], *, end: float, steps: int = 100) -> DeckSubject:
        """Return the subject of a deck in a file."""
        return cls(Path(path).read_text(encoding="utf-8", errors="replace"), parameters, end=end, steps=steps)

    def settings(self) -> dict[str, Any]:
        """Return the text and the values."""
        return {"text": self.text, "parameters": self.parameters, "end": self.end, "steps": self.steps}

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> DeckSubject:
        """Return the subject of a plan, which holds the deck's text or names its file."""
        given = dict(settings)
        if "file" in given:
            return cls.from_file(given.pop("file"), **given)
        return cls(**given)

    def base(self) -> dict[str, Any]:
        """Return the parameters."""
        return dict(self.parameters)

    def unit_of(self, path: str) -> str:
        """Return "1": a deck's numbers are in its own units."""
        if path not in self.parameters:
            raise CampaignError(f"{path}: the deck has no place ${{{path}}}; known are {', '.join(self.parameters)}")
        return "1"

    def check(self, data: dict[str, Any], name: str) -> dict[str, Any]:
        """Return the deck's text with the values in their places, and the values."""
        values = {key: float(value) for key, value in data.items()}
        text = PLACE.sub(lambda match: f"{values[match[1]]:.17G}", self.text)
        return {"text": text, "values": values}

    def canonical(self, thing: dict[str, Any]) -> Any:
        """Return the digest of the template, the values and the span."""
        digest = hashlib.sha256(self.text.encode()).hexdigest()
        return {"deck": digest, "values": thing["values"], "end": self.end, "steps": self.steps}

    def run(self, thing: dict[str, Any], progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Run the deck and return its requests: arrays by name and column."""
        from gearmbs.adams import run_deck

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.adm"
            path.write_text(thing["text"], encoding="utf-8")
            result = run_deck(path, None, Path(folder) / "out", end=self.end, steps=self.steps)
            progress(1.0)
            if not result.success:
                raise RuntimeError("; ".join(str(m) for m in result.messages)[-2000:])
            return requests_of(result)

    def reduce(self, thing: dict[str, Any], record: dict[str, np.ndarray], keep: Sequence[str]) -> Kept:
        """Return numbers of every column of the requests."""
        kept = Kept(numbers=kept_by_functions(keep, record))
        if "requests" in keep:
            for name, values in record.items():
                x = np.asarray(values, dtype=float)
                found = {"last": x[-1], "mean": x.mean(), "rms": x.std(), "min": x.min(), "max": x.max()}
                kept.numbers |= {f"{name}.{what}": float(value) for what, value in found.items()}
        return kept


def requests_of(result: Any) -> dict[str, np.ndarray]:
    """Return the columns of the requests of a deck's result, by ``request_NUMBER.COLUMN``; those that are zero are
    left out."""
    data = result.to_dataset()
    found = {}
    for name in data.data_vars:
        if not str(name).startswith("request_"):
            continue
        for k, column in enumerate(data[f"{name}_column"].values):
            values = np.asarray(data[name].values[:, k], dtype=float)
            if values.any():
                found[f"{name}.{column}"] = values
    return found
