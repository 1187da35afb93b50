"""FMUs of other programs in a simulation: as controllers, drives and forces that set its inputs.

An FMU for Co-Simulation is a sampled system. At a sample it has gone on from the one before with the inputs of then
held, is told those of now, and its outputs set inputs of the simulator until the next sample:

    x_k = step(x_{k-1}, u_{k-1}, T),   y_k = output(x_k, u_k),   u_{k} read from the simulation at t_k.

All its outputs are those of one u_k, read before any of them sets an input. It is initialised with u_0.
"""

from __future__ import annotations

import shutil
import tempfile
import weakref
import xml.etree.ElementTree as xml
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.units import powers_of, to_si
from gearmbs.wording import did_you_mean, warn

if TYPE_CHECKING:
    from gearmbs.mechanism import Simulator

Source = float | str | tuple[Any, ...] | Callable[[float, Any], float]
"""What an input of an FMU follows: a number, the name of an output, what `Simulator.get` takes, or a function."""

PLAIN = ("1", "-")
"""Units of numbers without one."""
REAL = ("Real", "Float64", "Float32")
"""Types of variables that can be connected."""
SLACK = 1e-3
"""Part of a sample time within which a step is a whole one: samples are multiples of it but for rounding, of the
shortest that there may be some 2e-4."""
KINDS = {
    "Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean", "String": "String",
    "Float64": "Float64", "Float32": "Float32", "Int32": "Int32", "Int64": "Int64", "UInt32": "UInt32",
}  # fmt: skip
"""What the functions that set a type of variables are called by."""


