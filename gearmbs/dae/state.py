"""The state of a DAE at an instant: all that its continuation depends on, as one object that can be kept in a file.

See "States and stepping" in the theory for what a state holds and why a continuation with history is exact.
"""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.files import whole_file
from gearmbs.kernels.bound import NAMES
from gearmbs.wording import did_you_mean

LONGEST = 60
"""Characters of a value that a message shows."""
FORMAT = 3
"""Number of the format of files; others are refused."""


SEE = "see its names"
FOLLOWING = ("p_", "lambda(", "mu(", "F_", "N_")
"""Beginnings of the names of momenta, multipliers and loads."""


@dataclass(frozen=True, eq=False)
class History:
    """What an integrator remembers of the steps behind it.

    Attributes
    ----------
    method : str
        The integrator: another one cannot go on with it.
    numbers : mapping of str to ndarray
        Arrays and scalars of the run by name, copies of its own; see `gearmbs.dae.integrators.stepping.memory`.
    plan : object or None
        Pivots in use, where the process that chose them is still there; they follow from ``numbers``.
    equations : str
        Of the model that the steps were made with, see `equations_of`.
    tol : float
        Tolerance of the steps, 0 where it is not known.
    """

    method: str
    numbers: Mapping[str, np.ndarray]
    plan: Any = None
    equations: str = ""
    tol: float = 0.0

    @classmethod
    def made(cls, method: str, numbers: Mapping[str, np.ndarray], plan: Any, equations: str, tol: float) -> History:
        """Return one, in a third of the time that assigning to a frozen class takes."""
        made = cls.__new__(cls)
        made.__dict__.update(method=method, numbers=numbers, plan=plan, equations=equations, tol=tol)
        return made


class Memory(NamedTuple):
    """When a controller samples, and what it remembers.

    Attributes
    ----------
    schedule : ndarray, shape (3,)
        Start, s; sample time, s; samples taken.
    numbers : ndarray
    """

    schedule: np.ndarray
    numbers: np.ndarray


def equations_of(problem: DAEProblem) -> str:
    """Return a digest of all that the equations of a problem, as assembled, depend on: tables and functions."""
    addressed = np.isin(problem.idata, np.fromiter(NAMES, dtype=np.int64))
    names = [problem.residual.__name__, *(NAMES[k] for k in problem.idata[addressed].tolist())]
    found = hashlib.blake2b("\n".join(names).encode(), digest_size=32)
    found.update(np.where(addressed, -1, problem.idata).tobytes())
    found.update(problem.rdata.tobytes())
    return found.hexdigest()


