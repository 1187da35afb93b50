"""The kinematic table of a drivetrain: speeds, and all frequencies that a record of it can be expected to hold."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any

from gearmbs.drivetrain.errors import DrivetrainError
from gearmbs.drivetrain.parts import GearMesh
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.drivetrain.drivetrain import Drivetrain

HZ = 2.0 * math.pi


class KinematicTable:
    """Speeds and frequencies of a drivetrain at its operating speed.

    With the wheels' teeth z_1, z_2 and the shafts' speeds relative to the axes' carrier (here fixed), f_m = z_1 f_1 =
    z_2 f_2; the same two teeth meet f_m gcd(z_1, z_2) / (z_1 z_2) times a second (hunting-tooth frequency). A deviation
    of a wheel on shaft i modulates its meshes: sidebands h f_m +- k f_i. Bearings: see
    `gearmbs.bearings.Bearing.multiples`, times the speed of the shaft against what carries it.

    Parameters
    ----------
    train : Drivetrain
    """

    def __init__(self, train: Drivetrain) -> None:
        self.train = train

    @property
    def speeds(self) -> dict[str, float]:
        """Speed of each shaft about its own z axis, rad/s."""
        return self.train.speeds

    def shaft_frequency(self, shaft: str) -> float:
        """Return the turns of a shaft a second, Hz, not negative."""
        return abs(self.speeds[shaft]) / HZ

    def ratio(self, first: str, second: str) -> float:
        """Return the speed of one shaft over that of another, with its sign."""
        return self.speeds[first] / self.speeds[second]

    def mesh_frequency(self, mesh: str) -> float:
        """Return the mesh frequency of a mesh, Hz."""
        driver, _ = self.train.wheels_of(mesh)
        return driver.gear.teeth * self.shaft_frequency(driver.shaft)

    def hunting_frequency(self, mesh: str) -> float:
        """Return how often a second the same two teeth of a mesh meet, Hz."""
        one, two = (wheel.gear.teeth for wheel in self.train.wheels_of(mesh))
        return self.mesh_frequency(mesh) * math.gcd(one, two) / (one * two)

    def sidebands(self, mesh: str, harmonics: int = 3, order: int = 2) -> pd.DataFrame:
        """Return the expected sidebands of a mesh: columns harmonic, shaft, order, frequency (Hz)."""
        import pandas as pd

        gmf = self.mesh_frequency(mesh)
        rows = [
            (h, wheel.shaft, k, h * gmf + k * self.shaft_frequency(wheel.shaft))
            for h in range(1, harmonics + 1)
            for wheel in self.train.wheels_of(mesh)
            for k in range(-order, order + 1)
            if k
        ]
        return pd.DataFrame(rows, columns=["harmonic", "shaft", "order", "frequency"])

    def bearing_frequencies(self, bearing: str) -> dict[str, float]:
        """Return FTF, BPFO, BPFI and BSF of a bearing with ``rolling``, Hz."""
        part = next((b for b in self.train.bearings if b.name == bearing), None)
        if part is None or part.rolling is None:
            known = [b.name for b in self.train.bearings if b.rolling is not None]
            raise DrivetrainError(
                f"bearing '{bearing}': no rolling geometry is known of it; known of {known or 'none'}"
            )
        carrier = self.speeds.get(self.train.carrier(part), 0.0)
        turns = abs(self.speeds[part.shaft] - carrier) / HZ
        return {name: multiple * turns for name, multiple in part.rolling.multiples.items()}

    def common_period(self) -> float:
        """Return the time after which all teeth of all meshes stand as before, s; infinite without meshes."""
        from fractions import Fraction

        turning = [s for s, w in self.speeds.items() if w != 0.0 and any(x.shaft == s for x in self.train.wheels)]
        if not turning:
            return math.inf
        first = turning[0]
        turns = 1
        for shaft in turning:
            share = Fraction(abs(self.ratio(shaft, first))).limit_denominator(10**7)
            turns = math.lcm(turns, share.denominator)
        return turns / self.shaft_frequency(first)

    @cached_property
    def lines(self) -> pd.DataFrame:
        """All frequencies: columns kind, of, name, frequency (Hz), multiple (of the first drive's shaft)."""
        import pandas as pd

        rows: list[tuple[str, str, str, float]] = []
        for shaft in self.train.shafts:
            rows.append(("shaft", shaft.name, "1x", self.shaft_frequency(shaft.name)))
        for mesh in self.train.meshes:
            rows.append(("mesh", mesh.name, "GMF", self.mesh_frequency(mesh.name)))
            rows.append(("mesh", mesh.name, "hunting tooth", self.hunting_frequency(mesh.name)))
        for bearing in self.train.bearings:
            if bearing.rolling is not None:
                for name, frequency in self.bearing_frequencies(bearing.name).items():
                    rows.append(("bearing", bearing.name, name, frequency))
        for load in self.train.loads:
            teeth = getattr(load, "teeth", 0)
            if teeth:
                rows.append(("load", load.name, "displacement", teeth * self.shaft_frequency(load.shaft)))
        table = pd.DataFrame(rows, columns=["kind", "of", "name", "frequency"])
        reference = self.shaft_frequency(self.train.drives[0].shaft) if self.train.drives else 0.0
        table["multiple"] = table.frequency / reference if reference else float("nan")
        return table

    def nearest(self, frequency: Quantity, harmonics: int | None = None, order: int = 2) -> tuple[str, float]:
        """Return what a line of a spectrum comes from: its name, and how far it is from there, Hz.

        Parameters
        ----------
        frequency : float or str
            Hz.
        harmonics : int, optional
            Highest harmonic of all lines; default: of meshes, bearings and pumps as many as reach the frequency, of
            shafts and hunting teeth, whose harmonics lie close everywhere, three.
        order : int
            Sidebands on either side of each mesh harmonic.

        Raises
        ------
        DrivetrainError
            For a frequency that is not finite, and where nothing turns.
        """
        frequency = to_si(frequency, "frequency", "nearest: frequency")
        if not math.isfinite(frequency):
            raise DrivetrainError(f"nearest: frequency is {frequency} Hz; give a finite one")
        known = self.known_lines(harmonics or 3, order) if len(self.lines) else {}
        if harmonics is None:
            for row in self.lines.itertuples():
                line = float(row.frequency)  # type: ignore[arg-type]
                if row.kind == "shaft" or row.name == "hunting tooth" or line <= 0.0:
                    continue
                # the harmonics on either side; sidebands reach as far as their order
                for h in {max(1, math.floor(frequency / line)), max(1, math.ceil(frequency / line))}:
                    known[f"{h} x {row.name} of {row.of}"] = h * line
                    if row.name == "GMF":
                        known |= self._sidebands(str(row.of), h, order)
        if not any(known.values()):
            raise DrivetrainError(f"drivetrain '{self.train.name}': nothing turns, so that it has no lines")
        name = min(known, key=lambda one: abs(known[one] - frequency))
        return name, frequency - known[name]

    def known_lines(self, harmonics: int = 3, order: int = 2) -> dict[str, float]:
        """Return the frequencies (Hz) of all lines and their harmonics, and of the sidebands of all meshes, by name."""
        return {name: at for lines in self.lines_by_part(harmonics, order).values() for name, at in lines.items()}

    def lines_by_part(self, harmonics: int = 3, order: int = 2) -> dict[str, dict[str, float]]:
        """Return the same by what they come from: "shaft <name>", "mesh <name>", "sidebands of <mesh>", and so on."""
        known: dict[str, dict[str, float]] = {}
        for row in self.lines.itertuples():
            part = f"hunting teeth of {row.of}" if row.name == "hunting tooth" else f"{row.kind} {row.of}"
            for h in range(1, harmonics + 1):
                name = f"{h} x {row.name} of {row.of}"
                known.setdefault(part, {})[name] = h * float(row.frequency)  # type: ignore[arg-type]
            if row.name == "GMF":
                sidebands = known.setdefault(f"sidebands of {row.of}", {})
                for h in range(1, harmonics + 1):
                    sidebands |= self._sidebands(str(row.of), h, order)
        return known

    def _sidebands(self, mesh: str, harmonic: int, order: int) -> dict[str, float]:
        """Return the sidebands of one mesh harmonic, Hz, by name."""
        gmf = harmonic * self.mesh_frequency(mesh)
        return {
            f"{harmonic} x GMF of {mesh} {k:+d} x {wheel.shaft}": gmf + k * self.shaft_frequency(wheel.shaft)
            for wheel in self.train.wheels_of(mesh)
            for k in range(-order, order + 1)
            if k
        }

    def for_analysis(self, mesh: str | GearMesh) -> dict[str, object]:
        """Return ``speed`` (rad/s) and ``teeth`` of a mesh, as `gearmbs.signals.make_signal` takes them."""
        name = mesh if isinstance(mesh, str) else mesh.name
        driver, driven = self.train.wheels_of(name)
        return {"speed": abs(self.speeds[driver.shaft]), "teeth": (driver.gear.teeth, driven.gear.teeth)}

    def for_bearings(self, shaft: str | None = None) -> dict[str, Any]:
        """Return ``bearing``, ``speed`` (rad/s) and ``shafts`` as `gearmbs.signals.diagnose_bearing` takes them.

        Parameters
        ----------
        shaft : str, optional
            Whose speed is the reference; default: the first drive's.

        Raises
        ------
        DrivetrainError
            If no bearing has ``rolling``, or the reference shaft stands still.
        """
        reference = self.train.drives[0].shaft if shaft is None and self.train.drives else shaft
        turns = abs(self.speeds.get(reference, 0.0)) if reference is not None else 0.0
        if turns == 0.0:
            raise DrivetrainError(
                f"shaft '{reference}': is none of the drivetrain's or stands still; give a shaft that turns"
            )
        found = {}
        for part in self.train.bearings:
            if part.rolling is not None:
                own = abs(self.speeds[part.shaft] - self.speeds.get(self.train.carrier(part), 0.0))
                found[part.name] = (part.rolling, own / turns)
        if not found:
            raise DrivetrainError(f"drivetrain '{self.train.name}': no bearing has rolling; give a designation")
        others = sorted({abs(speed) / turns for name, speed in self.speeds.items() if name != reference and speed})
        return {"bearing": found, "speed": turns, "shafts": others}

    def to_markdown(self) -> str:
        """Return the table of frequencies in Markdown."""
        parts = ["| kind | of | line | frequency, Hz | multiple |", "|---|---|---|---|---|"]
        for row in self.lines.itertuples():
            parts.append(f"| {row.kind} | {row.of} | {row.name} | {row.frequency:.6g} | {row.multiple:.6g} |")
        return "\n".join(parts)

    def to_html(self) -> str:
        """Return the table as HTML."""
        shown = self.lines.to_html(index=False, float_format="{:.6g}".format)
        return f"<p><b>{self.train.name}</b></p>{shown}"

    _repr_html_ = to_html

    def __repr__(self) -> str:
        return f"KinematicTable of {self.train.name!r}\n{self.lines.to_string(index=False)}"
