"""What campaigns cost and what they survive: ``python -m benchmarks.campaigns FOLDER [part ...]``.

Parts are ``overhead`` (a Sobol' study of the gear pair: where processor time goes, memory, width of the intervals),
``million`` (results of a million cases read, ten millions planned), ``content`` (equal cases are found whatever they
are called), ``engines`` (the same bits from processes, parts and Dask, its scheduler killed), ``memory`` (of the
driver) and ``kills``.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns import Campaign, Factor, FunctionSubject, PairSubject, make_plan
from gearmbs.studies import Case

SHORT = {"duration": 0.1, "run_up": 0.03, "settling": 0.03}
BURNED = 0.02
"""Processor seconds of a cheap case."""


def busy(a: float, b: float, c: float) -> dict[str, Any]:
    """Return numbers and a signal of three parameters after `BURNED` seconds of processor time."""
    end = time.process_time() + BURNED
    while time.process_time() < end:
        pass
    return plain(a, b, c)


def plain(a: float, b: float, c: float) -> dict[str, Any]:
    """Return the same at once."""
    return {"y": np.sin(a) + b * c, "wave": np.sin(a * np.arange(200)) + b}


class Unsimulated(PairSubject):
    """Cases of the gear pair that are checked and known by their content, but not simulated."""

    kind: ClassVar[str] = "benchmarks.campaigns:Unsimulated"

    def run(self, thing: Case, progress: Callable[[float], None], keep: Any) -> Any:
        """Return the torque."""
        return thing.operation.torque

    def reduce(self, thing: Case, record: Any, keep: Any) -> Any:
        """Return the torque as a number."""
        from gearmbs.campaigns import Kept

        return Kept({"torque": float(record)})


def cheap(path: Path, function: str = "busy", n: int = 512, **settings: Any) -> Campaign:
    """Return a campaign over a cheap function."""
    subject = FunctionSubject(
        f"benchmarks.campaigns:{function}", dict.fromkeys("abc", 0.0), signals={"wave": (200, 1.0)}
    )
    factors = [Factor(name, -3.0, 3.0) for name in "abc"]
    settings = {"keep": ["numbers", "signal:wave"], "unit": 8, "seed": 3, **settings}
    return Campaign(path, make_plan(subject, factors, "sobol", n=n, **settings))


def stored(campaign: Campaign) -> str:
    """Return the digests of all that is stored, after they were held against the files."""
    wrong = [line for line in campaign.check() if not line.startswith("litter")]
    assert not wrong, wrong
    return json.dumps([json.loads(campaign.folder.ledger(u).read_text())["digests"] for u in campaign.folder.done()])


def resident(pid: int | str = "self") -> float:
    """Return the resident memory of a process, MB."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * resource.getpagesize() / 1e6
    except OSError:
        return float("nan")


def overhead(folder: Path, n: int = 400, workers: int = 2) -> None:
    """A Saltelli design over three settings of the gear pair, five cases of 0.1 s a base point.

    Processor time is that of whole processes, this one and its workers from their start to their end. What a worker
    imports during its first case is inside that case; it is counted as overhead here.
    """
    factors = [
        Factor("operation.torque", "60 N m", "200 N m"),
        Factor("contact.depth", "50 um", "500 um", scale="log"),
        Factor("friction.dynamic", 0.02, 0.1),
    ]
    base = Case(operation=SHORT)
    campaign = Campaign(folder / "overhead.campaign", make_plan(base, factors, "saltelli", n=n, unit=64))
    memory: list[tuple[int, float, float]] = []

    def watch(status: Any) -> None:
        pids = {json.loads(text)["pid"] for p in campaign.path.glob("units/*.claim") if (text := _text(p))}
        memory.append((status.done, resident(), max([resident(pid) for pid in pids], default=float("nan"))))

    status = campaign.run(workers, progress=watch)
    spent = _spent()
    seconds = [json.loads(campaign.folder.ledger(u).read_text())["seconds"] for u in campaign.folder.done()]
    usual = float(np.median(np.concatenate(seconds)))
    late = sum(sorted((unit[0] - usual for unit in seconds), reverse=True)[:workers])
    inside = status.simulation_seconds - late
    print(
        f"{status}; {spent:.1f} s of processor time in driver ({time.process_time():.1f} s) and workers, "
        f"{inside:.1f} s inside simulations and their evaluation, less {late:.1f} s of imports in first cases: "
        f"{inside / spent:.2%}; "
        f"{status.simulation_seconds / status.processor_seconds:.2%} of the units' own"
    )
    rows = [row for row in memory if row[0] >= 100]
    print(
        f"driver {min(r[1] for r in rows):.0f} to {max(r[1] for r in rows):.0f} MB from case 100 on, largest worker "
        f"{np.nanmax([r[2] for r in rows]):.0f} MB"
    )
    for result in ("orders.line_of_action.1", "orders.line_of_action.2", "orders.line_of_centres.1"):
        print(result)
        print(campaign.sensitivity(result).table().to_string(float_format="%.3f"))


