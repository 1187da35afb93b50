"""Compile the numerical kernels ahead of use: ``python -m gearmbs.kernels.ahead``.

Kernels are compiled when they are first called and kept on disk. This does it at once and on all cores: kernels whose
callees are ready are handed to helper processes, longest chain first, so that each is compiled once. A program that
meets missing kernels does the same for those that it has imported.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from threading import Condition, Thread
from typing import TYPE_CHECKING, Any

from gearmbs.kernels import COMPILER, PLAIN
from gearmbs.logs import logger, tell
from gearmbs.system import cores

if TYPE_CHECKING:
    from gearmbs.kernels.jit import Kernel

HELPER = "GEARMBS_COMPILING"
"""Set in the environment of helper processes, which start none themselves."""

INTRODUCE = "introduce"
"""What a helper process is asked first; see `_introduction`."""

KEPT_FILES = {".entry", ".part", ".object", ".lock", ".tmp"}
"""What is in a folder of kernels: machine code of this machine and of others, LLVM code, what killed processes left."""

PRUNED_AFTER = 30.0
"""Days without use after which `--prune` deletes a kernel: a month, so that work on a branch survives a holiday."""

TASKS_OF_A_PROCESS = 8
"""Entries that a process compiles in the plain mode: numba keeps in memory what it has compiled, up to 0.1 GB each."""

SILENT = 5.0
"""Seconds of compiling in a program before it tells how far it is, and between two such lines."""

Report = Callable[[str], None]


def compile_all(
    report: Report | None = None, modules: Iterable[str] | None = None, workers: int | None = None
) -> float:
    """Compile and cache every kernel that is not yet on disk; return the seconds it took.

    Parameters
    ----------
    report : callable, optional
        Called with a line of text for each kernel that is ready.
    modules : iterable of str, optional
        Compile what these modules need; by default, all of the package.
    workers : int, optional
        Processes at a time; by default, as many as there are cores for this process. In the plain mode there is one.

    Raises
    ------
    RuntimeError
        If a kernel cannot be compiled, with its traceback; if helper processes do not start, or import another
        checkout; or if kernels are missing and none of their folders can be written.
    """
    from gearmbs.kernels.calls import entries, import_all, kernel_modules, kernels

    start = time.perf_counter()
    if modules is None:
        # who calls a kernel may stand anywhere
        import_all()
    wanted = entries(kernels(kernel_modules() if modules is None else modules))
    if PLAIN:
        _compile_in_turn(wanted, report or (lambda line: None))
    else:
        compile_entries(wanted, report, workers)
        if modules is None:
            _compile_asked(report or (lambda line: None))
    return time.perf_counter() - start


def _compile_asked(report: Report) -> None:
    """Compile what is called, or linked, as only a list tells: it is little."""
    from gearmbs.kernels import cache
    from gearmbs.kernels.calls import asked, linked

    for kernel, args in asked():
        if not cache.stored(kernel, "entry", args):
            kernel.compile(args)
            report(f"{kernel.__module__}:{kernel.__name__} as it is called")
    for kernel in linked():
        kernel.part(kernel.declared_types()[0])


def _compile_in_turn(wanted: list[Any], report: Report) -> None:
    """Compile entries one after the other, for numba's cache, in processes that end before they grow large."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    from gearmbs.kernels.calls import address

    start = time.perf_counter()
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=TASKS_OF_A_PROCESS) as pool:
        done = pool.map(_keep, map(address, wanted), [kernel.is_c_function for kernel in wanted])
        for number, name in enumerate(done, 1):
            now = time.perf_counter()
            report(f"{number}/{len(wanted)} {name} {now - start:.1f} s")
            start = now


def _keep(name: str, is_c_function: bool) -> str:
    """Compile a kernel, or load it, as it will be asked for; return its name."""
    from gearmbs.kernels.calls import find

    kernel: Any = find(*name.split(":"))
    if is_c_function:
        kernel.as_c_function()
    else:
        kernel.ready()
    return name


_said: set[str] = set()
_failures: list[str] = []


def _say_once(line: str) -> None:
    if line not in _said:
        _said.add(line)
        tell("kernels", line)


def compile_missing(kernel: Kernel) -> bool:
    """Compile what a program lacks that has imported a kernel and found it missing, and say so (`gearmbs.logs.tell`).

    The announcement is made once per process, and how far it is when it takes longer. Where helper processes fail, this
    is told once, and they are not started again.

    Returns
    -------
    bool
        False if nothing was done: in a helper process, where nothing can be kept, or if the helpers failed.
    """
    from gearmbs.kernels import cache
    from gearmbs.kernels.calls import entries, kernels

    package = kernel.__module__.partition(".")[0]
    if _failures or HELPER in os.environ or package != __package__.partition(".")[0] or not cache.writable(package):
        return False
    loaded = [name for name in list(sys.modules) if name.partition(".")[0] == package]
    # who needs one late kernel needs others
    wanted = [k for k in entries(kernels(loaded), loaded) if k.late == kernel.late]
    start = time.perf_counter()
    told = 0.0

    def report(line: str) -> None:
        nonlocal told
        logger("kernels").debug(line)
        now = time.perf_counter() - start
        if now - told > SILENT:
            told = now
            tell("kernels", f"{line.partition(' ')[0]} kernels after {now:.0f} s")

    if lacking := cache.lacking():
        _say_once(
            f"the kernels that came with this installation are for processors of level {cache.COMMON[0]}, and this one "
            f"has no {', '.join(lacking)}"
        )
    _say_once("compiling numerical kernels that are not on disk yet; they are kept there")
    try:
        compile_entries([*{kernel, *wanted}], report)
    except (RuntimeError, OSError) as error:
        _failures.append(str(error))
        reason = str(error).strip().rpartition("\n")[2]
        _say_once(f"helper processes failed ({reason}); kernels are compiled one by one, when they are called")
        return False
    if told:
        tell("kernels", f"compiled in {time.perf_counter() - start:.0f} s")
    return True


