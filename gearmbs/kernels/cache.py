"""Compiled kernels on disk, under a digest of all that they are made of.

A digest covers the byte code of the function and of every function it calls, the values of the globals they name, the
declared types and options, the minor versions of Python, numba and LLVM, the processor, and the source of the modules
that compile and keep kernels. So an edit never finds stale code, a comment or docstring of a kernel costs nothing, and
nothing on disk is ever changed or deleted but a file that cannot be read: processes, checkouts and users may share a
folder. Looking costs no file work before the first kernel is called.

The folder is ``$NUMBA_CACHE_DIR`` if that is set; else ``gearmbs`` in the user's cache folder, which all environments
and checkouts of a user share; or, where that cannot be written, ``__pycache__/kernels`` of the package that the kernel
belongs to. What lies there is found in any case. Where nothing can be written, kernels are compiled for the process
alone.

A wheel may bring kernels along, in `SHIPPED`, made for the processor `COMMON` (`gearmbs.kernels.ship`). They come first
wherever the processor has its instructions and none was chosen by ``NUMBA_CPU_NAME`` or ``NUMBA_CPU_FEATURES``, so that
all such machines run the same code.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import os
import pickle
import platform
import sys
import threading
import types as python
import uuid
import zlib
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.kernels.kinds import Deferred, Kind, Signature
from gearmbs.kernels.locks import held
from gearmbs.system import PROC

FORMAT = "5"
"""To be raised when the files or what they hold change."""

MAKERS = ("own/jit", "own/references", "library", "cache", "own/late", "own/straight", "texts")
"""Modules of this package that make what is kept; an edit of theirs makes all of it anew."""

SHIPPED = Path(__file__).with_name("shipped")
"""Where kernels are that a wheel brought along; there are none in a checkout."""

COMMON = ("x86-64-v3", "")
"""Name and further instructions of the processor that they are made for."""

COMMON_SYSTEM = "x86_64-unknown-linux-gnu"
"""What LLVM calls the system that they are made for."""

NEEDED = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt")
"""Instructions of `COMMON` beyond those of every 64-bit processor of Intel's kind (x86-64 psABI, level 3)."""

OPTIONS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "ENABLE_AVX", "BOUNDSCHECK", "DEBUGINFO", "DEBUGINFO_DEFAULT")
"""Settings of numba's that change its machine code."""

SETTINGS_FILE = ".numba_config.yaml"
"""A file of settings in the present folder that numba reads when it is imported."""

CPU_FILE = PROC / "cpuinfo"
"""What the system tells of its processors."""

_parts: dict[str, Any] = {}


# what a kernel is made of


def target() -> tuple[str, str]:
    """Return name and instructions of the processor that the package's kernels are made for."""
    return COMMON if shipped() else _own_target()[1:]


def option(name: str) -> str | None:
    """Return a setting of numba's as it was given; None if it was not.

    Numba need not be imported for it: its settings are variables of the environment, unless there is a file of them.
    """
    if "numba" not in sys.modules and not os.path.exists(SETTINGS_FILE):
        return os.environ.get(f"NUMBA_{name}") or None
    from numba.core import config

    found = getattr(config, name, None)
    return None if found in (None, "") else str(found)


def _target_file() -> Path:
    """Return where it is kept what processor numba compiles for here."""
    return own_folders(__package__.partition(".")[0])[-1] / f"target-{_surroundings()}.json"


def known() -> bool:
    """Return whether the own stages have been used here with this numba, or kernels came along that were made so."""
    return SHIPPED.is_dir() or _kept_target(_target_file()) is not None


def know() -> None:
    """Keep that the own stages work with this numba."""
    _own_target()


@functools.cache
def _own_target() -> tuple[str, str, str]:
    """Return the kind of system, and name and instructions of the processor that is compiled for here.

    LLVM tells them; what it has told stands in a file from then on, under a digest of all it depends on.
    """
    file = _target_file()
    kept = _kept_target(file)
    if kept is not None and "numba" not in sys.modules:
        return kept
    from numba.core.registry import cpu_target

    found: tuple[str, str, str] = cpu_target.target_context.codegen().magic_tuple()
    if kept != found:
        _write_whole(file, json.dumps(found).encode())
    return found


def _kept_target(file: Path) -> tuple[str, str, str] | None:
    """Return what a file tells of the processor; None where it cannot be read, or is not what was written."""
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not (isinstance(told, list) and [type(part) for part in told] == [str] * 3):
        return None
    system, name, features = told
    return system, name, features


