"""Random faults of campaigns, and what came of them: ``python -m benchmarks.campaign_faults FOLDER [count [seed]]``.

After them ten times as many single bits are flipped in all kinds of files, and all that can be read is read.

A campaign over a cheap function is carried out by processes to which something happens, or whose files something
happens to, and then once more by a sound one. What may come of it:

``complete``
    All is done, and equal to the last bit to what came of it undisturbed.
``stopped``
    The run ended with an error that names the cause.
``silent``
    Anything else: other numbers without a word, an error that names nothing, or no end.

The seed is also that of ``GEARMBS_SEED``, the count that of ``GEARMBS_CASES``.
"""

from __future__ import annotations

import argparse
import errno
import functools
import importlib
import json
import multiprocessing
import os
import random
import shutil
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.campaigns import Campaign, CampaignError, Factor, FunctionSubject, make_plan
from gearmbs.studies.run import engine

try:
    from gearmbs.studies.run import claims
except ImportError:
    # so that what came before can be compared
    claims = engine

PATIENCE = 120.0
"""Seconds after which a run that should have ended has none."""

MODEL = '''"""A model of a user."""

import os
import time

GAIN = 2.0


def model(a, b):
    """Return numbers and a signal."""
    import numpy as np
    from helper_of_model import offset

    time.sleep(float(os.environ.get("MODEL_PAUSE", "0")))
    mark = os.environ.get("MODEL_MARK")
    if mark and not os.path.exists(mark):
        open(mark, "w").close()
        if os.environ["MODEL_MOOD"] == "sleeps":
            time.sleep(1e6)
        raise OSError(116, "Stale file handle")
    return {"y": GAIN * np.sin(a) + b + offset(), "wave": np.sin(a * np.arange(40)) + b}
'''
HELPER = "def offset():\n    return 0.25\n"


def campaign(place: Path, **settings: Any) -> Campaign:
    """Return the campaign, as it is or new."""
    subject = FunctionSubject("user_model:model", {"a": 0.0, "b": 0.0}, signals={"wave": (40, 1.0)})
    factors = [Factor("a", -3.0, 3.0), Factor("b", -3.0, 3.0)]
    settings = {"keep": ["numbers", "signal:wave"], "unit": 4, "seed": 5, **settings}
    return Campaign(place / "c", make_plan(subject, factors, "sobol", n=24, **settings))


def content(one: Campaign) -> tuple[bytes, bytes]:
    """Return what is read of a campaign: its numbers and its signals."""
    table = one.table.sort_values("index")
    assert len(table) == one.folder.case_count, "not all cases are in the table"
    wave = np.ascontiguousarray(one.open().sortby("case").wave.values)
    return table[["index", "a", "b", "y"]].to_numpy(dtype=float).tobytes(), wave.tobytes()


class Child:
    """A driver in a process of its own, with what is done to it."""

    def __init__(self, place: Path, *patches: Callable[[], None], **settings: Any) -> None:
        self.note = place / f"note-{time.monotonic_ns()}"
        self.process = multiprocessing.get_context("fork").Process(target=self._run, args=(place, patches, settings))
        self.process.start()
        self.pid = self.process.pid or 0

    def _run(self, place: Path, patches: tuple[Callable[[], None], ...], settings: dict[str, Any]) -> None:
        sys.stderr = open(os.devnull, "w")
        sys.path.insert(0, str(place / "code"))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            try:
                run = settings.pop("run", {})
                for patch in (quick, *patches):
                    patch()
                status = campaign(place, **settings).run(workers=0, **run)
                found = {"end": "complete" if status.complete else "incomplete", "failed": status.failed}
            except BaseException as error:
                found = {"end": "error", "kind": type(error).__name__, "text": str(error),
                         "where": traceback.format_exc()[-2000:]}  # fmt: skip
        self.note.write_text(json.dumps({**found, "warnings": [str(w.message) for w in told]}))

    def ended(self, seconds: float = PATIENCE) -> dict[str, Any]:
        """Return what came of it."""
        self.process.join(seconds)
        if self.process.is_alive():
            os.kill(self.pid, signal.SIGCONT)
            self.process.kill()
            self.process.join()
            return {"end": "none", "warnings": []}
        return json.loads(self.note.read_text()) if self.note.exists() else {"end": "killed", "warnings": []}


def quick() -> None:
    """Shorten what is waited for: leases, looks at others."""
    for home, name, value in ((claims, "LEASE", 3.0), (claims, "BEAT", 0.3), (claims, "STOPPED", 1.0),
                              (claims, "WRITING", 0.5), (engine, "POLL", 0.05), (engine, "NOTICE", 0.3)):  # fmt: skip
        setattr(home, name, value)