def compile_entries(wanted: list[Kernel], report: Report | None = None, workers: int | None = None) -> None:
    """Compile entries, and all parts below them, that are not on disk; see `compile_all`."""
    tasks = _Tasks(wanted, report)
    if not tasks.waiting:
        return
    _check_folders({kernel.__module__.partition(".")[0] for kernel in wanted})
    count = min(workers or _cores(), len(tasks.waiting))
    threads = [Thread(target=tasks.work, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if tasks.errors:
        raise RuntimeError(tasks.errors[0])
    if tasks.waiting:
        raise RuntimeError(f"kernels wait for each other: {', '.join(sorted(tasks.waiting))}")


def prune(days: float, package: str = "gearmbs") -> tuple[int, int]:
    """Delete kernels on disk that no process has loaded for some time; whoever needs one compiles it again.

    Every edit of a kernel leaves the former one behind, for other checkouts may share the folder.

    Parameters
    ----------
    days : float
        How long a kernel must not have been read. Many systems note that once a day only: one day at least.
    package : str
        Whose kernels.

    Returns
    -------
    files : int
        Number of files deleted.
    size : int
        Their bytes.

    Raises
    ------
    ValueError
        If less than a day is asked for.
    """
    from gearmbs.kernels import cache

    if not days >= 1.0:
        raise ValueError(f"days = {days:g}: when a file was read is known to the day; give 1 or more")
    oldest = time.time() - 86400.0 * days
    files = size = 0
    for folder in cache.folders(package):
        if folder == cache.SHIPPED:
            continue
        for path in sorted(folder.glob("*")) if folder.is_dir() else ():
            # another process may delete it first
            with contextlib.suppress(OSError):
                told = path.stat()
                if path.suffix.partition("_")[0] in KEPT_FILES and max(told.st_atime, told.st_mtime) < oldest:
                    path.unlink()
                    files, size = files + 1, size + told.st_size
    return files, size


def _check_folders(packages: set[str]) -> None:
    from gearmbs.kernels import cache

    for package in sorted(packages):
        if not cache.writable(package):
            places = ", ".join(str(folder) for folder in cache.own_folders(package))
            raise RuntimeError(
                f"kernels cannot be kept, for none of their folders can be written: {places}; "
                "set NUMBA_CACHE_DIR to one that can"
            )


def _cores() -> int:
    return min(cores(), 8)


class _Tasks:
    """What is to be compiled, and what has to be ready before."""

    def __init__(self, wanted: list[Kernel], report: Report | None) -> None:
        from gearmbs.kernels import cache
        from gearmbs.kernels.calls import address, below, size

        self.report = report or (lambda line: None)
        self.errors: list[str] = []
        self.lock = Condition()
        self.running = 0
        self.waiting: dict[str, set[str]] = {}
        self.order: dict[str, int] = {}
        wanted = [k for k in wanted if not cache.stored(k, "entry", k.declared_types()[0])]
        parts = {
            k
            for entry in wanted
            for k in below(entry)
            if k.declared is not None and not cache.stored(k, "part", k.declared_types()[0])
        }
        for kind, kernels in (("part", parts), ("entry", wanted)):
            for kernel in kernels:
                task = f"{kind} {address(kernel)}"
                found = below(kernel)
                self.waiting[task] = {f"part {address(k)}" for k in found & parts}
                # an entry is optimised with all below it, a part compiled with the helpers that have no signature
                self.order[task] = size(kernel) + sum(size(k) for k in found if kind == "entry" or k.declared is None)
        # the longest chain of tasks first: a part is as urgent as the largest of those that wait for it
        for task in sorted(self.waiting, key=lambda t: len(self.waiting[t]), reverse=True):
            for before in self.waiting[task]:
                self.order[before] = max(self.order[before], self.order[task] + 1)
        self.total = len(self.waiting)

    def work(self) -> None:
        """Feed one helper process until nothing is left."""
        try:
            with _started() as helper:
                assert helper.stdin is not None
                assert helper.stdout is not None
                print(INTRODUCE, file=helper.stdin, flush=True)
                _check_helper(helper.stdout.readline())
                while (task := self._next()) is not None:
                    start = time.perf_counter()
                    try:
                        helper.stdin.write(task + "\n")
                        helper.stdin.flush()
                        answer = helper.stdout.readline().strip()
                    except OSError as error:
                        answer = str(error)
                    self._done(task, answer, time.perf_counter() - start)
        except Exception as error:
            # in a thread, where nobody would see it
            with self.lock:
                self.errors.append(f"a helper process failed: {error}")
                self.lock.notify_all()

    def _next(self) -> str | None:
        with self.lock:
            while True:
                ready = [task for task, before in self.waiting.items() if not before]
                if ready and not self.errors:
                    task = max(ready, key=lambda t: self.order[t])
                    del self.waiting[task]
                    self.running += 1
                    return task
                if not self.running or self.errors:
                    self.lock.notify_all()
                    return None
                self.lock.wait()

    def _done(self, task: str, answer: str, seconds: float) -> None:
        with self.lock:
            self.running -= 1
            if answer == "ok":
                for before in self.waiting.values():
                    before.discard(task)
                self.report(f"{self.total - len(self.waiting) - self.running}/{self.total} {task} {seconds:.1f} s")
            else:
                text = answer.encode().decode("unicode_escape") if answer else "the helper process ended"
                self.errors.append(f"{task} could not be compiled:\n{text}")
            self.lock.notify_all()


def _started() -> subprocess.Popen:
    """Start a helper process that imports and keeps what this process would, wherever it was started."""
    import numba

    root = str(Path(__file__).resolve().parents[2])
    paths = [os.path.abspath(path) for path in sys.path if path]
    if root not in map(os.path.realpath, paths):
        # this package was found in the current folder
        paths.insert(0, root)
    environment = {**os.environ, HELPER: "1", "PYTHONPATH": os.pathsep.join(paths)}
    if numba.config.CACHE_DIR:
        environment["NUMBA_CACHE_DIR"] = os.path.abspath(numba.config.CACHE_DIR)
    if environment.get("XDG_CACHE_HOME"):
        environment["XDG_CACHE_HOME"] = os.path.abspath(environment["XDG_CACHE_HOME"])
    # without -P the folder it runs in would come first
    command = [sys.executable or "", "-P", "-c", "from gearmbs.kernels.ahead import main; main()", "--helper"]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment, cwd=os.path.abspath(os.sep))


def _introduction() -> list[str]:
    """Return what a helper process must have in common with who started it: the code, and the compiler's setting."""
    from gearmbs.kernels import cache

    return [os.path.realpath(__file__), cache.setting()]


def _check_helper(line: str) -> None:
    """Raise RuntimeError unless the first line of a helper process is that of one of this kind."""
    if not line:
        raise RuntimeError("it ended at its start")
    own = _introduction()
    try:
        theirs = json.loads(line)
    except ValueError:
        raise RuntimeError("it is of another version") from None
    if theirs[0] != own[0]:
        raise RuntimeError(f"it imports another gearmbs, {theirs[0]} instead of {own[0]}")
    if theirs != own:
        raise RuntimeError("its numba has another setting")


def _help() -> None:
    """Compile what is asked for on standard input, line by line."""
    import gc

    from gearmbs.kernels.calls import find

    # the compiler makes millions of objects that live on; looking for cycles among them is time lost
    gc.disable()
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        kind, _, address = line.strip().partition(" ")
        if kind == INTRODUCE:
            print(json.dumps(_introduction()), file=answers, flush=True)
            continue
        try:
            kernel = find(*address.split(":"))
            if kernel is None:
                raise LookupError(address)
            if kind == "part":
                kernel.part(kernel.declared_types()[0])
            else:
                kernel.ready()
            answer = "ok"
        except Exception:
            answer = traceback.format_exc().encode("unicode_escape").decode()
        print(answer, file=answers, flush=True)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line of this module."""
    parser = argparse.ArgumentParser(
        prog="python -m gearmbs.kernels.ahead", description="Compile the numerical kernels."
    )
    parser.add_argument("--helper", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--workers", type=int, help="processes at a time; default: the cores")
    parser.add_argument("--quiet", action="store_true", help="print the last line only")
    parser.add_argument(
        "--prune",
        type=float,
        metavar="DAYS",
        nargs="?",
        const=PRUNED_AFTER,
        help=f"compile nothing; delete kernels that nobody has used for so many days ({PRUNED_AFTER:g})",
    )
    given = parser.parse_args(arguments)
    if given.helper:
        _help()
        return
    if given.prune is not None:
        if PLAIN:
            sys.exit(
                f"--prune = {given.prune:g}: in the plain mode ({COMPILER}) numba keeps the kernels, in folders "
                "plain-*; delete those that are not needed"
            )
        try:
            files, size = prune(given.prune)
        except ValueError as error:
            sys.exit(str(error))
        print(f"{files} files deleted, {size / 1e6:.1f} MB")
        return
    try:
        seconds = compile_all(None if given.quiet else print, workers=given.workers)
    except RuntimeError as error:
        sys.exit(str(error))
    print(f"kernels ready after {seconds:.1f} s")


if __name__ == "__main__":
    main()
