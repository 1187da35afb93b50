"""Campaigns for the tests, and what is compared of them."""

from __future__ import annotations

import hashlib
import json

from gearmbs.campaigns import Campaign, Choice, Factor, FunctionSubject, Specimens, make_plan
from gearmbs.campaigns.plans import designs
from tests.campaigns.models import PI, PLACES, Ringing


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


def ringing(path, torque: float = 20.0, *, varied: bool = True, crossed: bool = True) -> Campaign:
    """Return a campaign of six specimens in two states that is done at once."""
    factors = [
        *([Factor("operation.speed", 90.0, 110.0)] if varied else []),
        Factor("operation.torque", 5.0, torque),
        Choice("fault.teeth", {"healthy": [], "faulty": {"size": [0.1, 1.0]}}, crossed=crossed, name="state"),
        Specimens(6),
    ]
    plan = make_plan(Ringing(), factors, n=6, keep=["numbers", "signal:housing"], unit=12)
    campaign = Campaign(path, plan)
    campaign.run(workers=0)
    return campaign
