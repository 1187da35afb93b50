"""Campaigns in which something goes wrong: ``python -m benchmarks.campaign_failures FOLDER [part ...]``.

Parts are ``planted`` (2000 cases, 42 of which go wrong in four ways), ``disk`` (a disk of 2 MB that is given more room
later; it is mounted, which takes root's rights) and ``worker`` (memory of a process over thousands of cases of the gear
pair). What happens at random is in `benchmarks.campaign_faults`.
"""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaigns import carry_out, cheap, resident, stored
from gearmbs.campaigns import Campaign, Factor, FunctionSubject, make_plan
from gearmbs.studies import Case

PLANTED = {"impossible": 20, "fails": 20, "hungry": 1, "deadly": 1}
HUNGER = 64e9
"""Bytes that the hungry case asks for."""


def moody(x: float, mood: str = "good") -> dict[str, float]:
    """Return a number, or go wrong as the mood says."""
    if mood == "impossible":
        raise ValueError("x: no such thing")
    if mood == "fails":
        raise RuntimeError("did not converge")
    if mood == "hungry":
        return {"y": float(np.ones(int(HUNGER / 8)).sum())}
    if mood == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    return {"y": x * x}


def planted(folder: Path, n: int = 2000) -> None:
    """Plant failures at random places; what is not planted must be done."""
    moods = np.array(["good"] * (n - sum(PLANTED.values())) + [m for m, count in PLANTED.items() for _ in range(count)])
    moods = np.random.default_rng(5).permutation(moods)
    rows = [{"x": float(k), "mood": str(mood)} for k, mood in enumerate(moods)]
    subject = FunctionSubject("benchmarks.campaign_failures:moody", {"x": 0.0, "mood": "good"})
    options = {"rows": rows, "corners": "ignore"}
    campaign = Campaign(
        folder / "planted.campaign", make_plan(subject, (), "list", options=options, unit=16, memory_limit="4 GB")
    )
    print(campaign.run(workers=2))
    table = campaign.table
    print(table.groupby(["mood", "status"]).size().to_string())
    good = table[table.mood == "good"]
    print(f"innocent: {(good.status == 'done').sum()} of {len(good)} done")


def disk(folder: Path) -> None:
    """Fill a disk of 2 MB, then give it room and go on."""
    small = folder / "small"
    small.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(small)], check=True)
    try:
        campaign = cheap(small / "disk.campaign", "plain", n=2048)
        try:
            campaign.run(workers=2)
        except OSError as error:
            print(f"{error.strerror}: {campaign.status()}")
        subprocess.run(["mount", "-o", "remount,size=64m", str(small)], check=True)
        print(f"with more room: {campaign.run(workers=2)}")
        alone = cheap(folder / "disk-alone.campaign", "plain", n=2048)
        alone.run(workers=2)
        print("the same bits" if stored(campaign) == stored(alone) else "OTHER BITS")
    finally:
        subprocess.run(["umount", str(small)], check=True)


def worker(folder: Path, n: int = 5056) -> None:
    """Work on cases of the gear pair in this process and look at its memory."""
    base = Case(operation={"duration": 0.06, "run_up": 0.02, "settling": 0.02})
    factors = [Factor("operation.torque", "60 N m", "200 N m"), Factor("contact.depth", "50 um", "500 um", scale="log")]
    campaign = Campaign(folder / "worker.campaign", make_plan(base, factors, "sobol", n=n, unit=32))
    memory: list[tuple[int, float]] = []

    def watch(status: Any) -> None:
        memory.append((status.done, resident()))

    print(campaign.run(workers=0, progress=watch))
    half = [size for done, size in memory if done > n // 2]
    print(f"{memory[-1][1]:.0f} MB at the end, {min(half):.1f} to {max(half):.1f} MB over the second half")


PARTS = {"planted": planted, "disk": disk, "worker": worker}

if __name__ == "__main__":
    carry_out(PARTS, "campaign_failures", __doc__)
