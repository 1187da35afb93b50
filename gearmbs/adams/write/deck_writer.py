"""Write a Mechanism as an .adm deck: ``write_deck``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from gearmbs.adams.parse.units import TABLES
from gearmbs.adams.write.context import COMPONENTS_OF
from gearmbs.adams.write.data import data_statements
from gearmbs.adams.write.flexible import flex_body_arguments, nearest_node
from gearmbs.adams.write.joints import constraint_statements
from gearmbs.adams.write.loads import element_statements
from gearmbs.adams.write.names import DeckNames
from gearmbs.adams.write.output import integrator_statement, request_statements
from gearmbs.adams.write.text import listed, number, wrapped
from gearmbs.dae.equations.rotation import euler_from_matrix
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.modal import ModalBody
from gearmbs.mechanism.parts import Body, Marker


def write_deck(
    mechanism: Mechanism,
    path: str | Path | None = None,
    *,
    title: str | None = None,
    output: bool = True,
    requests: Mapping[str, str | Sequence[str]] | None = None,
    integrator: str | None = None,
    formulation: str = "SI2",
    tol: float | None = None,
    max_step: float | None = None,
    gears: Literal["expressions", "solids"] = "expressions",
) -> str:
    """Write a mechanism as an .adm file, in the mechanism's units.

    Contacts of solids become GRAPHICS and CONTACTs, meshes .obj files beside the deck. Contacts of gears with parallel
    axes become GFORCEs of IMPACT expressions along both lines of action; their friction and the contact of tooth
    corners beyond the path of contact are left out, as comments say. Or they become CONTACTs of solids. Bodies that
    deform by modes become FLEX_BODYs with modal neutral files beside the deck.

    Parameters
    ----------
    mechanism : Mechanism
    path : path, optional
        File to write; without it the text is only returned.
    title : str, optional
        First line; default: the mechanism's name.
    output : bool
        Ask for the request file and the results file (OUTPUT/REQSAVE, RESULTS/XRF), with requests for the position and
        velocity of every body and the forces of all elements.
    requests : mapping of str to str or sequence of str, optional
        More requests by name: up to six expressions in the mechanism's function language.
    integrator, formulation : str, optional
        INTEGRATOR's method, GSTIFF or WSTIFF, and formulation; written when the method or one of the next is given.
    tol : float, optional
        Its ERROR.
    max_step : float, optional
        Its HMAX, s.
    gears : {"expressions", "solids"}
        ``solids``: gear contacts become CONTACTs between meshes of the wheels, in .obj files beside the deck. Comments
        hold the whole pair, so that the deck, read back here, has the exact contact again, with friction and faults.

    Returns
    -------
    str
        The deck.

    Raises
    ------
    ModelError
        Naming what cannot be written.
    """
    if gears not in ("expressions", "solids"):
        raise ModelError(f"gears = {gears!r}; choose 'expressions' or 'solids'")
    writer = DeckWriter(mechanism, path, gears)
    writer.model(title)
    request_statements(writer, requests or {}, output)
    if output:
        writer.statement("OUTPUT/REQSAVE", [])
        writer.statement("RESULTS/XRF", [])
    integrator_statement(writer, integrator, formulation, tol, max_step)
    text = "\n".join([*writer.lines, "END"]) + "\n"
    if path is not None:
        Path(path).write_text(text, encoding="utf-8", newline="\n")
    return text


class DeckWriter(DeckNames):
    """Writes the statements of a mechanism."""

    def __init__(self, mechanism: Mechanism, path: str | Path | None = None, gears: str = "expressions") -> None:
        super().__init__(mechanism, gears)
        self.path = path
        self.lines: list[str] = []
        self.centers: dict[int, int] = {}
        self._next_marker = max(self.markers.values(), default=0) + 1
        self._solids = 0

    def model(self, title: str | None) -> None:
        """Write the title and all that moves."""
        self.lines = [" ".join((title or self.mechanism.name).split()) or "mechanism", "!"]
        self._units()
        self._parts()
        constraint_statements(self)
        data_statements(self)
        for name, element in self.mechanism.elements.items():
            element_statements(self, name, element)
        g = self.mechanism.gravity / self.units.factor("acceleration")
        if np.any(g != 0.0):
            keys = ("IGRAV", "JGRAV", "KGRAV")
            self.statement("ACCGRAV/", [f"{k} = {number(v)}" for k, v in zip(keys, g) if v != 0.0])

    # --- pieces -------------------------------------------------------------------------------------

    def statement(self, head: str, arguments: Iterable[str], name: str | None = None) -> None:
        """Append a statement, one argument a line, with its name in a comment in front."""
        if name:
            self.lines.append(f"!   adams_view_name='{name}'")
        self.lines.append(head)
        for argument in arguments:
            self.lines.extend(wrapped(argument))

    def comment(self, text: str) -> None:
        """Append a comment."""
        self.lines.append(f"! {text}")

    def new_marker(self, body: Body, position: np.ndarray, axes: np.ndarray, floating: bool = False) -> int:
        """Write a marker on a body and return its id."""
        if isinstance(body, ModalBody):
            raise ModelError(
                f"body '{body.name}': a force needs a {'floating ' * floating}marker on it, and it deforms; let the "
                "force's J marker be on the other body"
            )
        number_ = self._next_marker
        self._next_marker += 1
        arguments = [f"PART = {self.bodies[id(body)]}"]
        if floating:
            arguments.append("FLOATING")
        else:
            arguments += self._frame("QP", position, axes)
        self.statement(f"MARKER/{number_}", arguments)
        return number_

    def graphics(self, arguments: Iterable[str], name: str) -> int:
        """Write a GRAPHICS and return its id."""
        self._solids += 1
        self.statement(f"GRAPHICS/{self._solids}", arguments, name)
        return self._solids

    def _frame(self, keyword: str, position: np.ndarray, axes: np.ndarray) -> list[str]:
        out = []
        if np.any(position != 0.0):
            out.append(f"{keyword} = {listed(position / self.units.length)}")
        if np.abs(axes - np.eye(3)).max() > 1e-15:
            out.append(f"REULER = {listed(euler_from_matrix(axes))}")
        return out

    # --- sections -----------------------------------------------------------------------------------

    def _units(self) -> None:
        names = []
        for quantity, table in TABLES.items():
            value = getattr(self.units, quantity)
            found = [n for n, v in table.items() if abs(v - value) <= 1e-12 * value]
            if not found:
                raise ModelError(f"units: {value} SI is no unit of {quantity} that ADAMS knows; change mechanism.units")
            names.append(f"{quantity.upper()} = {found[0]}")
        self.statement("UNITS/", names)

    def _parts(self) -> None:
        for body in (self.mechanism.ground, *self.mechanism.bodies.values()):
            n = self.bodies[id(body)]
            if body.is_ground:
                self.statement(f"PART/{n}", ["GROUND"], "ground")
            elif isinstance(body, ModalBody):
                self._flex_body(body, n)
                continue
            else:
                self._part(body, n)
            for marker in body.markers:
                arguments = [f"PART = {n}", *self._frame("QP", marker.position, marker.orientation)]
                self.statement(f"MARKER/{self.markers[id(marker)]}", arguments, marker.name)

    def _part(self, body: Body, n: int) -> None:
        units = self.units
        own = self._center(body)
        cm = self.centers[id(body)] = self.markers[id(own)] if own is not None else self._next_marker
        i = body.inertia / units.factor("inertia")
        inertia = [i[0, 0], i[1, 1], i[2, 2], -i[0, 1], -i[0, 2], -i[1, 2]]
        if not any(inertia[3:]):
            inertia = inertia[:3]
        arguments = [f"MASS = {number(body.mass / units.mass)}", f"CM = {cm}", f"IP = {listed(inertia)}"]
        self.statement(f"PART/{n}", [*arguments, *self._start(body)], body.name)
        if own is None:
            self._next_marker += 1
            self.statement(f"MARKER/{cm}", [f"PART = {n}", *self._frame("QP", body.com, np.eye(3))])

    def _start(self, body: Body) -> list[str]:
        """Return where a body starts, and the velocity of its centre of mass."""
        arm = body.orientation @ body.com
        velocity = (body.velocity + np.cross(body.angular_velocity, arm)) / self.units.factor("velocity")
        spin = body.orientation.T @ body.angular_velocity / self.units.factor("angular_velocity")
        return [
            *self._frame("QG", body.position, body.orientation),
            *(f"V{a} = {number(v)}" for a, v in zip("XYZ", velocity) if v != 0.0),
            *(f"W{a} = {number(v)}" for a, v in zip("XYZ", spin) if v != 0.0),
        ]

    def _flex_body(self, body: ModalBody, n: int) -> None:
        markers = list(body.markers)
        if not markers and body.origin is not None:
            # something has to be asked for; the mechanism does not get it
            markers = [Marker(f"{body.name}.node", body, nearest_node(body.origin.model), np.eye(3))]
            self.markers[id(markers[0])] = self._next_marker
            self._next_marker += 1
        arguments, nodes = flex_body_arguments(self, body, markers)
        self.statement(f"FLEX_BODY/{n}", [*self._start(body), *arguments], body.name)
        for marker in markers:
            own = [f"FLEX_BODY = {n}", f"NODE_ID = {nodes[id(marker)]}"]
            own += self._frame("QP", marker.position, marker.orientation)
            self.statement(f"MARKER/{self.markers[id(marker)]}", own, marker.name)
        self.centers[id(body)] = self.markers[id(markers[0])]

    @staticmethod
    def _center(body: Body) -> Marker | None:
        """Return a marker at the centre of mass along the body's axes."""
        there = (m for m in body.markers if np.array_equal(m.position, body.com))
        return next((m for m in there if np.array_equal(m.orientation, np.eye(3))), None)

    def gforce(self, name: str, i: int, jfloat: int, rm: int, given: dict[str, str], keyword: str = "GFORCE") -> None:
        """Write a GFORCE, VFORCE or VTORQUE with all its components."""
        n = self.elements[keyword.lower(), name]
        components = COMPONENTS_OF[keyword]
        arguments = [f"I = {i}", f"JFLOAT = {jfloat}", f"RM = {rm}"]
        arguments += [f"{c} = {given.get(c, '0')}" + ("\\" if c != components[-1] else "") for c in components]
        self.statement(f"{keyword}/{n}", arguments, name)
