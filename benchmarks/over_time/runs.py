"""Times, steps and harmonics of the runs that users wait for, in the form that asv reads.

Kernels are compiled in ``setup_cache``, which asv does once a commit. Times are of processor time, as asv takes
them, and compared between commits on one machine, never between machines. What is tracked beside them is no time: a
change of it is a change of the answer.
"""

from __future__ import annotations

import gearmbs as gm
from gearmbs.studies.planetary import PlanetaryRun, run_planetary

SECTIONS = {
    "healthy": {},
    "misaligned": {"fault": {"misalignment": "1 deg"}},
    "+3 mm": {"fault": {"centre_distance_error": "3 mm"}},
}


def case_of(state: str, lump: bool = False, duration: float = 0.2) -> gm.Case:
    """Return one of the paper's states at 100 N m, short."""
    operation = {"torque": "100 N m", "duration": duration}
    return gm.Case(name=state, operation=operation, solver={"lump": lump}, **SECTIONS[state])


class Cases:
    """Whole cases, from the description to the table of mesh harmonics."""

    params = (list(SECTIONS), [False, True])
    param_names = ("state", "lumped")
    timeout = 300

    def setup_cache(self) -> None:
        """Compile whatever the runs need."""
        for state in SECTIONS:
            for lump in (False, True):
                gm.run_case(case_of(state, lump, 0.02))

    def setup(self, state: str, lump: bool) -> None:
        """Make the case, and run it once: what is loaded for the first time is not measured."""
        self.case = case_of(state, lump)
        gm.run_case(self.case)

    def time_case(self, state: str, lump: bool) -> None:
        """A record of 0.2 s."""
        gm.run_case(self.case, variables=["gmf_rms"])

    def peakmem_case(self, state: str, lump: bool) -> None:
        """The same."""
        gm.run_case(self.case, variables=["gmf_rms"])

    def track_first_harmonic(self, state: str, lump: bool) -> float:
        """RMS of the first mesh harmonic along the line of action, N."""
        found = gm.run_case(self.case, variables=["gmf_rms"])["gmf_rms"]
        return float(found.sel(component="line_of_action", way="orders")[0])


class Planets:
    """Three planets with six tooth-accurate meshes."""

    timeout = 300

    def setup(self) -> None:
        """Make the set, and run it once."""
        gears = gm.planetary((24, 30, 84), "1.5 mm", 3, backlash_sun="0.05 mm", backlash_ring="0.05 mm")
        drive = {"speeds": {"carrier": "120 rpm"}, "torques": {"sun": "-11 N m"}}
        self.run = PlanetaryRun(gears, **drive, duration=0.1)
        self.time_set()

    def time_set(self) -> None:
        """A record of a tenth of a second."""
        run_planetary(self.run)


class Start:
    """What a fresh process waits for."""

    timeout = 120

    def timeraw_import(self) -> str:
        """The package, and a case read."""
        return "import gearmbs as gm; gm.make_case({})"

    def timeraw_short_run(self) -> str:
        """A pair for 0.3 s, kernels on disk."""
        return "import gearmbs as gm; gm.run_case(gm.Case(operation={'duration': 0.3}))"