def _surroundings() -> str:
    """Return a digest of what tells which processor numba compiles for: the machine, its versions and settings."""
    try:
        told = CPU_FILE.read_text(encoding="utf-8").partition("\n\n")[0]
        # frequencies and the like change all the time
        kept = ("vendor_id", "cpu family", "model", "stepping", "flags", "Features", "CPU")
        machine = [line for line in told.splitlines() if line.startswith(kept)]
    except OSError:
        machine = [platform.processor()]
    asked = [os.environ.get(f"NUMBA_{name}") for name in ("CPU_NAME", "CPU_FEATURES", "ENABLE_AVX")]
    with contextlib.suppress(OSError):
        asked.append(Path(SETTINGS_FILE).read_text(encoding="utf-8"))
    text = repr((platform.system(), platform.machine(), machine, version_of("numba"), version_of("llvmlite"), asked))
    return hashlib.sha256(text.encode()).hexdigest()[:24]


@functools.cache
def version_of(library: str) -> str:
    """Return the version of an installed library, without importing it; nothing if there is none."""
    found = getattr(sys.modules.get(library), "__version__", None)
    if found is not None:
        return str(found)
    try:
        return version(library)
    except PackageNotFoundError:
        return ""


IN_FLAGS = {"bmi": "bmi1", "lzcnt": "abm"}
"""What `CPU_FILE` calls instructions that LLVM calls otherwise."""


def lacking() -> list[str]:
    """Return which instructions of `COMMON` the processor has not; nothing if no kernels came along."""
    if not SHIPPED.is_dir():
        return []
    try:
        lines = CPU_FILE.read_text(encoding="utf-8").splitlines()
        flags = next((line for line in lines if line.startswith("flags")), "").partition(":")[2].split()
        has = {name: IN_FLAGS.get(name, name) in flags for name in NEEDED}
    except OSError:
        import llvmlite.binding

        has = llvmlite.binding.get_host_cpu_features()
    return [name for name in NEEDED if not has.get(name)]


@functools.cache
def shipped() -> bool:
    """Return whether kernels came along that run here, and none are asked for that are made for another processor."""
    return SHIPPED.is_dir() and option("CPU_NAME") is None and option("CPU_FEATURES") is None and not lacking()


@functools.cache
def setting(processor: tuple[str, str] | None = None) -> str:
    """Return what all kernels for a processor depend on; default: the one that is compiled for here."""
    magic = (COMMON_SYSTEM, *processor) if processor else _own_target()
    made_by = [hashlib.sha256((Path(__file__).parent / f"{name}.py").read_bytes()).hexdigest() for name in MAKERS]
    # a patch release changes no machine code that others have to fit
    told = (version_of("numba"), version_of("llvmlite"), platform.python_version())
    versions = [v.split(".")[:2] for v in told]
    return repr((FORMAT, versions, magic, _options(), made_by))


def _options() -> list[tuple[str, Any]]:
    """Return numba's settings that change its code, where any is given."""
    if not os.path.exists(SETTINGS_FILE) and not any(f"NUMBA_{name}" in os.environ for name in OPTIONS):
        return []
    from numba.core import config

    return [(name, getattr(config, name, None)) for name in OPTIONS]


_identities: dict[Any, str] = {}


class _UnderWay(threading.local):
    """Functions whose description is under way, and how deep among them those stand that others call in turn."""

    def __init__(self) -> None:
        self.functions: list[Any] = []
        self.called_back: list[int] = []


_under_way = _UnderWay()


def identity(function: Any) -> str:
    """Return a digest of a function, or kernel, and of all below it; of those that call each other as of any others."""
    # numba's part of a kernel stands for that
    function = vars(function).get("kernel", function)
    known = _identities.get(function)
    if known is not None:
        return known
    outer, called_back = _under_way.functions, _under_way.called_back
    depth = len(outer)
    if function in outer:
        called_back.append(outer.index(function))
        return f"the caller {called_back[-1] - depth} above"
    outer.append(function)
    try:
        digest = hashlib.sha256(_described(function).encode()).hexdigest()
        if not called_back:
            # digests inside a circle of calls hold for the place from which it was entered
            _identities[function] = digest
    finally:
        del outer[depth:]
        called_back[:] = [place for place in called_back if place < depth]
    return digest


def _described(function: Any) -> str:
    plain = getattr(function, "py_func", function)
    names: list[str] = []
    code = _code(plain.__code__, plain.__doc__, names)
    found = []
    for name in dict.fromkeys(names):
        if name in plain.__globals__:
            found.append((name, _token(plain.__globals__[name], names)))
    cells = [_token(cell.cell_contents, names) for cell in plain.__closure__ or ()]
    options: tuple = ()
    if plain is not function:
        options = (
            sorted((k, repr(v)) for k, v in function.targetoptions.items()),
            _declared(function),
        )
    return repr((plain.__module__, plain.__qualname__, code, found, cells, _token(plain.__defaults__, names), options))


