"""What computed a number: the code, the versions and the processor, under one fingerprint.

Results are only put beside each other if they come from equal code. What counts of a source is its syntax tree without
what cannot change a number:

* docstrings, unless the module asks for one (``__doc__``, ``getdoc``), comments, layout;
* messages: texts with a blank, and texts put together, in the arguments of exceptions, of warnings and of ``assert``.
  A text without a blank may be a name that a handler looks for, and counts; so do numbers.

Of the package count all modules but `OUTSIDE`, and its tables; a test runs simulations in a process that cannot import
those. Beyond it count the modules that a plan names, with all they import that belongs to them, wherever in the file
that is written, as ``import_module("name")`` too; of other packages their version and the digests that their installer
noted. Kernels are made of these sources by numba and LLVM for a target processor: their versions, options and the
processor count, too.

What a module reads while it runs, such as a table beside it, is not known here, nor a module that it loads under a
name that it puts together; who knows of files puts them into `Code.files`.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import json
import math
import os
import platform
import sys
import sysconfig
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from gearmbs.files import write_whole
from gearmbs.studies.run.loaded import MESSAGES_FROM, as_loaded
from gearmbs.system import processor_lines, processor_name, user_cache

PACKAGE = Path(__file__).parents[2]

OUTSIDE = (
    "__main__", "_command", "campaigns.campaign", "campaigns.cluster", "campaigns.datasets", "campaigns.figures",
    "campaigns.page", "campaigns.report", "campaigns.results", "campaigns.sensitivity", "campaigns.sobol_bounds",
    "campaigns.status", "campaigns.stored", "campaigns.surrogates", "cli", "compile", "identify", "saving", "view",
)  # fmt: skip
"""Modules and folders of the package that simulate nothing: they ask, show, write and distribute."""

COMMANDS = "commands"
"""Modules of this name, in any folder, simulate nothing, either."""

TABLES = (".toml", ".json", ".csv", ".npz")
"""Files of the package beside its modules that hold numbers."""

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "scikit-sundae", "xarray")
OPTIONS = ("GEARMBS_COMPILER", "NUMBA_OPT", "NUMBA_LOOP_VECTORIZE", "NUMBA_SLP_VECTORIZE", "NUMBA_ENABLE_AVX",
           "NUMBA_DISABLE_JIT", "NUMBA_BOUNDSCHECK", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")  # fmt: skip
"""Variables of the environment by which kernels become others."""

MOST_KNOWN = 5000
"""Digests of sources that are remembered between processes."""


class CodeChanged(RuntimeError):
    """A source was edited after this process had read it, so that what the process runs is not what stands there."""


@dataclass(frozen=True)
class Code:
    """What computed a number.

    Attributes
    ----------
    sources : dict of str
        Of each module and table its digest, without what cannot change a number.
    setting : dict of str
        Versions of Python and libraries, the processor that kernels are made for, options.
    files : dict of str
        Of each file that is read besides its digest, by the name under which it is read.
    """

    sources: dict[str, str]
    setting: dict[str, str]
    files: dict[str, str] = field(default_factory=dict)

    @functools.cached_property
    def digest(self) -> str:
        """The fingerprint."""
        what = {name: value for name, value in asdict(self).items() if value or name != "files"}
        return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()[:32]

    def differences(self, other: Code | None) -> str:
        """Return in words in what another code differs from this one."""
        if other is None:
            return "nothing is known of it"
        differing = [
            f"{name} {theirs or 'missing'} instead of {mine or 'missing'}"
            for name, mine, theirs in _unequal(self.setting, other.setting)
        ]
        for what, here, there in (("source", self.sources, other.sources), ("content", self.files, other.files)):
            if names := [name for name, _, _ in _unequal(here, there)]:
                more = f" and {len(names) - 3} more" if len(names) > 3 else ""
                differing.append(f"another {what} of {', '.join(names[:3])}{more}")
        return "; ".join(differing) or "nothing"


def _unequal(mine: Mapping[str, str], theirs: Mapping[str, str]) -> list[tuple[str, str, str]]:
    both = sorted({*mine, *theirs})
    return [(n, mine.get(n, ""), theirs.get(n, "")) for n in both if mine.get(n) != theirs.get(n)]


@dataclass(frozen=True)
class _Source:
    """A file that counts: the name it is known by, and how it looked when it was read."""

    name: str
    path: Path
    stamp: tuple[int, int, int]


def _stamp(path: Path) -> tuple[int, int, int]:
    about = path.stat()
    return about.st_mtime_ns, about.st_ctime_ns, about.st_size


@dataclass
class _Seen:
    """The code of some modules as it was read, and whether this process has loaded it so."""

    code: Code
    files: list[_Source]
    as_loaded: bool = False
    looked: float = -math.inf

    def stands(self, within: float = 0.0) -> bool:
        """Return whether all files look as they did, or did so within the last seconds."""
        now = time.monotonic()
        if now - self.looked < within:
            return True
        # looked at for each unit of a campaign: a look at a file and nothing else
        try:
            for place, stamp in self._looks:
                about = os.stat(place)
                if (about.st_mtime_ns, about.st_ctime_ns, about.st_size) != stamp:
                    return False
        except OSError:
            return False
        self.looked = now
        return True

    @functools.cached_property
    def _looks(self) -> list[tuple[str, tuple[int, int, int]]]:
        return [(str(source.path), source.stamp) for source in self.files]


_seen: dict[tuple[str, ...], _Seen] = {}
_looked_at: set[_Source] = set()
"""Sources that this process, or the one that it was forked from, has not loaded in another form."""


def code_of(modules: Iterable[str] = (), within: float = 0.0) -> Code:
    """Return the code by which this process simulates.

    Parameters
    ----------
    modules : iterable of str
        Modules beyond the package's that take part, with what they import.
    within : float
        A look at the sources so many seconds ago will do.

    Raises
    ------
    CodeChanged
        If a source is not any more what it was when this process looked first.
    ImportError
        If a module is not there, or is not Python.
    """
    names = tuple(sorted(set(modules)))
    known = _seen.get(names)
    if known is not None and known.stands(within):
        return known.code
    new, files = _read(names)
    if known is not None and new != known.code:
        raise CodeChanged(f"the code was edited while this process was at work: {known.code.differences(new)}")
    _seen[names] = _Seen(new, files)
    return new


def running_code(modules: Iterable[str] = (), within: float = 0.0) -> Code:
    """Return the code by which this process simulates, after a look whether that is what it has loaded; see `code_of`.

    Raises
    ------
    CodeChanged
        If a source was edited since it was loaded, and what that changed can be seen or cannot be told.
    """
    names = tuple(sorted(set(modules)))
    code = code_of(names, within)
    seen = _seen[names]
    for source in () if seen.as_loaded else seen.files:
        if source not in _looked_at:
            if not as_loaded(source.name, source.path, source.stamp):
                raise CodeChanged(f"{source.name} was edited after this process had loaded it; start it again")
            _looked_at.add(source)
    seen.as_loaded = True
    return code


def _read(names: Iterable[str]) -> tuple[Code, list[_Source]]:
    files, packages, digests, memory = [], set(LIBRARIES), {}, _Memory()
    waiting = [(name, path) for name, path in _package_files()]
    done = {name for name, _ in waiting}
    own = {name.partition(".")[0] for name in names} - {"gearmbs"}
    further = list(names)
    while waiting or further:
        if not waiting:
            name = further.pop()
            if name in done:
                continue
            done.add(name)
            path = _file_of(name, required=name in names)
            if path is None:
                continue
            top = name.partition(".")[0]
            if top not in own and top != "gearmbs":
                if is_installed(path):
                    packages.add(top)
                    continue
                if path.is_relative_to(sysconfig.get_path("stdlib")):
                    continue
            waiting.append((name, path))
        name, path = waiting.pop()
        files.append(_Source(name, path, _stamp(path)))
        digests[name], imports = memory.of(name, path)
        if not name.startswith("gearmbs."):
            further += imports
    memory.keep()
    return Code(digests, setting(packages)), files


def is_installed(path: Path) -> bool:
    """Return whether a file is of a package that an installer has put there."""
    return not {"site-packages", "dist-packages"}.isdisjoint(path.parts)


def _package_files() -> Iterator[tuple[str, Path]]:
    """Yield name and path of what counts of the package."""
    for folder, folders, files in os.walk(PACKAGE):
        folders[:] = sorted(f for f in folders if f != "__pycache__")
        for file in sorted(files):
            path = Path(folder, file)
            if path.suffix not in (".py", *TABLES):
                continue
            parts = path.relative_to(PACKAGE).with_suffix("" if path.suffix == ".py" else path.suffix).parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            if counts(name):
                yield f"gearmbs.{name}".rstrip("."), path


def counts(name: str) -> bool:
    """Return whether a module of the package, by its name without the package's, takes part in simulations."""
    return name.rpartition(".")[2] != COMMANDS and not any(name == o or name.startswith(f"{o}.") for o in OUTSIDE)


