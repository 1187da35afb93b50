"""Keeps numba's on-disk cache true to the sources.

Numba notices when the file of a cached function changes, but not when a function it calls changes in
another file. So the package notes the state of its sources beside the cache; when a file differs, the
cached code of every module that imports it, directly or not, is dropped.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from pathlib import Path

PACKAGE = Path(__file__).parent
NOTE = PACKAGE / "__pycache__" / "sources.json"
IMPORT = re.compile(r"^\s*(?:from\s+(gearmbs[\w.]*)\s+import\s+([^#\n]*(?:\([^)]*\))?)|import\s+(gearmbs[\w.]*))", re.M)


def drop_stale() -> None:
    """Remove cached code that depends on a source file changed since it was compiled."""
    state = {str(p.relative_to(PACKAGE)): _stamp(p) for p in PACKAGE.rglob("*.py")}
    try:
        known = json.loads(NOTE.read_text())
    except (OSError, ValueError):
        known = {}
    if known == state:
        return
    if known:
        changed = {name for name in {*state, *known} if state.get(name) != known.get(name)}
        for name in _dependents(changed, list(state)):
            source = PACKAGE / name
            for cached in (source.parent / "__pycache__").glob(f"{source.stem}.*.nb[ic]"):
                with contextlib.suppress(OSError):
                    cached.unlink()
    with contextlib.suppress(OSError):
        NOTE.parent.mkdir(exist_ok=True)
        part = NOTE.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps(state))
        part.replace(NOTE)


def _stamp(path: Path) -> list[int]:
    stat = path.stat()
    return [stat.st_mtime_ns, stat.st_size]


def _dependents(changed: set[str], names: list[str]) -> set[str]:
    """Return the changed files and all that import them, directly or through others."""
    by_module = {_module(name): name for name in names}
    importers: dict[str, set[str]] = {}
    for name in names:
        for match in IMPORT.finditer((PACKAGE / name).read_text()):
            base = match[1] or match[3]
            targets = [base]
            if match[2]:
                targets += [f"{base}.{word}" for word in re.findall(r"\w+", match[2])]
            for target in targets:
                if target in by_module:
                    importers.setdefault(by_module[target], set()).add(name)
    reached, front = set(changed), list(changed)
    while front:
        for name in importers.get(front.pop(), ()):
            if name not in reached:
                reached.add(name)
                front.append(name)
    return reached


def _module(name: str) -> str:
    parts = ["gearmbs", *Path(name).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