def slow(seconds: float) -> Callable[[], None]:
    """Return what makes each case take so long."""
    return functools.partial(os.environ.__setitem__, "MODEL_PAUSE", str(seconds))


def until_under_way(place: Path, child: Child, chance: random.Random) -> None:
    """Wait until some units are done, and a moment more."""
    wanted, end = chance.randrange(5), time.monotonic() + PATIENCE
    while child.process.is_alive() and time.monotonic() < end:
        if len(list((place / "c" / "units").glob("*.json"))) >= wanted:
            break
        time.sleep(0.01)
    time.sleep(chance.uniform(0.0, 0.05))


def half_done(place: Path, chance: random.Random) -> None:
    """Carry out a part of the campaign, and end it."""
    while True:
        child = Child(place, slow(0.01))
        until_under_way(place, child, chance)
        child.process.kill()
        child.process.join()
        if (place / "c" / "plan.json").exists():
            return


# What happens. Each returns what the sound run after it is given, and words of which an error must name one.

Fault = Callable[[Path, random.Random], "tuple[dict[str, Any], tuple[str, ...]]"]


def kill(place: Path, chance: random.Random) -> Any:
    """The driver is killed, several times."""
    for _ in range(chance.randint(1, 3)):
        half_done(place, chance)
    return {}, ()


def stop(place: Path, chance: random.Random) -> Any:
    """A driver is stopped while another one works: its claims must not hold the other."""
    child = Child(place, slow(0.02))
    until_under_way(place, child, chance)
    os.kill(child.pid, signal.SIGSTOP)
    other = Child(place).ended()
    os.kill(child.pid, signal.SIGCONT)
    child.process.kill()
    child.process.join()
    return {"before": other}, ()


def freeze(place: Path, chance: random.Random) -> Any:
    """A case sleeps for ever when it is first worked on; it is bounded by the clock, and tried again."""
    mark = functools.partial(os.environ.update, MODEL_MARK=str(place / "mark"), MODEL_MOOD="sleeps")
    first = Child(place, mark, wall_limit=1.0).ended()
    if first["end"] == "complete" and first["failed"]:
        one = campaign(place, wall_limit=1.0)
        assert "clock" in one.failed().message[0]
        one.retry()
    return {"before": first, "settings": {"wall_limit": 1.0}}, ()


def dead_node(place: Path, chance: random.Random) -> Any:
    """Claims of another machine stay behind, whose clock goes wrong by up to a day."""
    half_done(place, chance)
    units = place / "c" / "units"
    for unit in chance.sample(range(6), 3):
        claim = units / f"{unit:05d}.claim"
        claim.write_text(json.dumps({"host": "gone", "space": "", "pid": 7, "started": "1", "attempts": 0}))
        when = time.time() + chance.uniform(-86400.0, 86400.0)
        os.utime(claim, (when, when))
    return {}, ()


def skewed_clock(place: Path, chance: random.Random) -> Any:
    """The clock of the one that goes on is wrong by up to a day, and claims of others are there."""
    dead_node(place, chance)
    skew, now = chance.uniform(-86400.0, 86400.0), time.time
    return {"patches": [functools.partial(setattr, time, "time", lambda: now() + skew)]}, ()


def files(place: Path) -> list[Path]:
    """Return the files of the campaign."""
    return sorted(p for p in (place / "c").rglob("*") if p.is_file() and p.stat().st_size)


def flipped(path: Path, chance: random.Random) -> None:
    """Change one bit of a file."""
    data = bytearray(path.read_bytes())
    data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    path.write_bytes(bytes(data))


def bit_flip(place: Path, chance: random.Random) -> Any:
    """One bit of a file is another one."""
    chance.choice([half_done, whole])(place, chance)
    flipped(chance.choice(files(place)), chance)
    return {"read": True}, ("plan.json",)


def truncation(place: Path, chance: random.Random) -> Any:
    """A file ends too early."""
    chance.choice([half_done, whole])(place, chance)
    path = chance.choice(files(place))
    os.truncate(path, chance.randrange(path.stat().st_size))
    return {"read": True}, ()


def deletion(place: Path, chance: random.Random) -> Any:
    """A file or a folder is gone."""
    chance.choice([half_done, whole])(place, chance)
    path = chance.choice(files(place))
    if chance.random() < 0.3 and path.parent.name not in ("c", "cases"):
        shutil.rmtree(path.parent)
    else:
        path.unlink()
    return {"read": True}, ()


def whole(place: Path, chance: random.Random) -> None:
    """Carry out all of the campaign."""
    Child(place).ended()


def failing(number: int, code: int) -> None:
    """Let the so-manieth renaming fail."""
    replace, count = os.replace, iter(range(10**9))

    def instead(*args: Any, **kwargs: Any) -> None:
        if next(count) == number:
            raise OSError(code, os.strerror(code))
        replace(*args, **kwargs)

    os.replace = instead