def _file_of(module: str, required: bool) -> Path | None:
    """Return the file of a module that is none of the interpreter's own."""
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, AttributeError, ValueError):
        spec = None
    if spec is None:
        if required:
            raise ModuleNotFoundError(f"No module named {module!r}", name=module)
        return None
    return Path(spec.origin) if spec.origin not in (None, "built-in", "frozen") else None


# What counts of a source.


DOCUMENTS = ("__doc__", "getdoc")
"""Names by which a source asks for docstrings, which then count."""

IMPORTERS = ("import_module", "__import__")
"""Functions that import a module by its name."""


class _Messages(ast.NodeTransformer):
    """Takes out of a syntax tree what cannot change a number.

    Parameters
    ----------
    asked : bool
        Whether the source asks for docstrings, which then stay.
    """

    def __init__(self, asked: bool = False) -> None:
        self.asked = asked

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        _mute_named(node)
        return self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        if isinstance(node.exc, ast.Call):
            _mute(node.exc)
        return self.generic_visit(node)

    def visit_Assert(self, node: ast.Assert) -> ast.AST:
        node.msg = None
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if _warns(node):
            _mute(node)
        return self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        # a text that stands for itself describes what is beside it
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str) and not self.asked:
            return None
        return self.generic_visit(node)


class _Muted(ast.NodeTransformer):
    def visit(self, node: ast.AST) -> Any:
        words = isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value
        return ast.Constant("") if words or isinstance(node, ast.JoinedStr) else self.generic_visit(node)