def memory(folder: Path, n: int = 5120) -> None:
    """Memory of the driver over many cases that cost little, with their signals."""
    campaign = cheap(folder / "memory.campaign", "plain", n, unit=16)
    seen: list[tuple[int, float]] = []
    campaign.run(2, progress=lambda status: seen.append((status.done, resident())))
    rows = [row for row in seen if row[0] >= 100]
    print(f"driver over {len(rows)} looks from case {rows[0][0]} to {rows[-1][0]}: {min(r[1] for r in rows):.1f} to "
          f"{max(r[1] for r in rows):.1f} MB")  # fmt: skip


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""


def _spent() -> float:
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def million(folder: Path, n: int = 1_000_000) -> None:
    """A million cases with results that nobody simulated: how long three columns take; and ten millions planned.

    Each in a process of its own, whose memory is its peak.
    """
    filled = (f"from benchmarks.campaigns import peak, {stubs.__name__}\nimport sys\n"
              f"{stubs.__name__}(sys.argv[1], int(sys.argv[2]))\nprint(f'filled, {{peak():.0f}} MB')")  # fmt: skip
    read = ("from benchmarks.campaigns import peak\nfrom gearmbs.campaigns import Campaign\nimport sys, time\n"
            "start, cpu = time.perf_counter(), time.process_time()\n"
            "table = Campaign(sys.argv[1]).read(['a', 'y', 'z'])\n"
            "print(f'{len(table)} cases, three columns: {time.process_time() - cpu:.2f} s of processor time, '\n"
            "      f'{time.perf_counter() - start:.2f} s, {peak():.0f} MB')\n"
            "start = time.process_time(); print(Campaign(sys.argv[1]).status())\n"
            "failed = Campaign(sys.argv[1]).failed()\n"
            "print(f'{len(failed)} failures: {time.process_time() - start:.2f} s of processor time')")  # fmt: skip
    plan = ("from benchmarks.campaigns import cheap, peak\nimport sys, time\nfrom pathlib import Path\n"
            "start = time.process_time(); c = cheap(Path(sys.argv[1]), 'plain', int(sys.argv[2]), unit=None)\n"
            "print(f'{c.folder.case_count} cases planned in {c.folder.unit_count} units: '\n"
            "      f'{time.process_time() - start:.1f} s of processor time, {peak():.0f} MB')")  # fmt: skip
    for text, place, count in ((filled, "million", n), (read, "million", n), (plan, "planned", 10 * n)):
        subprocess.run([sys.executable, "-c", text, folder / f"{place}.campaign", str(count)], check=True,
                       env=_environment())  # fmt: skip


def stubs(path: str, n: int) -> None:
    """Make a campaign of n cases and store results that were not simulated."""
    from gearmbs.campaigns.codes import admit, folder_code
    from gearmbs.campaigns.subjects.base import FAILED, Kept, Outcome
    from gearmbs.campaigns.work import CaseResult, enter, store
    from gearmbs.studies.run.code import code_of

    folder = cheap(Path(path), "plain", n, unit=None, keep=["numbers"]).folder
    admit(folder, code := folder_code(folder, code_of))
    for unit in range(folder.unit_count):
        rows = folder.cases(unit)
        numbers = [{name: row["a"] + k for k, name in enumerate("yzuvw")} for row in rows]
        results = [CaseResult(Outcome(), Kept(kept), f"{row['index']:064x}") for row, kept in zip(rows, numbers)]
        if unit % 100 == 0:
            results[0] = CaseResult(Outcome(FAILED, "no such luck"))
        about = {"processor_seconds": 0.0, "wall_seconds": 0.1, "started": 0.0, "code": code.digest}
        enter(folder, unit, rows, results, store(folder, unit, rows, results), about)


