"""The comparison of checkouts: what its tables say."""

from pathlib import Path

from benchmarks import whole_case


def test_ratios_are_medians_of_pairs(monkeypatch):
    """The machine slows down threefold in the middle; both checkouts suffer, the ratio stays."""
    times = iter([2.0, 1.0, 0.5, 6.0, 3.0, 1.5, 2.0, 1.0, 0.5] * 2)

    def one(folder, state, lump, seconds):
        parts = dict.fromkeys(whole_case.PARTS, 1.0)
        return {"whole": next(times), "steps": 10, "unknowns": 61 if lump else 115, "gmf": [[1.0, 2.0]], "parts": parts}

    monkeypatch.setattr(whole_case, "measure", one)
    rows = whole_case.compare({"before": Path("a"), "after": Path("b")}, 3, 1.0)
    assert [(r["state"], r["checkout"], r["lump"]) for r in rows[:3]] == [
        ("healthy", "before", False),
        ("healthy", "after", False),
        ("healthy", "after", True),
    ]
    assert [r["times_faster"] for r in rows] == [1.0, 2.0, 4.0] * 2
    text = whole_case.comparison(rows)
    assert "| healthy | after, lumped | 61 | 10 | 0.5 | 4 | 0 |" in text
    assert "| healthy | before | 1 | 1 | 1 | 1 | 1 | 1 | 1 | 7 |" in text