def _mute(call: ast.Call) -> None:
    """Take the messages out of the arguments of a call."""
    call.args = [_Muted().visit(arg) for arg in call.args]
    for keyword in call.keywords:
        keyword.value = _Muted().visit(keyword.value)


def _name_called(node: ast.Call) -> str | None:
    """Return the name of the function of a call, without what it belongs to."""
    return getattr(node.func, "attr", getattr(node.func, "id", None))


def _warns(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and _name_called(node) in MESSAGES_FROM


def _mute_named(function: ast.FunctionDef) -> None:
    """Take the messages out of what a function gives names that only its messages use."""
    whole = list(ast.walk(function))
    messages = [n.exc for n in whole if isinstance(n, ast.Raise) and isinstance(n.exc, ast.Call)]
    waiting = [*messages, *(n for n in whole if _warns(n)), *(n.msg for n in whole if isinstance(n, ast.Assert))]
    shared = {name for n in whole if isinstance(n, ast.Global | ast.Nonlocal) for name in n.names}
    assigned = [(n.targets[0], n) for n in whole if isinstance(n, ast.Assign)]
    given = [(name.id, n) for name, n in assigned if isinstance(name, ast.Name) and name.id not in shared]
    known, muted = Counter[str](), list[ast.Assign]()
    used = Counter(n.id for n in whole if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load))
    while waiting:
        found = [n for part in waiting if part is not None for n in ast.walk(part) if isinstance(n, ast.Name)]
        known.update(n.id for n in found if isinstance(n.ctx, ast.Load))
        # a name in a message may stand for another one
        new = [n for name, n in given if n not in muted and known[name] == used[name]]
        muted += new
        waiting = [n.value for n in new]
    for node in muted:
        node.value = _Muted().visit(node.value)


def what_counts(source: bytes) -> str:
    """Return a digest of a source in Python without what cannot change a number."""
    tree = ast.parse(source)
    asked = any(
        getattr(node, name, None) in DOCUMENTS for node in ast.walk(tree) for name in ("id", "attr", "value", "name")
    )
    return hashlib.sha256(ast.dump(_Messages(asked).visit(tree)).encode()).hexdigest()[:32]