class ForeignFMU:
    """An FMU for Co-Simulation, version 2.0 or 3.0, whose outputs set inputs of a `gearmbs.Simulator`.

    Parameters
    ----------
    path : str or Path
        Of the FMU. Its binary for this system is run in this process: use those whose makers you trust.
    inputs : mapping of str to float, str, tuple or callable
        What inputs of the FMU follow, by their names: a number; the name of an output of the model; what
        :meth:`gearmbs.Simulator.get` takes, as ``("angular_velocity", "disc")``, with a component "x", "y" or "z"
        behind where that is a vector; or a function of the time and the simulator. In SI units: they are brought to the
        units that the FMU states, and its outputs from them.
    start : mapping of str to float, optional
        Values of parameters and start values, in the FMU's own units.

    Raises
    ------
    ModelError
        If FMPy is not installed, the file is no FMU for Co-Simulation, has no binary for this system or no such
        variables, or does not start.

    See Also
    --------
    gearmbs.native.export : Models as FMUs.
    """

    def __init__(
        self, path: str | Path, inputs: Mapping[str, Source] | None = None, *, start: Mapping[str, Any] | None = None
    ) -> None:
        fmpy = _fmpy()
        file = Path(path)
        self.name = file.name
        if not file.is_file():
            raise ModelError(f"{file}: there is no such file; give the path of an FMU")
        folder = tempfile.mkdtemp(prefix="gearmbs-fmu-")
        # the folder goes when nobody has the FMU any more, also at the end of the program
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        try:
            self._told = fmpy.read_model_description(str(file))
            fmpy.extract(str(file), unzipdir=folder)
        except Exception as error:
            raise ModelError(f"{self.name}: it cannot be read as an FMU: {error}") from None
        able = self._told.coSimulation
        if able is None:
            raise ModelError(f"{self.name}: it is no FMU for Co-Simulation; export it for that")
        self.version = str(self._told.fmiVersion)
        self._second = self.version.startswith("2")
        if not (self._second or self.version.startswith("3")):
            raise ModelError(f"{self.name}: it is of FMI {self.version}; export it by 2.0 or 3.0")
        self._variables = {variable.name: variable for variable in self._told.modelVariables}
        self._units = {unit.name: unit for unit in self._told.unitDefinitions}
        self._relative = _stated_differences(Path(folder, "modelDescription.xml"))
        self._sources = dict(inputs or {})
        for name in self._sources:
            self._check(name, "input", self.inputs)
        self._start = dict(start or {})
        for name in self._start:
            self._check(name, "variable", list(self._variables))
        self._folder, self._able = folder, able
        self._fmu: Any = None
        self._t = self._period = 0.0
        # whether it waits in initialisation for its first inputs; shared with what ends it
        self._phase = {"waits": False}
        # only where an FMU can: the simulator asks by these whether its controllers remember
        saved = able.canGetAndSetFMUstate and able.canSerializeFMUstate
        if saved:
            self.state, self.restore = self._state, self._restore
        self._rolled_back = saved

    @property
    def inputs(self) -> list[str]:
        """Names of the inputs that are real numbers."""
        return self._named("input")

    @property
    def outputs(self) -> list[str]:
        """Names of the outputs that are real numbers."""
        return self._named("output")

    @property
    def parameters(self) -> list[str]:
        """Names of the parameters."""
        return [name for name, one in self._variables.items() if one.causality == "parameter"]

    def control(self, simulator: Simulator, outputs: Mapping[str, str], sample_time: Any) -> None:
        """Let outputs of the FMU set inputs of a simulator at sample times, from its present time on.

        Parameters
        ----------
        simulator : Simulator
        outputs : mapping of str to str
            Outputs of the FMU by the names of the inputs and parameters that they set.
        sample_time : float or str
            s; the communication step of the FMU.

        Raises
        ------
        ModelError
            For names that are not there, and as :meth:`gearmbs.Simulator.control` does.

        Notes
        -----
        Inputs are read before any output sets one. If the FMU can save its state, it is in the simulator's: ``restore``
        takes both back. Where it does not go back, as from a state taken before, its next sample is refused.
        """
        if not outputs:
            raise ModelError(f"{self.name}: outputs is empty; give outputs of it by the names of inputs that they set")
        for name, output in outputs.items():
            self._check(output, "output", self.outputs)
            simulator.number(name)
        for name in (*self._sources, *outputs.values()):
            self._unit(name, told=True)
        first = next(iter(outputs))
        begun = self._told.defaultExperiment.startTime if self._told.defaultExperiment is not None else None
        # one that takes over from a state is started where it was made for: its time comes with its state
        taken_over = first in simulator.awaited and hasattr(self, "state")
        self._period = to_si(sample_time, "time", "sample_time")
        self._begin(float(begun or 0.0) if taken_over else simulator.t, taken_over)
        lead = _First(self, list(outputs.values()))
        setters: list[_First | _Next] = [lead, *(_Next(lead, k) for k in range(1, len(outputs)))]
        for name, one in zip(outputs, setters, strict=True):
            simulator.control(name, one if self._rolled_back else one.value, sample_time)

    def _named(self, causality: str) -> list[str]:
        # arrays are none of them
        known = self._variables.items()
        return [n for n, one in known if one.causality == causality and one.type in REAL and not one.dimensions]

    def _check(self, name: str, what: str, known: list[str]) -> None:
        if name not in known:
            meant = did_you_mean(name, known, otherwise=f"it has {', '.join(known) or 'none'}")
            raise ModelError(f"{self.name}: there is no {what} {name!r}; {meant}")

    def _begin(self, t: float, taken_over: bool) -> None:
        """Let the FMU begin at a time: it waits for its first inputs, unless its state is that of another one."""
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        if self._fmu is not None:
            raise ModelError(f"{self.name}: it runs in a simulation already; make another ForeignFMU for this one")
        kind = FMU2Slave if self._second else FMU3Slave
        try:
            made = kind(
                guid=self._told.guid,
                unzipDirectory=self._folder,
                modelIdentifier=self._able.modelIdentifier,
                instanceName="fmu",
            )
            made.instantiate()
            self._initialise(made, t)
            if taken_over:
                made.exitInitializationMode()
        except Exception as error:
            raise ModelError(f"{self.name}: it does not start at t = {t:g} s: {error}") from None
        self._fmu, self._t, self._phase["waits"] = made, t, not taken_over
        weakref.finalize(self, _end, made, self._phase)

    def _initialise(self, made: Any, t: float) -> None:
        """Bring a fresh instance to its initialisation at a time, with its start values."""
        self._put(made, self._start)
        if self._second:
            made.setupExperiment(startTime=t)
            made.enterInitializationMode()
        else:
            made.enterInitializationMode(startTime=t)

    def _put(self, fmu: Any, values: Mapping[str, Any]) -> None:
        """Set variables of any type, in their own units."""
        for name, value in values.items():
            variable = self._variables[name]
            getattr(fmu, f"set{KINDS[variable.type]}")([variable.valueReference], [value])

    def _unit(self, name: str, told: bool = False) -> tuple[float, float]:
        """Return the SI value of a variable's unit, and of its zero; let a unit that is not known be told."""
        variable = self._variables[name]
        declared = variable.declaredType
        unit = variable.unit or (declared.unit if declared is not None else None)
        defined = self._units.get(unit)
        if defined is not None and defined.baseUnit is not None:
            # differences, as of temperatures, have no zero of their own
            relative = self._relative.get(name, declared is not None and declared.relativeQuantity)
            return float(defined.baseUnit.factor), 0.0 if relative else float(defined.baseUnit.offset)
        known = powers_of(unit.replace(".", " ")) if unit else None
        if told and unit and known is None and unit not in PLAIN:
            warn(
                f"{self.name}: it does not say what the unit {unit!r} of {name!r} is in SI units, so it counts as one "
                "of them; convert in a function or a gain, or export it with its units"
            )
        return (1.0 if known is None else known[0]), 0.0

    def _follow(self, name: str, source: Source, t: float, simulator: Simulator) -> float:
        """Return the present value of what an input follows, in the FMU's unit."""
        if callable(source):
            value = source(t, simulator)
        elif isinstance(source, str):
            value = simulator.get("output", source)
        elif isinstance(source, tuple):
            *asked, last = source
            part = "xyz".find(last) if len(asked) > 1 and isinstance(last, str) and len(last) == 1 else -1
            value = np.asarray(simulator.get(*asked))[part] if part >= 0 else simulator.get(*source)
        else:
            value = source
        found = np.asarray(value, dtype=float)
        if found.ndim or not np.isfinite(found):
            raise ModelError(
                f"{self.name}: its input {name!r} follows {source!r}, which is {value!r} at t = {t:.6g} s; it must be "
                "one finite number, of vectors a component"
            )
        factor, offset = self._unit(name)
        return (float(found) - offset) / factor

    def _sample(self, t: float, simulator: Simulator, outputs: list[str]) -> list[float]:
        """Go on to a time with the inputs of the last sample held, tell the FMU those of now; return outputs, SI."""
        if self._phase["waits"] and t != self._t:
            self._again(t)
        elif not self._phase["waits"]:
            self._step(t)
        # read before any output sets an input: all outputs are those of the same inputs
        values = {name: self._follow(name, source, t, simulator) for name, source in self._sources.items()}
        try:
            self._put(self._fmu, values)
            if self._phase["waits"]:
                self._fmu.exitInitializationMode()
                self._phase["waits"] = False
        except Exception as error:
            raise ModelError(f"{self.name}: it does not take its inputs at t = {t:.6g} s: {error}") from None
        return [self._told_of(name) for name in outputs]

    def _step(self, t: float) -> None:
        """Make the step to the next sample."""
        size = t - self._t
        if not -SLACK * self._period <= size <= (1.0 + SLACK) * self._period:
            raise ModelError(
                f"{self.name}: it stands at t = {self._t:.6g} s, the simulation at {t:.6g} s, and it was not in the "
                "state gone on from; take states after control(...), with the same sample_time, of an FMU that can "
                "save its own, or make a new simulator and a new ForeignFMU"
            )
        if size <= SLACK * self._period:
            return
        try:
            # a simulator may go back behind the present time if the FMU can
            told = self._fmu.doStep(self._t, size, not self._rolled_back)
        except Exception as error:
            raise ModelError(f"{self.name}: its step from t = {self._t:.6g} to {t:.6g} s failed: {error}") from None
        if told is not None and told[1]:
            raise ModelError(f"{self.name}: it asks to end the simulation at t = {t:.6g} s; let t_end be earlier")
        self._t = t

    def _again(self, t: float) -> None:
        """Let the FMU begin anew, at a time."""
        try:
            self._fmu.reset()
            self._initialise(self._fmu, t)
        except Exception as error:
            raise ModelError(f"{self.name}: it does not start at t = {t:g} s: {error}") from None
        self._t, self._phase["waits"] = t, True

    def _told_of(self, name: str) -> float:
        """Return an output in SI units."""
        variable = self._variables[name]
        take = getattr(self._fmu, f"get{KINDS[variable.type]}")
        factor, offset = self._unit(name)
        return float(take([variable.valueReference])[0]) * factor + offset

    def _state(self) -> list[float]:
        """Return the time and the bytes of the FMU's state, as numbers; before its first sample the time alone."""
        if self._phase["waits"]:
            return [self._t]
        take, pack, free = (
            (self._fmu.getFMUstate, self._fmu.serializeFMUstate, self._fmu.freeFMUstate)
            if self._second
            else (self._fmu.getFMUState, self._fmu.serializeFMUState, self._fmu.freeFMUState)
        )
        kept = take()
        try:
            return [self._t, *pack(kept)]
        finally:
            free(kept)

    def _restore(self, numbers: np.ndarray) -> None:
        if len(numbers) == 1:
            self._again(float(numbers[0]))
            return
        data = bytes(numbers[1:].astype(np.uint8))
        unpack, put, free = (
            (self._fmu.deSerializeFMUstate, self._fmu.setFMUstate, self._fmu.freeFMUstate)
            if self._second
            else (self._fmu.deserializeFMUState, self._fmu.setFMUState, self._fmu.freeFMUState)
        )
        kept = unpack(data)
        try:
            if self._phase["waits"]:
                self._fmu.exitInitializationMode()
            put(kept)
            self._t, self._phase["waits"] = float(numbers[0]), False
        finally:
            free(kept)