def changed_places(now: np.ndarray, before: np.ndarray, *known: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return places and values of a table where it differs from another one, and those of known places."""
    differs = now != before
    for places in known:
        if places is not None:
            differs[places] = True
    # a third of the time of numpy's flatnonzero
    changed = differs.nonzero()[0]
    return changed, now[changed]


def _digest(arrays: Mapping[str, Any]) -> np.ndarray:
    """Return a digest of named arrays, as bytes."""
    found = hashlib.blake2b(digest_size=16)
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        found.update(f"{name} {array.dtype.str} {array.shape}".encode())
        found.update(array.tobytes())
    return np.frombuffer(found.digest(), dtype=np.uint8)


@dataclass(frozen=True, eq=False, repr=False)
class State:
    """A DAE at an instant.

    Attributes
    ----------
    t : float
        Instant, s.
    y, yp : ndarray, shape (n,)
        Unknowns and their rates: of a mechanism positions, velocities, multipliers, loads and states of elements.
    names : tuple of str
        Of the unknowns.
    t_model : float
        Time for which the model was assembled, s.
    sizes : tuple of int
        Lengths of the model's tables of integers and numbers.
    integers, reals : tuple of ndarray
        Places and values of what differs from these tables, Euler references and counted turns, and of what was set.
    history : History or None
        Of the integrator; without it a run starts afresh, at order one.
    controllers : mapping of str to Memory
        Of a simulator, by the inputs they set.
    told : tuple of (float, bytes, bytes) or None
        ``t``, ``y`` and ``yp`` that the history is one of. With others, written there, a run starts afresh.
    """

    t: float
    y: np.ndarray
    yp: np.ndarray
    names: tuple[str, ...]
    t_model: float
    sizes: tuple[int, int]
    integers: tuple[np.ndarray, np.ndarray]
    reals: tuple[np.ndarray, np.ndarray]
    history: History | None = field(default=None)
    controllers: Mapping[str, Memory] = field(default_factory=dict)
    told: tuple[float, bytes, bytes] | None = None

    @classmethod
    def held(
        cls,
        of_model: Mapping[str, Any],
        t: float,
        point: Any,
        history: History,
        integers: tuple[np.ndarray, np.ndarray],
        before: np.ndarray,
        given: np.ndarray | None,
    ) -> State:
        """Return the state of a problem that a run is under way with, as `of` does, in a tenth of the time.

        Parameters
        ----------
        of_model : mapping
            ``names``, ``t_model`` and ``sizes``.
        t : float
        point
            Has ``point``, unknowns and rates, and ``rdata``, copies made where somebody asks for them.
        history : History
        integers, given
            As of `of`.
        before : ndarray
            The problem's table of numbers.
        """
        made = cls.__new__(cls)
        own = made.__dict__
        own.update(of_model)
        own["t"], own["history"], own["integers"], own["controllers"] = t, history, integers, {}
        own["_later"] = point, before, given
        return made

    def __getattr__(self, name: str) -> Any:
        own = self.__dict__
        if "_later" in own and name in ("y", "yp", "reals"):
            point, before, given = own["_later"]
            if name == "reals":
                own[name] = changed_places(point.rdata[: len(before)], before, given)
            else:
                own["y"], own["yp"] = y, yp = point.point
                own["told"] = own["t"], y.tobytes(), yp.tobytes()
            return own[name]
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __getstate__(self) -> dict[str, Any]:
        self.y, self.reals  # noqa: B018
        return {name: value for name, value in self.__dict__.items() if name != "_later"}

    @classmethod
    def of(
        cls,
        problem: DAEProblem,
        t: float,
        y: np.ndarray,
        yp: np.ndarray,
        tables: tuple[np.ndarray, np.ndarray],
        history: History | None = None,
        origin: State | None = None,
        integers: tuple[np.ndarray, np.ndarray] | None = None,
        given: np.ndarray | None = None,
    ) -> State:
        """Return the state of a problem.

        Parameters
        ----------
        problem : DAEProblem
        t : float
        y, yp : ndarray, shape (n,)
        tables : (ndarray, ndarray)
            Tables of integers and numbers as they are at ``t``.
        history : History, optional
        origin : State, optional
            The state that the problem starts in, as :meth:`problem` has made it.
        integers : (ndarray, ndarray), optional
            Those of an earlier state with the same table, which need not be looked for then.
        given : ndarray of int, optional
            Places of numbers that belong to the state even where they are those of the problem.
        """
        if integers is None:
            integers = changed_places(tables[0], problem.idata, None if origin is None else origin.integers[0])
        reals = changed_places(tables[1], problem.rdata, None if origin is None else origin.reals[0], given)
        sizes = len(problem.idata), len(problem.rdata)
        t_model = float(problem.t0) if origin is None else origin.t_model
        names = tuple(problem.names)
        t, told = float(t), None if history is None else (float(t), y.tobytes(), yp.tobytes())
        # as its class does, in a third of the time that assigning to a frozen one takes
        made = cls.__new__(cls)
        made.__dict__.update(
            t=t, y=y.copy(), yp=yp.copy(), names=names, t_model=t_model, sizes=sizes, integers=integers, reals=reals,
            history=history, controllers={}, told=told,
        )  # fmt: skip
        return made

    def tables(self, problem: DAEProblem) -> tuple[np.ndarray, np.ndarray]:
        """Return the tables of a problem, as assembled at ``t_model``, as they are in this state."""
        found = problem.idata.copy(), problem.rdata.copy()
        for table, (places, values) in zip(found, (self.integers, self.reals), strict=True):
            table[places] = values
        return found

    def problem(self, problem: DAEProblem, history: History | None = None) -> DAEProblem:
        """Return a problem, as assembled at ``t_model``, that starts in this state.

        Without a ``history`` that it goes on with its numbers may be others than those the state was made with. A body
        of another inertia then has the velocity of the state, not its momentum.

        Raises
        ------
        ModelError
            If the state is one of another model; the message names what differs.
        """
        self.check(problem)
        idata, rdata = self.tables(problem)
        y, yp = self.y.copy(), self.yp.copy()
        if history is None and problem.own_start is not None:
            y, yp = problem.own_start(self.t, y, yp, idata, rdata)
        return replace(problem, t0=self.t, y0=y, yp0=yp, idata=idata, rdata=rdata)

    def history_for(self, problem: DAEProblem, method: str, tol: float) -> History | None:
        """Return the history if a run of a problem, as assembled at ``t_model``, may go on with it, else None.

        Its last step may end after ``t``. So it is of no use to another integrator, nor to other equations. Nor is it
        to a tighter run: its points are off by their own tolerance, from one to the next, which no shorter step makes
        smaller.

        Parameters
        ----------
        problem : DAEProblem
        method : str
        tol : float
            Of the run.
        """
        history = self.history
        if history is None or not self.is_own or history.method != method or history.equations != equations_of(problem):
            return None
        if history.tol > tol:
            return None
        return history

    @property
    def is_own(self) -> bool:
        """Whether time, unknowns and rates are those that the history belongs to."""
        if "y" not in self.__dict__:
            # nobody has seen them yet
            return True
        return self.told == (self.t, self.y.tobytes(), self.yp.tobytes())

    def check(self, problem: DAEProblem) -> None:
        """Raise a ModelError that names what differs if this is no state of a problem."""
        same = "take the model, formulation= and lump= of the run that it is from"
        for k, (own, other) in enumerate(zip(self.names, problem.names, strict=False)):
            if own != other:
                raise ModelError(f"state: its unknown {k} is {own!r}, that of the model {other!r}; {same}")
        if len(self.y) != problem.n:
            longer = self.names if len(self.y) > problem.n else tuple(problem.names)
            first = min(len(self.y), problem.n)
            extra = f", of which {longer[first]!r} is the first that the other lacks" if len(longer) > first else ""
            raise ModelError(f"state: it has {len(self.y)} unknowns, the model {problem.n}{extra}; {same}")
        sizes = len(problem.idata), len(problem.rdata)
        if self.sizes != sizes:
            raise ModelError(
                f"state: the tables of its model have {self.sizes[0]} integers and {self.sizes[1]} numbers, those of "
                f"this one {sizes[0]} and {sizes[1]}: markers, functions or elements were added or removed; {same}"
            )

    def without_history(self) -> State:
        """Return the state alone, from which a run starts afresh."""
        return replace(self, y=self.y.copy(), yp=self.yp.copy(), history=None)

    def changed(self, values: Mapping[str, float]) -> State:
        """Return the state with other initial values, from which a run starts afresh.

        Parameters
        ----------
        values : mapping of str to float
            Unknowns by their names, SI: positions, velocities and states of a mechanism, from which momenta,
            multipliers and loads follow. Values that leave constraints open by more than a little are refused by
            whoever starts from it: `Simulator.restore`, ``initial=``.

        Raises
        ------
        ModelError
            For a name that is not there or of something that follows, and a value that is no finite number.
        """
        if not isinstance(values, Mapping):
            raise ModelError(f"state: changed is given {values!r}; give a mapping from names of unknowns to values")
        y = self.y.copy()
        for name, value in values.items():
            if str(name).startswith(FOLLOWING):
                raise ModelError(
                    f"state: {name!r} follows from positions and velocities; give these (R, theta, u, eps)"
                )
            if not isinstance(value, Real) or isinstance(value, bool) or not np.isfinite(value):
                raise ModelError(f"state: {name!r} = {value!r}; give a finite number in SI")
            y[self._place(name)] = value
        return replace(self, y=y, yp=self.yp.copy(), history=None)

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise ModelError(f"state: there is no unknown {name!r}; {did_you_mean(name, self.names, otherwise=SEE)}")
        return self.names.index(name)

    def __getitem__(self, name: str) -> float:
        """Return an unknown by its name in ``names``."""
        try:
            return float(self.y[self._place(name)])
        except ModelError as error:
            raise KeyError(str(error)) from None

    def __repr__(self) -> str:
        told = f"with the history of {self.history.method}" if self.history is not None else "without history"
        return f"State(t = {self.t:.9g} s, {len(self.y)} unknowns, {told})"

    # --- files --------------------------------------------------------------------------------------

    def save(self, path: str | Path) -> Path:
        """Write the state as an ``.npz`` file that appears under its name only when it is whole; return its path.

        Raises
        ------
        ModelError
            If the name does not end in ``.npz``, or is none.
        """
        path = path_of(path, "state: save")
        if path.suffix != ".npz":
            raise ModelError(f"path is {str(path)!r}; a state is saved as .npz")
        arrays: dict[str, Any] = {
            "format": np.int64(FORMAT),
            "times": np.array([self.t, self.t_model]),
            "y": self.y,
            "yp": self.yp,
            "names": np.array(self.names, dtype=np.str_),
            "sizes": np.array(self.sizes, dtype=np.int64),
        }
        for name, (places, values) in (("integers", self.integers), ("reals", self.reals)):
            arrays |= {f"{name} at": places.astype(np.int64), name: values}
        if self.history is not None:
            arrays |= {"method": np.array(self.history.method), "equations": np.array(self.history.equations)}
            arrays |= {f"history {name}": values for name, values in self.history.numbers.items()}
            arrays["tol"] = np.float64(self.history.tol)
        for name, memory in self.controllers.items():
            arrays |= {f"schedule {name}": memory.schedule, f"memory {name}": memory.numbers}
        with whole_file(path) as part, open(part, "wb") as file:
            np.savez(file, **arrays, digest=_digest(arrays))
        return path

    @classmethod
    def load(cls, path: str | Path) -> State:
        """Return the state in a file.

        Raises
        ------
        ModelError
            If the file holds no state, or one of another format.
        FileNotFoundError
            If there is none.
        """
        if path_of(path, "state: load").is_dir():
            raise ModelError(f"{path}: it is a folder; give the file in it that State.save wrote")
        if Path(path).is_file() and not zipfile.is_zipfile(path):
            raise ModelError(
                f"{path}: not a whole file of a state, as State.save writes it (it is no .npz, or cut off)"
            )
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            form = int(arrays["format"])
            if form != FORMAT:
                raise ModelError(f"{path}: a state of format {form}, this version reads {FORMAT}; save it anew")
            digest = arrays.pop("digest")
            if not np.array_equal(digest, _digest(arrays)):
                raise ValueError("its numbers are not those that were saved")
            t, t_model = map(float, arrays["times"])
            integers, reals = ((arrays[f"{name} at"], arrays[name]) for name in ("integers", "reals"))
            sizes = int(arrays["sizes"][0]), int(arrays["sizes"][1])
            for (places, values), size in zip((integers, reals), sizes, strict=True):
                if len(places) != len(values) or (len(places) and not 0 <= places.min() <= places.max() < size):
                    raise ValueError("places lie outside the tables")
            history = None
            if "method" in arrays:
                head = "history "
                numbers = {name.removeprefix(head): a for name, a in arrays.items() if name.startswith(head)}
                tol = float(arrays.get("tol", 0.0))
                history = History(str(arrays["method"]), numbers, equations=str(arrays["equations"]), tol=tol)
            names = tuple(map(str, arrays["names"]))
            inputs = [name.removeprefix("memory ") for name in arrays if name.startswith("memory ")]
            held = {name: Memory(arrays[f"schedule {name}"], arrays[f"memory {name}"]) for name in inputs}
            y, yp = arrays["y"], arrays["yp"]
            told = t, y.tobytes(), yp.tobytes()
            return cls(t, y, yp, names, t_model, sizes, integers, reals, history, held, told)
        except (ModelError, OSError):
            raise
        except Exception as error:  # whatever zip and numpy meet in an archive that is damaged
            why = f"it has no {error}" if isinstance(error, KeyError) else str(error)
            raise ModelError(f"{path}: not a whole file of a state, as State.save writes it ({why})") from None


__all__ = ["History", "Memory", "State"]


def path_of(path: Any, label: str) -> Path:
    """Return a path; raise a ModelError for what is none."""
    try:
        return Path(path)
    except TypeError:
        raise ModelError(f"{label}: the path is {path!r}; give the name of a file") from None


def check_state(label: str, state: Any) -> None:
    """Raise a ModelError if something is no State."""
    if not isinstance(state, State):
        told = repr(state)
        # a mechanism tells itself in many lines
        told = told if len(told) < LONGEST and "\n" not in told else f"a {type(state).__name__}"
        remedy = "take its state_at(t)" if hasattr(state, "state_at") else "read a file with gearmbs.State.load"
        raise ModelError(f"{label}: {told} is no State; {remedy}")