def _imports(name: str, path: Path, source: bytes) -> list[str]:
    """Return the names of all modules that a module may import, with those in functions; some are not modules."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            found += [base, *(f"{base}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Call) and _name_called(node) in IMPORTERS:
            given = node.args[0] if node.args else None
            if isinstance(given, ast.Constant) and isinstance(given.value, str):
                near = given.value.lstrip(".")
                above = package.split(".")[: len(package.split(".")) - (len(given.value) - len(near)) + 1]
                found.append(".".join([*above, near]) if near != given.value else near)
    # packages run their own code before that of what they hold
    return sorted({".".join(n.split(".")[: k + 1]) for n in found if n for k in range(n.count(".") + 1)})


class _Memory:
    """What takes time to find out, by all that it depends on, in a file of the user's.

    Digests of sources by those of their raw bytes: a tree of all of the package takes some seconds to read.
    """

    def __init__(self, name: str = "sources.json") -> None:
        cache = user_cache()
        self.path = None if cache is None else cache / "gearmbs" / name
        self.known, self.new = dict[str, str](), dict[str, str]()
        with suppress(OSError, ValueError):
            known = json.loads("{}" if self.path is None else self.path.read_text(encoding="utf-8"))
            if known and known.pop("check") == _check(known):
                self.known = known

    def of(self, name: str, path: Path) -> tuple[str, list[str]]:
        """Return the digest of a file and the names of what it imports."""
        content = path.read_bytes()
        raw = hashlib.sha256(content).hexdigest()[:32]
        if path.suffix != ".py":
            return raw, []
        key = f"{raw} {_made_by()}"
        if key not in self.known:
            try:
                self.known[key] = self.new[key] = what_counts(content)
            except SyntaxError as error:
                raise ImportError(f"{path}, line {error.lineno}: {error.msg}", name=name) from error
        return self.known[key], [] if name.startswith("gearmbs") else _imports(name, path, content)

    def keep(self) -> None:
        """Write down what was found out; where that cannot be done it is found out again."""
        if self.new and self.path is not None:
            kept = self.known if len(self.known) <= MOST_KNOWN else self.new
            with suppress(OSError):
                write_whole(self.path, json.dumps({**kept, "check": _check(kept)}))


@functools.cache
def _made_by() -> str:
    """Return what digests of sources depend on beside them: this module, and the version of Python for syntax trees."""
    own = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:16]
    return f"{own} {sys.version_info[0]}.{sys.version_info[1]}"


def _check(known: Mapping[str, str]) -> str:
    return hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()


# Versions and processor.


@functools.cache
def processor() -> str:
    """Return the processor that kernels are made for, with its instructions as a digest."""
    if "numba" in sys.modules:
        return _processor()
    # who only drives, or simulates without kernels, loads no compiler for it
    host = processor_lines()
    if not host:
        return _processor()
    memory, key = _Memory("processors.json"), _host(host)
    if key not in memory.known:
        found = _processor()
        if os.environ.get("GEARMBS_COMPILER") == "plain":
            return found
        memory.known[key] = memory.new[key] = found
        memory.keep()
    return memory.known[key]


def _host(lines: list[str]) -> str:
    """Return a digest of all that the processor that kernels are made for depends on."""
    options = sorted(item for item in os.environ.items() if item[0].startswith(("NUMBA_", "GEARMBS_COMPILER")))
    # numba reads its options from there, too
    file = Path(".numba_config.yaml")
    beside = file.read_text(encoding="utf-8") if file.is_file() else ""
    makers = [path.read_bytes() for path in sorted((PACKAGE / "kernels").rglob("*.py"))]
    makers.append(Path(__file__).read_bytes())
    versions = platform.python_version(), _installed_as("numba"), _installed_as("llvmlite")
    what = [hashlib.sha256(source).hexdigest() for source in makers], lines, versions, options, beside
    return hashlib.sha256(repr(what).encode()).hexdigest()[:32]


def _processor() -> str:
    from gearmbs.kernels import PLAIN

    if PLAIN:
        # what the compiler finds out is told by private parts only
        return processor_name()
    from gearmbs.kernels.cache import target

    name, features = target()
    return f"{name} {hashlib.sha256(features.encode()).hexdigest()[:8]}"


def setting(packages: Iterable[str] = LIBRARIES) -> dict[str, str]:
    """Return the versions and options that numbers depend on."""
    found = {"python": platform.python_version(), "machine": platform.machine(), "processor": processor()}
    found |= {name: value for name in OPTIONS if (value := os.environ.get(name))}
    return found | {name: differing for name in packages if (differing := _installed_as(name))}


@functools.cache
def _installed_as(name: str) -> str:
    """Return the version of a package, with a digest of what its installer noted of its code."""
    try:
        about = distribution(name)
    except PackageNotFoundError:
        from importlib.metadata import packages_distributions

        # some are imported under another name than they are installed by
        known = packages_distributions().get(name)
        if not known:
            return "not installed"
        about = distribution(known[0])
    noted = [
        line
        for line in (about.read_text("RECORD") or "").splitlines()
        if not line.startswith("..") and line.partition(",")[0].endswith((".py", ".so", ".pyd", ".dylib", ".dll"))
    ]
    return f"{about.version} {hashlib.sha256(repr(sorted(noted)).encode()).hexdigest()[:8]}"