def peak() -> float:
    """Return the largest resident memory that this process has had, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def content(folder: Path, n: int = 10_000) -> None:
    """Ten thousand cases again under other names and units and with explicit defaults; a sequence extended."""

    def made(name: str, base: Case, low: Any, high: Any, reuse: list[str]) -> Campaign:
        factors = [Factor("operation.torque", low, high)]
        plan = make_plan(Unsimulated(base), factors, "sobol", n=n, keep=["harmonics"], reuse=reuse, unit=250)
        return Campaign(folder / name, plan)

    first = made("content-1.campaign", Case(), 50.0, 200.0, [])
    first.run(workers=0)
    again = Case(name="other", operation={"speed": "1000 rpm"}, contact={"stiffness": "2.9852e5 N/mm^1.3"},
                 solver={"tolerance": Case().solver.used_tolerance})  # fmt: skip
    second = made("content-2.campaign", again, "50000 N mm", "200000 N mm", [str(first.path)])
    status = second.run(workers=0)
    print(f"{status.reused} of {status.done} renamed cases taken over")
    long = cheap(folder / "extended.campaign", "plain", 4096, unit=64)
    long.run(workers=0)
    kept = {u: long.folder.ledger(u).read_bytes() for u in long.folder.done()}
    before = long.status().done
    status = long.extend(8192).run(workers=0)
    same = all(long.folder.ledger(u).read_bytes() == text for u, text in kept.items())
    print(f"extended from {before} to {status.done}: {status.done - before} simulated, the others untouched: {same}")


def driver(path: Path, how: str) -> subprocess.Popen:
    """Start a driver in a session of its own; ``how`` are the arguments of `Campaign.run`."""
    text = (f"from gearmbs.campaigns import Campaign, dask_client\nif __name__ == '__main__':\n"
            f" Campaign({str(path)!r}).run({how})\n")  # fmt: skip
    script = path.with_suffix(".py")
    script.write_text(text)
    return subprocess.Popen([sys.executable, str(script)], env=_environment(), start_new_session=True)


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}


def engines(folder: Path) -> None:
    """The same bits from processes, parts, Dask; a scheduler killed."""
    from gearmbs.campaigns import dask_client

    alone = cheap(folder / "alone.campaign")
    alone.run(workers=0)
    bits = stored(alone)
    for count in (2, 8):
        campaign = cheap(folder / f"processes-{count}.campaign")
        campaign.run(count)
        print(f"{count} processes: {'the same bits' if stored(campaign) == bits else 'OTHER BITS'}")
    campaign = cheap(folder / "parts.campaign")
    for part in (5, 2, 4, 1, 3):
        campaign.work(part, 5)
    print(f"5 parts, shuffled: {'the same bits' if stored(campaign) == bits else 'OTHER BITS'}")
    campaign = cheap(folder / "dask.campaign")
    with dask_client("local", 2) as client:
        campaign.run(client=client)
    print(f"Dask cluster of 2: {'the same bits' if stored(campaign) == bits else 'OTHER BITS'}")
    campaign = cheap(folder / "drivers.campaign")
    both = [driver(campaign.path, "2") for _ in range(2)]
    print(
        f"two drivers ended with {[d.wait() for d in both]}: "
        f"{'the same bits' if stored(campaign) == bits else 'OTHER BITS'}"
    )
    _scheduler_killed(folder, bits)


def _scheduler_killed(folder: Path, bits: str) -> None:
    """Kill the scheduler of a cluster of two workers in the middle, start another, go on."""
    campaign = cheap(folder / "scheduler.campaign")
    for attempt in range(2):
        address = folder / f"scheduler-{attempt}.json"
        address.unlink(missing_ok=True)
        module = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard"]
        scheduler = subprocess.Popen([*module, "--scheduler-file", str(address)], stderr=subprocess.DEVNULL)
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-dashboard"]
        worker += ["--scheduler-file", str(address), "--death-timeout", "20"]
        workers = [subprocess.Popen(worker, stderr=subprocess.DEVNULL, env=_environment()) for _ in range(2)]
        while not address.exists():
            time.sleep(0.1)
        tcp = json.loads(address.read_text())["address"]
        text = f"client=__import__('distributed').Client({tcp!r}, timeout=30)"
        running = driver(campaign.path, text)
        try:
            if attempt == 0:
                while campaign.status().done < 100:
                    time.sleep(0.1)
                scheduler.kill()
                done = campaign.status().done
                code = _ended(running, 120.0)
                print(f"scheduler killed at {done} cases: driver ended with {code}, {campaign.status()}")
            else:
                print(f"with another scheduler: driver ended with {_ended(running, 300.0)}, {campaign.status()}")
        finally:
            for process in (running, *workers, scheduler):
                process.kill()
                process.wait()
    print(f"after the scheduler's death: {'the same bits' if stored(campaign) == bits else 'OTHER BITS'}")


def _ended(process: subprocess.Popen, seconds: float) -> int | str:
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return f"nothing in {seconds:g} s"


def kills(folder: Path, count: int = 20) -> None:
    """Kill the driver with its workers, or one worker, at random moments."""
    alone = cheap(folder / "kills-alone.campaign", n=1024)
    alone.run(workers=0)
    campaign = cheap(folder / "kills.campaign", n=1024)
    generator, killed, tries = random.Random(7), {"driver": 0, "worker": 0}, 0
    while sum(killed.values()) < count and not campaign.status().complete:
        running = driver(campaign.path, "2")
        tries += 1
        while running.poll() is None and sum(killed.values()) < count:
            pids = [json.loads(t)["pid"] for p in campaign.path.glob("units/*.claim") if (t := _text(p))]
            mine = [pid for pid in pids if Path(f"/proc/{pid}").exists()]
            if not mine:
                time.sleep(0.02)
                continue
            time.sleep(generator.uniform(0.0, 0.2))
            if generator.random() < 0.5:
                os.killpg(running.pid, signal.SIGKILL)
                running.wait()
                killed["driver"] += 1
            else:
                try:
                    os.kill(generator.choice(mine), signal.SIGKILL)
                except ProcessLookupError:
                    continue
                killed["worker"] += 1
                time.sleep(0.3)
        if running.poll() is None:
            running.wait()
    status = campaign.run(workers=0)
    entries = [json.loads(campaign.folder.ledger(u).read_text()) for u in campaign.folder.done()]
    again = sum(e["attempts"] for e in entries)
    print(
        f"killed {killed} in {tries} runs: {status}; {again} of {len(entries)} units begun anew; "
        f"{'the same bits' if stored(campaign) == stored(alone) else 'OTHER BITS'}; "
        f"{len(campaign.check())} files of litter"
    )


PARTS = {
    "overhead": overhead,
    "memory": memory,
    "million": million,
    "content": content,
    "engines": engines,
    "kills": kills,
}


def carry_out(parts: dict[str, Callable[[Path], None]], module: str, about: str | None) -> None:
    """Carry out the parts that the command line asks for, all by default."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks.{module}", description=(about or "").partition(":")[0])
    parser.add_argument("folder", type=Path, help="where the campaigns are made")
    parser.add_argument("parts", nargs="*", metavar="part", help=f"of {', '.join(parts)}; default all")
    asked = parser.parse_args()
    if unknown := [name for name in asked.parts if name not in parts]:
        parser.error(f"part {unknown[0]!r} is unknown; choose of {', '.join(parts)}")
    asked.folder.mkdir(parents=True, exist_ok=True)
    for name in asked.parts or parts:
        parts[name](asked.folder)


if __name__ == "__main__":
    carry_out(PARTS, "campaigns", __doc__)
