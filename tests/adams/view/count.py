"""Read and run all command files of a folder, and compare with the decks beside: ``python -m tests.adams.view.count``.

Each file that makes a rigid body ends as "unchanged" (read, built and run for a moment, with nothing left out but
interface, graphics and settings of results), "refused" with its first reason, or "wrong" (a traceback, too long). A
deck of the same name beside it was exported by ADAMS: same statements, and the largest difference of what they say.
"""

from __future__ import annotations

import argparse
import re
import traceback
from pathlib import Path

import numpy as np

from gearmbs.adams import Deck, DeckError, read_deck, read_view, run_deck
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import specs_of

from ..fuzz import Slow, limited

MAKES_A_BODY = re.compile(rb"^\s*par\w*\s+cr\w*\s+rigid", re.IGNORECASE | re.MULTILINE)
SECONDS = 120.0
"""Of processor time for one file."""


def outcome(path: Path) -> tuple[str, str]:
    """Return how a file ends, and why."""
    try:
        with limited(SECONDS):
            view = read_view(path)
            if view.deck.unsupported:
                return "refused", "; ".join(d.message for d in view.deck.unsupported[:2])
            result = run_deck(view.deck, end=0.001, steps=1, check=False)
            return ("unchanged", "") if result.success else ("stopped", "; ".join(map(str, result.messages))[:200])
    except DeckError as error:
        return "refused", "; ".join(d.message for d in error.diagnostics[:2])
    except Slow as error:
        return "wrong", str(error)
    except Exception:
        return "wrong", traceback.format_exc()[-300:]


def differences(ours: Deck, theirs: Deck) -> tuple[list[str], float, list[str]]:
    """Return what the tables do not share, the largest difference of places, and what else differs."""
    tables, others, worst = [], [], 0.0
    for kind in (st.Part, st.Marker, st.Joint, st.Jprim, st.Motion, st.Sforce, st.Vforce, st.Gforce, st.Bushing,
                 st.SpringDamper, st.Beam, st.Variable, st.Contact, st.Friction, st.Diff):  # fmt: skip
        a, b = ours.of(kind), theirs.of(kind)
        if a.keys() != b.keys():
            missing, more = sorted(b.keys() - a.keys()), sorted(a.keys() - b.keys())
            tables.append(f"{kind.keyword} without {missing[:3]}, with {more[:3]}")
        for key in a.keys() & b.keys():
            if kind is st.Marker:
                if not a[key].floating:
                    size = max(1.0, float(np.abs(b[key].qp).max()))
                    worst = max(worst, float(np.abs(np.subtract(a[key].qp, b[key].qp)).max()) / size)
                    worst = max(worst, float(np.abs(turned(a[key]) - turned(b[key])).max()))
                continue
            for name, spec in specs_of(kind).items():
                x, y = getattr(a[key], name), getattr(b[key], name)
                if spec.kind in (0, 1) and x is not None and y is not None:
                    if np.shape(x) != np.shape(y) or not np.allclose(x, y, rtol=1e-8, atol=1e-8):
                        others.append(f"{a[key].label()} {name}: {x} for {y}")
                elif spec.kind in (3, 4) and x != y:
                    others.append(f"{a[key].label()} {name}: {x} for {y}")
    mine, given = functions(ours), functions(theirs)
    others += [f"{key}: {mine[key]} for {given[key]}" for key in mine.keys() & given.keys() if mine[key] != given[key]]
    return tables, worst, others


def functions(deck: Deck) -> dict[str, str]:
    """Return the functions of named statements, without what their writing leaves open, variables by their names."""
    found = {}
    names = {v.id: (v.name or str(v.id)).rsplit(".", 1)[-1].lower() for v in deck.of(st.Variable).values()}
    for kind in (st.Variable, st.Sforce, st.Motion, st.Diff, st.Gcon):
        for one in deck.of(kind).values():
            text = re.sub(r"\s", "", str(one.function)).lower()
            text = re.sub(r"varval\((\d+)\)", lambda m: f"varval({names.get(int(m[1]))})", text)
            # frames that are the global one
            text = re.sub(r"(,0)+\)", ")", text)
            found[f"{one.keyword} {(one.name or str(one.id)).rsplit('.', 1)[-1]}"] = text
    return found


def turned(marker: st.Marker) -> np.ndarray:
    """Return a marker's rotation."""
    from gearmbs.adams.builders.builder import marker_orientation

    return marker_orientation(marker)


def main() -> None:
    """Print a line a file, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--compare", action="store_true", help="only compare with the decks beside")
    given = parser.parse_args()
    counts: dict[str, int] = {}
    for path in sorted(given.folder.rglob("*")):
        if path.suffix.lower() != ".cmd" or not MAKES_A_BODY.search(path.read_bytes()):
            continue
        deck = path.with_suffix(".adm")
        if deck.is_file():
            try:
                tables, worst, others = differences(read_view(path).deck, read_deck(deck))
                print(path, "beside its deck:", f"places {worst:.1e}", tables, len(others), others[:4], flush=True)
            except DeckError as error:
                print(path, "beside its deck: refused", str(error)[:150], flush=True)
        if given.compare:
            continue
        word, why = outcome(path)
        counts[word] = counts.get(word, 0) + 1
        print(path, word, why[:300], flush=True)
    print("end", counts)


if __name__ == "__main__":
    main()
