"""What a mechanism holds by name beside bodies, joints and forces: inputs, parameters, outputs, states, tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.expressions import SplineData
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.language.user_functions import UserFunction
from gearmbs.mechanism.load_methods import Expression
from gearmbs.mechanism.parts.elements import State
from gearmbs.mechanism.parts.inputs import Input, Output, Parameter, make_input, make_output, make_parameter
from gearmbs.mechanism.parts.quantities import quantity


class ValueMethods:
    """The part of :class:`gearmbs.mechanism.Mechanism` that adds inputs, outputs, states and expressions."""

    inputs: dict[str, Input]
    parameters: dict[str, Parameter]
    outputs: dict[str, Output]
    variables: dict[Any, str]
    states: dict[Any, State]
    splines: dict[Any, SplineData]
    arrays: dict[Any, tuple[float, ...]]
    functions: dict[str, UserFunction]
    aliases: dict[str, str]

    def input(self, name: str, unit: str, value: float = 0.0) -> Input:
        """Add an input: a number with a name that is set from outside while a simulation goes on.

        What is returned is a function of time for torques and motions; expressions use the name, in quotes if it holds
        other characters than letters, digits, dot and underscore. `gearmbs.Simulator.set` gives it another value.

        Parameters
        ----------
        name : str
            In expressions capitals do not matter.
        unit : str
            Of SI, "N m", or a dimension, "torque".
        value : float or str
            Until it is set, SI or text with a unit.

        Raises
        ------
        ModelError
            For a name that is in use or a unit that is none of SI.

        Examples
        --------
        >>> from gearmbs.mechanism import Mechanism
        >>> m = Mechanism("disc")
        >>> disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
        >>> pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
        >>> m.torque("drive", disc, m.input("load", "N m", 4.0))
        Torque('drive', Input('load', 4 N m) N m on 'disc' about z of 'drive.J')
        """
        made = make_input(name, unit, value)
        self._check_number(name, "input")
        self.inputs[name] = made
        return made

    def parameter(self, name: str, unit: str, value: float) -> Parameter:
        """Add a number with a name that expressions use and `gearmbs.Simulator.set` changes; as :meth:`input`."""
        made = make_parameter(name, unit, value)
        self._check_number(name, "parameter")
        self.parameters[name] = made
        return made

    def output(self, name: str, what: str | Sequence[Any]) -> Output:
        """Add an output: a name for something that solutions, `gearmbs.Simulator.get` and plants tell.

        Parameters
        ----------
        name : str
        what : str or sequence
            An expression in the function language, accelerations included; or what is asked for, of what, and which
            component: ``("reaction", "pin", "fz")``, ``("angular_velocity", "disc", "z")``, ``("joint_angle", "pin")``,
            ``("transmission_error", "mesh")``. A component is "x", "y" or "z" of vectors, "fx" .. "tz" of
            reactions and loads; without one all of them are told.

        Raises
        ------
        ModelError
            For a name that is in use, an expression that cannot be read, and what no solution or plant tells.

        Examples
        --------
        >>> from gearmbs.mechanism import Mechanism
        >>> m = Mechanism("disc")
        >>> disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0), angular_velocity=(0, 0, 3.0))
        >>> pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
        >>> m.output("speed", ("angular_velocity", "disc", "z"))
        Output('speed', ('angular_velocity', 'disc', 'z'))
        >>> round(float(m.simulate(1.0).output("speed")[-1]), 6)
        3.0
        """
        from gearmbs.mechanism.solve.told import check_told

        made = make_output(name, what)
        check_told(made)
        self._check_number(name, "output")
        self.outputs[name] = made
        return made

    def variable(self, name: str, expression: Expression) -> None:
        """Name an expression; others use it as VARVAL(name)."""
        self.variables[name] = str(expression)

    def differential_state(self, name: str, expression: Expression, start: float = 0.0) -> State:
        """Add a state with z' = expression; others use it as DIF(name)."""
        value = quantity(start, "dimensionless", f"state '{name}': start")
        self.states[name] = State(name, str(expression), value)
        return self.states[name]

    def function(
        self, name: str, function: Callable, partials: Callable | None = None, count: int | None = None
    ) -> UserFunction:
        """Let expressions call a Python function of numbers by a name of its own, for instance ``SPRING(DX(a, b))``.

        The function is called at every evaluation, some microseconds a time, and should be smooth; its derivatives are
        made by differences unless ``partials`` returns them. In constraints it may have sixteen arguments.

        Parameters
        ----------
        name : str
            Letters, digits and underscores; not that of a function that expressions have.
        function, partials, count
            See `gearmbs.mechanism.language.user_functions.UserFunction`.

        Raises
        ------
        ModelError
            If the name is taken or none.
        """
        from gearmbs.mechanism.language.library import known_functions

        key = name.upper()
        if not name.isidentifier() or key in self.functions or key in known_functions():
            taken = "taken" if name.isidentifier() else "no name of letters, digits and underscores"
            raise ModelError(f"function '{name}': the name is {taken}; choose another")
        self.functions[key] = UserFunction(name, function, partials, count)
        return self.functions[key]

    def algebraic_state(self, name: str, expression: Expression) -> State:
        """Add a state z = expression, whose values are kept with the solution and at which a simulation may stop."""
        self.states[name] = State(name, str(expression), algebraic=True)
        return self.states[name]

    def spline(self, name: str, x: npt.ArrayLike, y: npt.ArrayLike) -> None:
        """Name a table of points for CUBSPL and AKISPL."""
        points = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        self.splines[name] = SplineData(*points)  # type: ignore[arg-type]

    def array(self, name: str, numbers: npt.ArrayLike) -> None:
        """Name a list of numbers; expressions use them as ARYVAL(name, position), counted from 1."""
        self.arrays[name] = tuple(float(v) for v in np.asarray(numbers, dtype=float).ravel())

    def _take_inputs(self, *values: Any) -> None:
        """Let inputs that were made elsewhere, alone or in tuples, be among those of the mechanism."""
        for value in values:
            for one in value if isinstance(value, tuple) else (value,):
                if isinstance(one, Input) and one.order == 0 and one.name not in self.inputs:
                    self._check_number(one.name, "input")
                    self.inputs[one.name] = one

    def _check_number(self, name: str, what: str) -> None:
        tables: dict[str, Mapping[str, Any]] = {"input": self.inputs, "parameter": self.parameters}
        for title, table in {**tables, "output": self.outputs}.items():
            taken = next((one for one in table if one.upper() == name.upper()), None)
            if taken is not None:
                raise ModelError(f"{what} {name!r}: one of its {title}s is called {taken!r}; choose another")
        if what != "output" and name in self.aliases:
            raise ModelError(f"{what} {name!r}: {self.aliases[name]!r} goes by that name, too; choose another")