class _First:
    """What sets the first input of a simulator: it samples the FMU, whose state is with it in that of the simulator."""

    def __init__(self, fmu: ForeignFMU, outputs: list[str]) -> None:
        self._fmu, self._outputs, self.values = fmu, outputs, [float("nan")] * len(outputs)
        if hasattr(fmu, "state"):
            self.state, self.restore = fmu.state, fmu.restore

    def __call__(self, t: float, simulator: Any) -> float:
        return self.value(t, simulator)

    def value(self, t: float, simulator: Any) -> float:
        """Return the first output of a sample that is made."""
        self.values = self._fmu._sample(t, simulator, self._outputs)
        return self.values[0]


class _Next:
    """What sets another input: to what the same sample gave. In states it has its sample times alone."""

    def __init__(self, first: _First, place: int) -> None:
        self._first, self._place = first, place

    def __call__(self, t: float, simulator: Any) -> float:
        return self.value(t, simulator)

    def value(self, t: float, simulator: Any) -> float:
        """Return what the sample gave that the first input has made."""
        return self._first.values[self._place]

    def state(self) -> list[float]:
        return []

    def restore(self, numbers: np.ndarray) -> None:
        """The FMU goes back with the first input."""


def _stated_differences(description: Path) -> dict[str, bool]:
    """Return of each variable that says so whether it is a difference, which FMPy does not tell."""
    found = {}
    for variable in xml.parse(description).getroot().iterfind("ModelVariables/*"):
        # of FMI 2.0 it stands in the element of the type
        for element in (variable, *variable):
            if "relativeQuantity" in element.attrib:
                found[variable.get("name", "")] = element.get("relativeQuantity") in ("true", "1")
    return found


def _end(fmu: Any, phase: Mapping[str, bool]) -> None:
    """End an FMU that nobody has any more."""
    if not phase["waits"]:
        fmu.terminate()
    fmu.freeInstance()


def _fmpy() -> Any:
    try:
        import fmpy
    except ImportError:
        raise ModelError("FMUs of other programs are run with FMPy; install it: pip install 'gearmbs[fmu]'") from None
    return fmpy
