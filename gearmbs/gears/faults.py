"""Faults and deviations of teeth: kind, severity and label.

Each is a small frozen description with a severity and a label; ``GearPair.faults`` takes any number of them and they
combine by addition. Lengths are in m or text with a unit, angles in rad or text.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.modifications import (
    Crowning,
    EndRelief,
    Fault,
    Flank,
    FlankMap,
    LeadCorrection,
    RootRelief,
    TipRelief,
    ToothDeviations,
    turned_by_helix,
)
from gearmbs.gears.spec import GearSpec
from gearmbs.gears.stiffness import Crack, check_crack, pair_stiffness
from gearmbs.units import Quantity

__all__ = [
    "BrokenTooth",
    "ChippedCorner",
    "Crowning",
    "CumulativePitchError",
    "Eccentricity",
    "EndRelief",
    "Fault",
    "FlankMap",
    "GradedFlanks",
    "LeadCorrection",
    "Pit",
    "PitchError",
    "RootCrack",
    "RootRelief",
    "TipRelief",
    "Waviness",
    "Wear",
    "Wobble",
]

MOST_WOBBLE = math.radians(2.0)
"""Lean of a toothing, up to which it is as good as a shift of its sections, which is what is made of it."""
POINTS_A_WAVE = 10
"""Points of the profile that a wave along the flank must be resolved by."""


@dataclass(frozen=True, kw_only=True)
class ChippedCorner(Fault):
    """A corner of a tooth broken off at one end of the face, along a straight line.

    Parameters
    ----------
    height : float or str
        Missing tooth height at the end of the face.
    length : float or str
        Over which part of the face.
    tooth : int
    end : {1, -1}
        End of the face, +1 towards +z.
    """

    label: ClassVar[str] = "chipped corner"
    units: ClassVar[dict[str, str]] = {"height": "length", "length": "length"}
    along_face: ClassVar[bool] = True

    height: Quantity = 2e-3
    length: Quantity = 5e-3
    tooth: int = 0
    end: int = 1

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "length", self.length if self.length > 0 else gear.face_width

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        gear = deviations.gear
        if not 0 < self.length <= gear.face_width:
            raise ValueError(
                f"ChippedCorner.length is {self.length} m; give more than 0 up to the face width, "
                f"{gear.face_width:.6g} m"
            )
        most = abs(gear.tip_radius - gear.root_radius)
        if not 0 < self.height <= most:
            raise ValueError(f"ChippedCorner.height is {self.height} m; the tooth is {most:.6f} m high")
        from_end = 0.5 * gear.face_width - self.end * deviations.section
        cut = self.height * np.maximum(0.0, 1 - from_end / self.length)
        deviations.shorten(self.tooth % gear.teeth, gear.tip_radius - gear.sign * cut)


@dataclass(frozen=True, kw_only=True)
class BrokenTooth(Fault):
    """A tooth broken off over the whole face.

    Parameters
    ----------
    lost : float
        Share of the tooth height that is missing, up to 1.
    tooth : int
    """

    label: ClassVar[str] = "broken tooth"
    units: ClassVar[dict[str, str]] = {"lost": "dimensionless"}

    lost: Quantity = 0.7
    tooth: int = 0

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        if not 0 < self.lost <= 1:
            raise ValueError(f"BrokenTooth.lost is {self.lost}; give a share of the height above 0 up to 1")
        gear = deviations.gear
        radius = gear.tip_radius - self.lost * (gear.tip_radius - gear.root_radius)
        deviations.shorten(self.tooth % gear.teeth, np.full(deviations.section.size, radius))


@dataclass(frozen=True, kw_only=True)
class RootCrack(Fault):
    """A crack in the root of a tooth: geometry unchanged, the tooth bends more (potential-energy method).

    Parameters
    ----------
    depth : float or str
        Length of the crack.
    angle : float or str
        Between crack and the tooth's middle line, above 0 up to 90 deg, which is straight across the tooth.
    tooth : int
    """

    label: ClassVar[str] = "root crack"
    units: ClassVar[dict[str, str]] = {"depth": "length", "angle": "angle"}

    depth: Quantity = 2e-3
    angle: Quantity = "70 deg"
    tooth: int = 0

    def check_sizes(self, gear: GearSpec) -> None:
        """Refuse none: how much a tooth can be cracked is known where its outline is."""

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        check_crack(self.depth, self.angle, "RootCrack")
        crack = Crack(self.depth, self.angle)
        driver = self.wheel == "driver"
        own = deviations.compliance_roll_length
        roll_length = own if driver else pair.mate_roll_length(1, own)
        cracked = pair_stiffness(pair, roll_length, (crack, None) if driver else (None, crack))
        deviations.compliance[:, self.tooth % deviations.gear.teeth] += pair_stiffness(pair, roll_length) / cracked - 1


@dataclass(frozen=True, kw_only=True)
class Pit(Fault):
    """A pit or spall on a flank: an elliptic hollow.

    Parameters
    ----------
    depth : float or str
        Greatest depth.
    height, width : float or str
        Size along the profile (as radius) and along the face.
    radius : float or str, optional
        Of its centre on the wheel; default the pitch circle.
    position : float or str
        Of its centre along the face, from mid-face.
    tooth : int
    flank : {"drive", "coast", "both"}
    """

    label: ClassVar[str] = "pitting"
    units: ClassVar[dict[str, str]] = {
        "depth": "length",
        "height": "length",
        "width": "length",
        "position": "length",
        "radius": "length",
    }
    along_face: ClassVar[bool] = True

    depth: Quantity = 50e-6
    height: Quantity = 2e-3
    width: Quantity = 5e-3
    radius: Quantity = None
    position: Quantity = 0.0
    tooth: int = 0
    flank: Flank = "drive"

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "width", 0.5 * self.width if self.width > 0 else gear.face_width

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        for name in ("depth", "height", "width"):
            value = getattr(self, name)
            if not value > 0:
                raise ValueError(f"Pit.{name} is {value} m; it must be positive")
        centre = deviations.gear.pitch_radius if self.radius is None else self.radius
        u = (deviations.radius - centre) / (0.5 * self.height)
        v = (deviations.section - self.position) / (0.5 * self.width)
        hollow = self.depth * np.maximum(0.0, 1 - u[None, :] ** 2 - v[:, None] ** 2)
        if not hollow.max() > 0:
            raise ValueError(
                f"Pit.radius {centre} m or Pit.position {self.position} m puts the pit off the flank or between its "
                "points; move or enlarge it"
            )
        for flank in deviations.flanks(self.flank):
            deviations.shape[flank, self.tooth % deviations.gear.teeth] += hollow


@dataclass(frozen=True, kw_only=True)
class Wear(Fault):
    """Wear as sliding makes it: nothing at the working pitch point, growing towards root and tip.

    Parameters
    ----------
    depth : float or str
        At the end of the active profile that slides most.
    teeth : "all", int or several
    flank : {"drive", "coast", "both"}
    """

    label: ClassVar[str] = "wear"
    units: ClassVar[dict[str, str]] = {"depth": "length"}

    depth: Quantity = 20e-6
    teeth: Any = "all"
    flank: Flank = "drive"

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        if not self.depth >= 0:
            raise ValueError(f"Wear.depth is {self.depth} m; it must not be negative")
        gear = deviations.gear
        pitch_point = gear.base_radius * math.tan(pair.working_pressure_angle)
        start = pair.first_roll_lengths[self.wheel == "driven"]
        # specific sliding: way slid per way rolled over, finite from the start of the active profile on
        roll_length = np.maximum(deviations.roll_length, start)
        if gear.internal:
            # its active profile begins outwards, at the largest length of roll
            roll_length = np.minimum(deviations.roll_length, start)
        sliding = np.abs(roll_length - pitch_point) / roll_length
        worn = self.depth * sliding / max(abs(start - pitch_point) / start, sliding[-1])
        for flank in deviations.flanks(self.flank):
            deviations.shape[flank, deviations.tooth_list(self.teeth)] += worn


@dataclass(frozen=True, kw_only=True)
class Eccentricity(Fault):
    """The toothing's centre off the axis of rotation: run-out of twice the amount.

    Parameters
    ----------
    amount : float or str
        Distance of the centres.
    phase : float or str
        Direction in the wheel's frame, from tooth 0.
    """

    label: ClassVar[str] = "eccentricity"
    units: ClassVar[dict[str, str]] = {"amount": "length", "phase": "angle"}

    amount: Quantity = 20e-6
    phase: Quantity = 0.0

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "amount", turned_by_helix(gear)

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        if not self.amount >= 0:
            raise ValueError(f"Eccentricity.amount is {self.amount} m; it must not be negative")
        deviations.shift(self.amount * math.cos(self.phase), self.amount * math.sin(self.phase))


@dataclass(frozen=True, kw_only=True)
class Wobble(Fault):
    """A tilted bore: the toothing's axis crosses the axis of rotation at mid-face.

    Parameters
    ----------
    angle : float or str
        At most 2 deg to either side.
    phase : float or str
        Direction, in the wheel's frame, in which the toothing leans at its +z end.
    """

    label: ClassVar[str] = "wobble"
    units: ClassVar[dict[str, str]] = {"angle": "angle", "phase": "angle"}
    along_face: ClassVar[bool] = True

    angle: Quantity = "0.05 deg"
    phase: Quantity = 0.0

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "angle", min(gear.face_width, turned_by_helix(gear))

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        if not abs(self.angle) <= MOST_WOBBLE:
            raise ValueError(
                f"Wobble.angle is {math.degrees(self.angle):.4g} deg; give up to {math.degrees(MOST_WOBBLE):.0f} deg "
                "(a plain number is in radians)"
            )
        lean = math.tan(self.angle) * deviations.section
        deviations.shift(lean * math.cos(self.phase), lean * math.sin(self.phase))


@dataclass(frozen=True, kw_only=True)
class PitchError(Fault):
    """One tooth out of place.

    Parameters
    ----------
    amount : float or str
        Displacement of its flanks along the base tangent; positive: the drive flank stands out.
    tooth : int
    """

    label: ClassVar[str] = "single pitch error"
    units: ClassVar[dict[str, str]] = {"amount": "length"}

    amount: Quantity = 20e-6
    tooth: int = 0

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        tooth = self.tooth % deviations.gear.teeth
        deviations.offset[deviations.drive, tooth] -= self.amount
        deviations.offset[1 - deviations.drive, tooth] += self.amount


@dataclass(frozen=True, kw_only=True)
class CumulativePitchError(Fault):
    """Teeth out of place along the whole wheel, as a wave: what an indexing gear or a shifted blank leaves.

    Parameters
    ----------
    amount : float or str
        Total cumulative pitch deviation F_p: largest displacement along the base tangent less the smallest.
    order : int
        Waves per revolution, 1 up to half the number of teeth.
    phase : float or str
        Of the wave at tooth 0; positive displacements let the drive flank stand out.
    """

    label: ClassVar[str] = "cumulative pitch error"
    units: ClassVar[dict[str, str]] = {"amount": "length", "phase": "angle"}

    amount: Quantity = 30e-6
    order: int = 1
    phase: Quantity = 0.0

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        teeth = deviations.gear.teeth
        if not self.amount >= 0:
            raise ValueError(f"CumulativePitchError.amount is {self.amount} m; it must not be negative")
        if not 1 <= self.order <= teeth // 2:
            raise ValueError(
                f"CumulativePitchError.order is {self.order!r}; give 1 up to {teeth // 2} waves per revolution"
            )
        wave = np.sin(2 * math.pi * self.order * np.arange(teeth) / teeth + self.phase)
        index = self.amount / np.ptp(wave) * wave
        deviations.offset[deviations.drive] -= index
        deviations.offset[1 - deviations.drive] += index


@dataclass(frozen=True, kw_only=True)
class Waviness(Fault):
    """Undulated flanks, as a machine tool leaves them: a line at an order that no number of teeth explains.

    The wave is a function of the direction of the flank's normal, hence of the wheel's rotation where it touches. All
    pairs in contact are then displaced alike, and the transmission error has the wave's own amplitude.

    Parameters
    ----------
    amount : float or str
        Amplitude of the wave.
    waves : int
        Waves per revolution of the wheel.
    phase : float or str
        Of the wave in the wheel's frame.
    flank : {"drive", "coast", "both"}
    """

    label: ClassVar[str] = "waviness"
    units: ClassVar[dict[str, str]] = {"amount": "length", "phase": "angle"}
    least: ClassVar[dict[str, int]] = {"waves": 1}

    amount: Quantity = 1e-6
    waves: int = 71
    phase: Quantity = 0.0
    flank: Flank = "both"

    def face_detail(self, gear: GearSpec) -> tuple[str, float]:
        return "waves", turned_by_helix(gear, self.waves)

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        gear = deviations.gear
        step = abs(deviations.roll_length[1] - deviations.roll_length[0]) / gear.base_radius
        most = int(2 * math.pi / (POINTS_A_WAVE * step))
        if not self.amount >= 0:
            raise ValueError(f"Waviness.amount is {self.amount} m; it must not be negative")
        if not self.waves <= most:
            raise ValueError(
                f"Waviness.waves is {self.waves}; the profile's points resolve up to {most} waves per revolution"
            )
        for flank in deviations.flanks(self.flank):
            wave = np.sin(self.waves * deviations.normal_angle(flank) + self.phase)
            deviations.shape[flank] += self.amount * wave


@dataclass(frozen=True, kw_only=True)
class GradedFlanks(Fault):
    """Random deviations that use up the tolerances of an ISO 1328-1:2013 grade.

    Parameters
    ----------
    grade : int
        1 (finest) to 11.
    seed : int
        The same seed gives the same wheel.
    pitch, profile, lead : bool
        Which deviations to include.
    """

    label: ClassVar[str] = "manufacturing grade"
    units: ClassVar[dict[str, str]] = {"grade": "dimensionless"}
    least: ClassVar[dict[str, int]] = {"seed": 0}
    along_face: ClassVar[bool] = True

    grade: Quantity = 6
    seed: int = 0
    pitch: bool = True
    profile: bool = True
    lead: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        good = self.grade in range(1, 12)
        if not good:
            raise ValueError(f"GradedFlanks.grade is {self.grade}; ISO 1328-1 has the whole grades 1 to 11")

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        gear = deviations.gear
        limit = tolerances(gear, int(self.grade))
        generator = np.random.default_rng([self.seed, 0 if self.wheel == "driver" else 1])
        along = (deviations.roll_length - deviations.roll_length[0]) / np.ptp(deviations.roll_length) - 0.5
        across = deviations.section / gear.face_width
        for flank in (0, 1):
            side = 1 - 2 * flank
            if self.pitch:
                index = _random_pitch(gear.teeth, limit, generator)
                deviations.offset[flank] -= side * index
            scale = generator.uniform(-1, 1, size=(4, gear.teeth))
            wave = generator.uniform(0, 2 * math.pi, size=2)
            for tooth in range(gear.teeth):
                profile = limit.profile_slope * scale[0, tooth] * along
                profile = profile + 0.5 * limit.profile_form * scale[1, tooth] * np.sin(4 * math.pi * along + wave[0])
                lead = limit.lead_slope * scale[2, tooth] * across
                lead = lead + 0.5 * limit.lead_form * scale[3, tooth] * np.sin(3 * math.pi * across + wave[1])
                deviations.shape[flank, tooth] += self.profile * profile[None, :] + self.lead * lead[:, None]


# Flank tolerances of ISO 1328-1:2013 and random deviations that just meet them.
#
# The tolerances are the standard's formulas for grade A (1 to 11), in metres, unrounded.


MICRON = 1e-6
"""Metres: ISO 1328-1 states its tolerances in micrometres."""


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of one wheel, m.

    Attributes
    ----------
    single_pitch, total_pitch : float
        f_pT and F_pT.
    profile_slope, profile_form : float
        f_HalphaT and f_falphaT.
    lead_slope, lead_form : float
        f_HbetaT and f_fbetaT.
    """

    single_pitch: float
    total_pitch: float
    profile_slope: float
    profile_form: float
    lead_slope: float
    lead_form: float