def _declared(function: Any) -> str:
    if getattr(function, "declared", None) is None:
        return ""
    args, result = function.declared_types()
    return repr(([_type(t) for t in args], _type(result)))


def _type(kind: Any) -> str:
    """Return a text for a type; unlike its name it has the fields of named tuples."""
    if kind is None:
        return ""
    if isinstance(kind, Kind):
        return kind.told + (_source(VIEWS) if kind.structs else "")
    from numba import types

    if isinstance(kind, types.Dispatcher):
        return identity(kind.dispatcher)
    fields = getattr(kind, "fields", "") if isinstance(kind, types.BaseNamedTuple) else ""
    inner = [_type(t) for t in kind.types] if isinstance(kind, types.BaseTuple) else ""
    # types of one's own come with code that reads and writes their members
    return f"{kind} {fields} {inner} {_source(type(kind).__module__)}"


VIEWS = f"{__package__}.own.views"
"""The module of code that reads and writes members of structs."""


def _is_compiled(value: Any) -> bool:
    """Return whether a value is a kernel, or a function of `numba.njit`."""
    kind = type(value)
    known = hasattr(kind, "_compile_for_args") or kind.__module__.startswith(f"{__package__}.")
    return known and isinstance(getattr(value, "py_func", None), python.FunctionType)


def _is_numba_type(value: Any) -> bool:
    if "numba" not in sys.modules:
        return False
    from numba import types

    return isinstance(value, types.Type)


def _code(code: python.CodeType, doc: str | None, names: list[str]) -> str:
    """Return what a code object does, without its lines and its docstring; collect the names it uses."""
    names.extend(code.co_names)
    constants = [
        _code(c, None, names) if isinstance(c, python.CodeType) else _token(c, names)
        for c in code.co_consts
        if c is None or c != doc
    ]
    variables = (code.co_varnames, code.co_freevars, code.co_cellvars, code.co_argcount, code.co_flags)
    return repr((code.co_code.hex(), constants, code.co_names, variables))


def _token(value: Any, names: list[str]) -> str:
    """Return a text that differs when what compiled code takes from a value differs."""
    if isinstance(value, Signature):
        return f"Signature [{_token(value.return_type, names)}, {_token(value.args, names)}]"
    if value is None or isinstance(value, (bool, int, float, complex, str, bytes, np.generic)):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, (tuple, list)):
        return f"{type(value).__qualname__} [{', '.join(_token(v, names) for v in value)}]"
    if isinstance(value, frozenset):
        return f"frozenset {sorted(_token(v, names) for v in value)}"
    if isinstance(value, python.FunctionType) or _is_compiled(value):
        plain = getattr(value, "py_func", value)
        if not _inside(plain.__module__):
            return f"{plain.__module__}.{plain.__qualname__}"
        if getattr(value, "late", False):
            # its callers hold its address only
            return f"late {plain.__module__}:{plain.__name__} {_declared(value)}"
        # what a plain function stands for in compiled code is told elsewhere in its module
        return identity(value) + ("" if plain is not value else _source(plain.__module__))
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"
    if isinstance(value, Deferred):
        return f"{value} {[_token(one, names) for one in value.given]} {_source(value.module)}"
    if isinstance(value, Kind) or _is_numba_type(value):
        return _type(value)
    if isinstance(value, np.dtype):
        return repr(value)
    if isinstance(value, python.ModuleType):
        if not _inside(value.__name__):
            return value.__name__
        used = [name for name in dict.fromkeys(names) if name in value.__dict__]
        return repr([(name, _token(value.__dict__[name], names)) for name in used])
    home = getattr(value, "__module__", None) or type(value).__module__
    if isinstance(getattr(value, "_defn", None), python.FunctionType) and _inside(home):
        # an intrinsic
        return f"{identity(value._defn)} {_source(home)}"
    name = getattr(value, "__qualname__", type(value).__qualname__)
    return f"{home}.{name} {_source(home)}"


@functools.cache
def _inside(module: str | None) -> bool:
    """Return whether a module is code of one's own, and not of an installed library's."""
    top = (module or "").partition(".")[0]
    return top not in ("numba", "numpy", "math", "builtins", "scipy", "llvmlite", "operator", "cmath", "")


@functools.cache
def _source(module: str) -> str:
    """Return a digest of a module's source, for objects that have no code of their own."""
    if not _inside(module):
        return ""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None and module.startswith(f"{__package__}."):
        # of modules that are imported where something is compiled
        file = getattr(find_spec(module), "origin", None)
    if file is None:
        return ""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


# where it is kept


