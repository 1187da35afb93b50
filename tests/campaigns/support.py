"""Campaigns for the tests, and what is compared of them."""

from __future__ import annotations

import hashlib
import json

from gearmbs.campaigns import Campaign, Factor, FunctionSubject, make_plan
from gearmbs.campaigns.plans import designs
from tests.campaigns.models import PI, PLACES


def function(name: str = "ishigami", **settings) -> FunctionSubject:
    """Return a cheap function as a subject."""
    return FunctionSubject(f"tests.campaigns.models:{name}", PLACES, signals={"wave": (50, 10.0)}, **settings)


def ranges() -> list[Factor]:
    """Return the factors of Ishigami's function."""
    return [Factor(name, -PI, PI) for name in PLACES]


def small(path, name: str = "ishigami", n: int = 40, **settings) -> Campaign:
    """Return a campaign over a cheap function with signals."""
    settings = {"keep": ["numbers", "signal:wave"], "unit": 8, "seed": 3, **settings}
    design = settings.pop("design", "sobol")
    counted = design in (*designs.SEQUENCES, *designs.ANALYSES, "latin hypercube")
    return Campaign(path, make_plan(function(name), ranges(), design, n=n if counted else 0, **settings))


def digest(campaign: Campaign) -> str:
    """Return one digest of all that is stored: the digests of tables and arrays, held against the files."""
    assert [line for line in campaign.check() if not line.startswith("litter")] == []
    entries = [json.loads(campaign.folder.ledger(u).read_text())["digests"] for u in campaign.folder.done()]
    return hashlib.sha256(json.dumps(entries, sort_keys=True).encode()).hexdigest()