def full_disk(place: Path, chance: random.Random) -> Any:
    """The disk is full for a moment, which ends the run; it has room again when the next one begins."""
    campaign(place)
    first = Child(place, functools.partial(failing, chance.randrange(20), errno.ENOSPC)).ended()
    return {"before": first, "told": "No space left"}, ()


def stale_handle(place: Path, chance: random.Random) -> Any:
    """A file server has lost a file, in a case or where results are written."""
    campaign(place)
    if chance.random() < 0.5:
        mark = functools.partial(os.environ.update, MODEL_MARK=str(place / "mark"), MODEL_MOOD="stale")
        return {"before": Child(place, mark).ended()}, ()
    return {"before": Child(place, functools.partial(failing, chance.randrange(20), errno.ESTALE)).ended()}, ()


def other_code(place: Path, chance: random.Random) -> Any:
    """The model is edited in the middle: a constant, or a text that cannot change a number."""
    half_done(place, chance)
    model = place / "code" / "user_model.py"
    edit = chance.choice(["GAIN = 2.5", '"""Another text."""\n\nGAIN = 2.0'])
    model.write_text(MODEL.replace("GAIN = 2.0", edit))
    if not list((place / "c" / "units").glob("*.json")):
        # nothing is done that the edit could be mixed with
        model.write_text(MODEL)
    return {}, ("user_model",) if "2.5" in edit else ()


def missing_module(place: Path, chance: random.Random) -> Any:
    """One that takes part lacks a module."""
    if chance.random() < 0.5:
        half_done(place, chance)
    lacking = functools.partial(sys.modules.__setitem__, "helper_of_model", None)
    return {"before": Child(place, lacking).ended(), "told": "helper_of_model"}, ()


def edited_plan(place: Path, chance: random.Random) -> Any:
    """An entry of plan.json is edited."""
    path = place / "c" / "plan.json"
    half_done(place, chance)
    tree = json.loads(path.read_text())
    entry, value = chance.choice([("seed", 77), ("constraints", ["a < 0"]), ("unit", 3), ("keep", ["numbers"])])
    tree["plan"][entry] = value
    if chance.random() < 0.3:
        entry, tree["extents"][-1]["last"] = "extents", 16
    path.write_text(json.dumps(tree, indent=1))
    return {}, (entry,)


def lost_writes(place: Path, chance: random.Random) -> Any:
    """The power is cut: what was not brought to the disk is there or not."""
    from benchmarks.lost_writes import Recorder

    recorder = Recorder(place / "c")
    campaign(place)
    recorder.begin()
    Child(place, recorder.trace).ended()
    recorder.cut(chance)
    return {"read": True}, ()


KINDS: dict[str, Fault] = {
    f.__name__: f
    for f in (
        kill, stop, freeze, dead_node, skewed_clock, bit_flip, truncation, deletion, full_disk, stale_handle,
        other_code, missing_module, edited_plan, lost_writes,
    )
}  # fmt: skip


def one_fault(place: Path, kind: str, seed: int, truth: tuple[bytes, bytes]) -> str:
    """Let something happen to a campaign and return what came of it."""
    shutil.rmtree(place, ignore_errors=True)
    prepare(place)
    chance = random.Random(f"{seed} {kind}")
    after, words = KINDS[kind](place, chance)
    before = after.get("before", {"end": "killed", "warnings": []})
    if before["end"] == "none":
        return "silent: no end"
    if before["end"] == "error" and "told" in after and after["told"] not in before["text"]:
        return f"silent: the cause is not named: {before['text']}"
    if "told" in after and before["end"] == "complete" and before["failed"]:
        return "silent: cases are blamed"
    if after.get("read"):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = content(campaign(place))
        except AssertionError:
            pass
        except (CampaignError, OSError):
            pass
        else:
            if found != truth:
                return "silent: other numbers are read"
    last = Child(place, *after.get("patches", ()), **after.get("settings", {})).ended()
    if last["end"] == "error":
        named = any(word in last["text"] for word in words)
        return f"stopped: {last['text']}" if named else f"silent: {last['kind']}: {last['text']} {last['where']}"
    if last["end"] != "complete":
        return f"silent: {last['end']}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            same = content(campaign(place, **after.get("settings", {}))) == truth
        except (CampaignError, OSError, KeyError) as error:
            return f"silent: said to be complete, and cannot be read: {error}"
    return "complete" if same else "silent: other numbers"