def file_name(kernel: Any, kind: str, args: tuple, processor: tuple[str, str] | None = None) -> str:
    """Return the name of the file of an entry or part; default: for the processor that is compiled for here."""
    told = [_type(t) for t in (args if kernel.declared is None else kernel.declared_types()[0])]
    text = repr((setting(processor), identity(kernel), kind, told))
    digest = hashlib.sha256(text.encode()).hexdigest()[:24]
    return f"{kernel.__module__.partition('.')[2] or kernel.__module__}.{kernel.__name__}-{digest}.{kind}"


def _names(kernel: Any, kind: str, args: tuple) -> list[str]:
    """Return the names under which an entry or part may be found: what came along comes first."""
    return [file_name(kernel, kind, args, processor) for processor in ([COMMON, None] if shipped() else [None])]


@functools.cache
def folders(package: str) -> tuple[Path, ...]:
    """Return where kernels of a package may be found; the last one is where new ones go, if it can be written."""
    along = (SHIPPED,) if package == __package__.partition(".")[0] and shipped() else ()
    return (*along, *own_folders(package))


def own_folders(package: str) -> tuple[Path, ...]:
    """Return where kernels of a package are that were compiled by its users; the last one is where new ones go."""
    chosen = option("CACHE_DIR")
    if chosen:
        return (Path(chosen) / package,)
    home = getattr(sys.modules.get(package), "__file__", None)
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gearmbs" / package
    if home is None:
        return (user,)
    beside = Path(home).parent / "__pycache__" / "kernels"
    return (beside, user) if _writable(user) else (user, beside)


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def writable(package: str) -> bool:
    """Return whether kernels of a package can be kept."""
    return _writable(folders(package)[-1])


def _read(file: str, package: str) -> Any:
    for folder in folders(package):
        try:
            data = (folder / file).read_bytes()
        except OSError:
            continue
        if len(data) > 4 and zlib.crc32(data[4:]).to_bytes(4, "little") == data[:4]:
            return pickle.loads(data[4:])
    return None


def _write(file: str, package: str, payload: Any) -> None:
    from numba.core import serialize

    data = serialize.dumps(payload)
    _write_whole(folders(package)[-1] / file, zlib.crc32(data).to_bytes(4, "little") + data)


def _write_whole(file: Path, data: bytes) -> None:
    """Write a file, or nothing of it where that cannot be."""
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        temporary = file.with_name(f"{file.name}.{uuid.uuid4().hex[:12]}.tmp")
        try:
            temporary.write_bytes(data)
            temporary.replace(file)
        finally:
            temporary.unlink(missing_ok=True)


def _package(kernel: Any) -> str:
    return kernel.__module__.partition(".")[0]


def stored(kernel: Any, kind: str, args: tuple) -> bool:
    """Return whether an entry or part is on disk."""
    names = _names(kernel, kind, args)
    return any(os.path.exists(folder / name) for name in names for folder in folders(_package(kernel)))


def load(kernel: Any, kind: str, args: tuple, rebuild: Callable) -> Any:
    """Return an entry or part from disk, or None."""
    found = (_load(name, _package(kernel), kind, rebuild) for name in _names(kernel, kind, args))
    return next((made for made in found if made is not None), None)


def _load(file: str, package: str, kind: str, rebuild: Callable) -> Any:
    if kind == "part" and file in _parts:
        return _parts[file]
    try:
        payload = _read(file, package)
        made = None if payload is None else rebuild(package, file, payload)
    except Exception:
        # what cannot be rebuilt, for whatever reason, is compiled again and its file replaced
        made = None
    if kind == "part" and made is not None:
        _parts[file] = made
    return made


def loaded_part(file: str, package: str, rebuild: Callable) -> Any:
    """Return a part by the name of its file, or None."""
    return _load(file, package, "part", rebuild)


class Slot:
    """The place of an entry or part that is being compiled, held against other processes."""

    def __init__(self, kernel: Any, kind: str, args: tuple) -> None:
        self.package, self.kind = _package(kernel), kind
        self.file = file_name(kernel, kind, args)
        self.name = self.file.rpartition("-")[2].partition(".")[0]

    def load(self, rebuild: Callable) -> Any:
        """Return what another process has put there meanwhile, or None."""
        return _load(self.file, self.package, self.kind, rebuild)

    def save(self, payload: tuple | None) -> None:
        """Keep what was compiled."""
        if payload is not None:
            _write(self.file, self.package, payload)

    def keep(self, part: Any) -> None:
        """Remember a part for this process."""
        _parts[self.file] = part


@contextlib.contextmanager
def compiling(kernel: Any, kind: str, args: tuple) -> Iterator[Slot]:
    """Yield the slot of an entry or part, while no other process compiles the same."""
    slot = Slot(kernel, kind, args)
    with held(folders(slot.package)[-1] / f"{slot.file}.lock"):
        yield slot
