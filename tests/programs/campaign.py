"""A plan of cases, carried out and read."""

from pathlib import Path

from gearmbs.campaigns import Campaign, Factor, make_plan
from gearmbs.studies import Case


def main(folder: Path) -> int:
    """Return the number of cases that are done."""
    base = Case(operation={"duration": "0.06 s", "run_up": "0.02 s", "settling": "0.01 s"})
    factors = [Factor("operation.torque", "80 N m", "120 N m")]
    campaign = Campaign(folder / "torques.campaign", make_plan(base, factors, "sobol", n=2, seed=7, unit=1))
    campaign.run(workers=0, progress=False)
    campaign.export(folder / "torques", "csv")
    return len(campaign.table)