def prepare(place: Path) -> None:
    """Write the user's modules, and find them."""
    (place / "code").mkdir(parents=True, exist_ok=True)
    (place / "code" / "user_model.py").write_text(MODEL)
    (place / "code" / "helper_of_model.py").write_text(HELPER)
    sys.path[:] = [str(place / "code"), *(p for p in sys.path if not p.endswith("/code"))]
    for name in ("user_model", "helper_of_model"):
        sys.modules.pop(name, None)
    importlib.invalidate_caches()


def faults(folder: Path, count: int, seed: int) -> dict[str, list[str]]:
    """Return what came of so many faults, by kind; kinds come in turn."""
    prepare(folder / "truth")
    whole(folder / "truth", random.Random(0))
    truth = content(campaign(folder / "truth"))
    found: dict[str, list[str]] = {}
    for k in range(count):
        kind = list(KINDS)[k % len(KINDS)]
        ended = one_fault(folder / "fault", kind, seed + k, truth)
        found.setdefault(kind, []).append(ended)
        print(f"{k} {kind}: {ended}", flush=True)
    return found


# Single bits.


def recorded(x1: float, x2: float, x3: float) -> xr.Dataset:
    """Return a record; at some places there is none."""
    if x1 > 3.0:
        raise ValueError("x1: beyond")
    wave = np.sin(x1 * np.arange(1500.0))
    return xr.Dataset({"y": x1 + x2 * x3, "wave": ("t", wave[:50]), "long": ("s", wave)})


WAYS: list[Callable[[Campaign], Any]] = [
    lambda c: c.table.to_json(double_precision=15),
    lambda c: c.read(["y", "x1"], "status == 'done'").to_json(double_precision=15),
    lambda c: c.open().wave.values.tobytes(),
    lambda c: str(c.open().wave.attrs) + str(c.open().wave_time.values),
    lambda c: f"{c.status()} {c.status().processor_seconds}",
    lambda c: c.failed().to_json(),
    lambda c: str([c.record(k).to_dict(data="array") for k in range(c.folder.case_count)]),
    lambda c: str([c.case(k) for k in range(0, c.folder.case_count, 3)]),
    lambda c: str(c.plan),
]
"""Ways in which something is read of a campaign."""


def read(path: Path) -> list[Any]:
    """Return all that is read of a campaign; None where that is refused."""
    found = []
    for way in WAYS:
        try:
            found.append(way(Campaign(path)))
        except (ValueError, OSError, AttributeError, KeyError, TypeError, RuntimeError):
            found.append(None)
    return found


def flips(folder: Path, count: int, seed: int) -> tuple[dict[str, int], list[str]]:
    """Flip single bits of all kinds of files, one at a time; return how often by kind, and what was read wrongly."""
    names = ("x1", "x2", "x3")
    subject = FunctionSubject(
        "benchmarks.campaign_faults:recorded", dict.fromkeys(names, 0.0), signals={"wave": (50, 10.0)}
    )
    factors = [Factor(name, -np.pi, np.pi) for name in names]
    plan = make_plan(subject, factors, "sobol", n=12, seed=1, keep=["numbers", "record", "signal:wave"], unit=4)
    one = Campaign(folder / "flips", plan)
    one.run(workers=0)
    truth, chance = read(one.path), random.Random(seed)
    kinds: dict[str, list[Path]] = {}
    for path in sorted(p for p in one.path.rglob("*") if p.is_file()):
        kinds.setdefault(path.relative_to(one.path).parts[0], []).append(path)
    hit, wrong = Counter[str](), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(count):
            kind = list(kinds)[k % len(kinds)]
            path = chance.choice(kinds[kind])
            whole = path.read_bytes()
            flipped(path, chance)
            answers = read(one.path)
            hit[kind] += 1
            wrong += [f"{path.relative_to(one.path)}: {way}" for way, (a, b) in enumerate(zip(truth, answers))
                      if a is not None and b is not None and a != b]  # fmt: skip
            path.write_bytes(whole)
    return dict(hit), wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.campaign_faults", description=(__doc__ or "").partition(":")[0]
    )
    parser.add_argument("folder", type=Path, help="where the campaigns are made")
    parser.add_argument(
        "count", type=int, nargs="?", default=100, help="faults; bits are ten times as many (%(default)s)"
    )
    parser.add_argument("seed", type=int, nargs="?", default=20, help="of what happens when (%(default)s)")
    asked = parser.parse_args()
    found = faults(asked.folder, asked.count, asked.seed)
    print(dict(Counter(end.partition(":")[0] for list_ in found.values() for end in list_)))
    hit, wrong = flips(asked.folder, 10 * asked.count, asked.seed)
    kinds = Counter(answer.partition("/")[0] for answer in wrong)
    print(f"single bits flipped: {hit}; answers that were wrong: {len(wrong)} {dict(kinds)}")