def tolerances(gear: GearSpec, grade: int) -> Tolerances:
    """Tolerances of a wheel for an ISO 1328-1:2013 grade.

    Raises
    ------
    ValueError
        For grades outside 1 to 11.
    """
    if not (isinstance(grade, int) and 1 <= grade <= 11):
        raise ValueError(f"grade is {grade!r}; ISO 1328-1 has grades 1 to 11")
    d, m, b = 2e3 * gear.pitch_radius, 1e3 * gear.module, 1e3 * gear.face_width
    step = math.sqrt(2) ** (grade - 5) * MICRON
    return Tolerances(
        single_pitch=(0.001 * d + 0.4 * m + 5) * step,
        total_pitch=(0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12) * step,
        profile_slope=(0.001 * d + 0.4 * m + 4) * step,
        profile_form=(0.55 * m + 5) * step,
        lead_slope=(0.05 * math.sqrt(d) + 0.35 * math.sqrt(b) + 4) * step,
        lead_form=(0.07 * math.sqrt(d) + 0.45 * math.sqrt(b) + 4) * step,
    )


def _random_pitch(z: int, limit: Tolerances, generator: np.random.Generator) -> np.ndarray:
    """Index deviations of all teeth (cumulative pitch), m, shape (z,), that use up the pitch tolerances.

    A once-per-revolution run-out and a random part, scaled so that neither the single pitch deviations nor the total
    exceed their tolerances and the nearer of the two is met.
    """
    angle = 2 * math.pi * np.arange(z) / z
    index = math.sin(1.0) * np.sin(angle + generator.uniform(0, 2 * math.pi))
    noise = np.cumsum(generator.normal(size=z)) / math.sqrt(z)
    index = index + noise - noise[-1] * np.arange(1, z + 1) / z
    index -= index.mean()
    single = np.abs(np.diff(np.append(index, index[0]))).max()
    return index * min(limit.single_pitch / single, limit.total_pitch / np.ptp(index))
