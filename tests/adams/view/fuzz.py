"""Carry mutated command files of View through: ``python -m tests.adams.view.fuzz``; see `tests.adams.fuzz`.

A file is read, its deck is built, and one in a few is run. It must end in a result or in an error with a line, within
its time, without opening a file that is not in its own folder, and without starting anything.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from gearmbs.adams import DeckError, build_mechanism, read_view, run_deck

from ..fuzz import Slow, limited
from ..mutations import characters
from . import test_machinery
from .files import CHAIN, LIVE, PENDULUM, RUNS, WHOLE
from .generator import made

SECONDS = 20.0
SPICE = (
    "(eval(", "))", "{0, 0, 0}", "LOC_RELATIVE_TO", ".swing.ROD.cm", "&", "!", '"', "1e308", "**", "[9]", "//", "0.5d",
    "for variable_name = k start_value = 1 end_value = 9\n", "end\n", "if condition = (1)\n", "else\n",
    "while condition = (1)\n",
    "file command read file_name = ../x.cmd\n", 'system command = "touch started"\n', "model create model_name = q\n",
    "macro create macro_name = .m.z user_entered_command = z commands = 'z'\nz\n",
    "\x00", "\\", "-", "RTOI(", "mm", ", ",
)  # fmt: skip
OPENED: list[str] = []
"""What was opened outside the folder, or started, while files were carried through."""
ALLOWED: list[str] = []


def watched(event: str, given: tuple[object, ...]) -> None:
    """Note what a file must not cause (an audit hook of Python)."""
    if not ALLOWED:
        return
    if event in (
        "subprocess.Popen",
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "os.fork",
        "socket.connect",
        "os.remove",
    ):
        OPENED.append(f"{event} {given!r}"[:200])
    elif event == "open" and isinstance(given[0], str) and not given[0].startswith(tuple(ALLOWED)):
        OPENED.append(f"open {given[0]}"[:200])


@cache
def corpus() -> list[str]:
    """Return files that run, of all kinds of commands."""
    return [PENDULUM, CHAIN, WHOLE, RUNS, LIVE, test_machinery.wheels(), *(made(seed)[0] for seed in range(5))]


def mutated(text: str, rng: random.Random) -> str:
    """Change lines, words and characters of a file."""
    for _ in range(rng.choice((1, 1, 1, 1, 2, 6))):
        lines = text.split("\n")
        k, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        # numbers half of the time, so that many files can still be built
        kind = rng.randrange(14)
        if kind == 0:
            del lines[k]
        elif kind == 1:
            lines[k], lines[j] = lines[j], lines[k]
        elif kind == 2:
            lines.insert(k, lines[j])
        elif kind == 3:
            words = lines[k].split(" ")
            words[rng.randrange(len(words))] = rng.choice(SPICE)
            lines[k] = " ".join(words)
        elif kind == 4:
            at = rng.randint(0, len(lines[k]))
            lines[k] = lines[k][:at] + rng.choice(SPICE) + lines[k][at:]
        elif kind == 5:
            words = [w for w in lines[j].split(" ") if w]
            lines[k] += " " + (rng.choice(words) if words else "")
        elif kind > 7:
            numbers = [n for n, word in enumerate(lines[k].split(" ")) if word[:1].isdigit()]
            words = lines[k].split(" ")
            if numbers:
                words[rng.choice(numbers)] = rng.choice(("0", "-1", "1e30", "1e-30", "7", "(1/3)", "90d"))
            lines[k] = " ".join(words)
        text = "\n".join(lines)
        if kind in (6, 7):
            text = characters(text, rng)
    return text


def outcome(seed: int, share: float, folder: Path) -> str:
    """Carry the file of a seed through; return what came of it, a traceback if it failed."""
    rng = random.Random(seed)
    path = folder / "model.cmd"
    path.write_text(mutated(rng.choice(corpus()), rng), encoding="utf-8", errors="replace")
    run = rng.random() < share
    OPENED.clear()
    package = str(Path(__file__).parents[3])
    kernels = str(Path.home() / ".cache")
    ALLOWED[:] = [str(folder), sys.prefix, sys.base_prefix, package, kernels, "/dev/", "/proc/", "/sys/"]
    try:
        with limited(SECONDS), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("error")
            word = _carried(path, run)
    except Slow as late:
        return f"slow\n{late}"
    except Exception:
        return "failed\n" + traceback.format_exc()
    finally:
        ALLOWED.clear()
    if OPENED:
        return f"opened\n{OPENED[:3]}"
    others = [one.name for one in folder.iterdir() if one != path]
    return f"opened\n{others}" if others else word


def _carried(path: Path, run: bool) -> str:
    read = False
    try:
        view = read_view(path)
        read = True
        if run:
            result = run_deck(view.deck, end=0.002, steps=2, check=False, allow_unsupported=True)
            assert result.success or result.messages
            return "ran" if result.success else "stopped"
        build_mechanism(view.deck)
        return "built"
    except DeckError as error:
        if not error.diagnostics or not all(d.message and d.line >= 0 for d in error.diagnostics):
            raise AssertionError(f"an error without a place: {error.diagnostics}") from error
        return "stopped" if read else "refused"


@contextlib.contextmanager
def folder_for_files() -> Iterator[Path]:
    """Give an empty folder, with what files cause watched."""
    sys.addaudithook(watched)
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def main() -> None:
    """Carry many files through; print what failed, and how many ended how."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--share", type=float, default=0.0, help="share of the files that are run")
    given = parser.parse_args()
    counts: dict[str, int] = {}
    began = time.process_time()
    with folder_for_files() as folder:
        for seed in range(given.first, given.first + given.count):
            found = outcome(seed, given.share, folder)
            word = found.split("\n", 1)[0]
            counts[word] = counts.get(word, 0) + 1
            if word in ("failed", "slow", "opened"):
                print(f"seed {seed}: {found.strip()[-900:]}\n", flush=True)
            if (seed + 1 - given.first) % 1000 == 0:
                print(seed + 1, counts, f"{time.process_time() - began:.0f} s", flush=True)
    print("end", counts, f"{time.process_time() - began:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
