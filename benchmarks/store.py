"""Parts of a benchmark on disk: each is saved when it is whole, and found again by a run that goes on."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.machine import stamp
from gearmbs.files import write_whole


class Store:
    """Saved parts under a folder.

    Parameters
    ----------
    folder : Path
    settings : str
        What the measurements depend on besides sources, versions and machine; parts made otherwise are measured anew.
    fresh : bool
        Measure everything anew.
    report : callable
        Called with a line of text for each part.
    """

    def __init__(self, folder: Path, settings: str, fresh: bool, report: Callable[[str], None]) -> None:
        self.folder = folder
        self.stamp = stamp(settings)
        self.fresh = fresh
        self.report = report

    def part(self, name: str, compute: Callable[[], Any]) -> Any:
        """Return a saved part, or compute and save it; ``name`` may hold any characters."""
        path = self.folder / (re.sub(r"[^\w.=+-]+", "_", name) + ".json")
        if not self.fresh:
            try:
                saved = json.loads(path.read_text(encoding="utf-8"))
                if saved["stamp"] == self.stamp:
                    self.report(f"{name}: saved earlier")
                    return saved["result"]
            except (OSError, ValueError, KeyError):
                pass
        self.report(name)
        result = compute()
        write_whole(path, json.dumps({"name": name, "stamp": self.stamp, "result": result}, indent=1))
        return result
