"""What a deck's run gives: requests over time, parts' motion, messages, files."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.adams import statements as st
from gearmbs.adams.build import AdamsModel
from gearmbs.adams.commands import Script, Simulate
from gearmbs.adams.deck import Deck
from gearmbs.adams.requests import RequestSeries
from gearmbs.adams.units import RESULT_NAMES, unit_names
from gearmbs.dae.modes import Modes
from gearmbs.dae.solution import Solution

if TYPE_CHECKING:
    import xarray as xr


@dataclass
class Segment:
    """One SIMULATE command's outcome.

    Attributes
    ----------
    command : Simulate
    kind : str
    model : AdamsModel
    solution : Solution
        SI values.
    options : dict
        What the integrator was given.
    note : str or None
    requests : dict of int to RequestSeries
        Values in the deck's units.
    wrenches : dict
        (kind, id) -> force and torque on the I side, global components, SI, shape (m, 6).
    """

    command: Simulate
    kind: str
    model: AdamsModel
    solution: Solution
    options: dict[str, Any]
    note: str | None = None
    requests: dict[int, RequestSeries] = field(default_factory=dict)
    wrenches: dict[tuple[str, int], np.ndarray] = field(default_factory=dict)

    @property
    def success(self) -> bool:
        """True when the analysis reached its end."""
        return self.solution.success


@dataclass
class AdamsResult:
    """All analyses of a run, one after the other.

    Attributes
    ----------
    deck : Deck
    script : Script
    segments : list of Segment
    modes : list of Modes
        Of each LINEAR/EIGENSOL, in rad/s and Hz.
    """

    deck: Deck
    script: Script
    segments: list[Segment] = field(default_factory=list)
    modes: list[Modes] = field(default_factory=list)

    @property
    def success(self) -> bool:
        """True when every analysis reached its end."""
        return all(s.success for s in self.segments)

    @property
    def messages(self) -> list[str]:
        """What was left out, ignored or went wrong, one sentence each."""
        found = [str(d) for d in (*self.deck.diagnostics, *self.script.diagnostics)]
        for segment in self.segments:
            if segment.note:
                found.append(segment.note)
            if not segment.success:
                found.append(segment.solution.message)
        return found

    @cached_property
    def t(self) -> np.ndarray:
        """Output times in the deck's unit; where one analysis follows another the time stands twice."""
        scale = self.deck.units.time
        return np.concatenate([s.solution.t / scale for s in self.segments] or [np.zeros(0)])

    def request(self, number: int) -> np.ndarray:
        """Return the eight columns of REQUEST/number, shape (m, 8), deck units and radians.

        Raises
        ------
        KeyError
            If there is no such request.
        """
        if number not in self.deck.of(st.Request):
            known = ", ".join(str(k) for k in self.deck.of(st.Request))
            raise KeyError(f"there is no REQUEST/{number}; the deck has {known or 'none'}")
        return np.concatenate([s.requests[number].values for s in self.segments] or [np.zeros((0, 8))])

    def part(self, number: int) -> np.ndarray:
        """Return position and velocity, angles and rates of a part's frame, shape (m, 18), deck units and radians.

        Columns: X Y Z PSI THETA PHI VX VY VZ WX WY WZ ACCX ACCY ACCZ WDX WDY WDZ.
        """
        return np.concatenate([part_motion(s, number) for s in self.segments])

    def unit(self, dimension: str) -> str:
        """Return how result files spell the unit of a dimension."""
        names = unit_names(self.deck.only(st.Units))
        spelled = {q: RESULT_NAMES.get(n, n.lower()) or "no_units" for q, n in names.items()}
        length, time, force = spelled["length"], spelled["time"], spelled["force"]
        return {
            "time": time,
            "length": length,
            "angle": "rad",
            "velocity": f"{length}/{time}",
            "angular_velocity": f"rad/{time}",
            "acceleration": f"{length}/{time}**2",
            "angular_acceleration": f"rad/{time}**2",
            "force": force,
            "torque": f"{force}-{length}",
            "mass": spelled["mass"],
        }.get(dimension, "no_units")

    def to_dataset(self) -> xr.Dataset:
        """Return requests and parts as an :class:`xarray.Dataset`, deck units in the attributes."""
        import xarray as xr

        data: dict[str, Any] = {}
        for number, request in self.deck.of(st.Request).items():
            series = self.segments[0].requests[number] if self.segments else None
            attributes = {
                "long_name": request.comment or request.name or request.label(),
                "columns": " ".join(series.names) if series else "",
            }
            data[f"request_{number}"] = (("time", "column"), self.request(number), attributes)
        for number, part in self.deck.of(st.Part).items():
            if not part.ground and self.segments:
                attributes = {"long_name": part.name or part.label(), "columns": " ".join(PART_COLUMNS)}
                data[f"part_{number}"] = (("time", "state"), self.part(number), attributes)
        coords = {"time": ("time", self.t, {"units": self.unit("time")})}
        out = xr.Dataset(data, coords=coords)
        out.attrs["title"] = self.deck.title
        out.attrs["units"] = ", ".join(f"{d}: {self.unit(d)}" for d in ("length", "mass", "time", "force", "angle"))
        return out

    def write(self, prefix: str | Path) -> list[Path]:
        """Write .req, .res, .msg and .nc files.

        Parameters
        ----------
        prefix : path
            File name without extension; its directory is made when it does not exist.

        Returns
        -------
        list of Path
        """
        from gearmbs.adams.msg import message_text
        from gearmbs.adams.req import request_text
        from gearmbs.adams.res import results_text

        prefix = Path(prefix)
        prefix.parent.mkdir(parents=True, exist_ok=True)
        files = []
        for suffix, text in ((".req", request_text(self)), (".res", results_text(self)), (".msg", message_text(self))):
            path = prefix.with_name(prefix.name + suffix)
            path.write_text(text, encoding="utf-8", newline="\n")
            files.append(path)
        path = prefix.with_name(prefix.name + ".nc")
        self.to_dataset().to_netcdf(path, engine="h5netcdf")
        return [*files, path]

    def __repr__(self) -> str:
        span = f"{self.t[0]:g} to {self.t[-1]:g}" if self.t.size else "nothing simulated"
        return f"AdamsResult({self.deck.title!r}: {len(self.segments)} analyses, {self.t.size} times, {span})"


PART_COLUMNS = tuple("X Y Z PSI THETA PHI VX VY VZ WX WY WZ ACCX ACCY ACCZ WDX WDY WDZ".split())
PART_DIMENSIONS = (
    ("length",) * 3
    + ("angle",) * 3
    + ("velocity",) * 3
    + ("angular_velocity",) * 3
    + ("acceleration",) * 3
    + ("angular_acceleration",) * 3
)


def part_motion(segment: Segment, number: int) -> np.ndarray:
    """Return the 18 columns of a part's frame over an analysis, in the deck's units."""
    from gearmbs.dae.rotation import euler_from_matrix

    s = segment.solution
    name = segment.model.names["part", number]
    body = segment.model.mechanism.bodies[name]
    axes = s.orientation(name)
    arm = axes @ body.com
    spin, alpha = s.angular_velocity(name), s.angular_acceleration(name)
    tip = np.cross(spin, arm)
    motion = np.hstack(
        [
            s.position(name) - arm,
            np.array([euler_from_matrix(a) for a in axes]),
            s.velocity(name) - tip,
            spin,
            s.acceleration(name) - np.cross(alpha, arm) - np.cross(spin, tip),
            alpha,
        ]
    )
    units = segment.model.deck.units
    return motion / np.array([units.factor(d) for d in PART_DIMENSIONS])
