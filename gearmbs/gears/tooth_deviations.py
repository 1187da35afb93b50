"""Deviations of the tooth flanks of one wheel, to which every fault adds its own; packed into the contact tables."""

from __future__ import annotations

import math

import numpy as np

from gearmbs.gears.spec import GearSpec

PROFILE_POINTS = 65
FACE_SECTIONS = 33
COMPLIANCE_POINTS = 65


class ToothDeviations:
    """Deviations of every tooth flank of one wheel.

    Material missing from a flank, along its normal, is positive. Flank 0 is the one at the counter-clockwise side of
    its tooth, seen against the wheel's axis; flank 1 the other.

    Attributes
    ----------
    gear : GearSpec
    drive : int
        The flank that carries the load.
    roll_length : ndarray, shape (ns,)
        Points of the profile from the base circle (of an internal wheel: from the root) to the tip, by their length of
        roll, m.
    section : ndarray, shape (nz,)
        Transverse sections along the face, from mid-face, m.
    offset : ndarray, shape (2, z)
        Constant material missing per flank, m.
    shape : ndarray, shape (2, z, nz, ns)
        Material missing over face and profile, m.
    tip : ndarray, shape (2, z, nz)
        Length of roll where the flank ends at the tip, m.
    compliance : ndarray, shape (2, z, nc)
        Compliance added to a tooth pair, relative to a healthy pair's, at `compliance_roll_length`.
    compliance_roll_length : ndarray, shape (nc,)
        Lengths of roll on this wheel, m.
    """

    def __init__(self, gear: GearSpec, rotation: int, along_face: bool, compliance_roll_length: np.ndarray) -> None:
        z = gear.teeth
        nz = FACE_SECTIONS if along_face else 2
        self.gear = gear
        self.drive = 0 if rotation > 0 else 1
        start = gear.form_roll_length if gear.internal else 0.0
        self.roll_length = np.linspace(start, gear.tip_roll_length, PROFILE_POINTS)
        self.section = np.linspace(-0.5, 0.5, nz) * gear.face_width
        self.offset = np.zeros((2, z))
        self.shape = np.zeros((2, z, nz, PROFILE_POINTS))
        self.tip = np.full((2, z, nz), gear.tip_roll_length)
        self.compliance_roll_length = compliance_roll_length
        self.compliance = np.zeros((2, z, compliance_roll_length.size))

    @property
    def radius(self) -> np.ndarray:
        """Radii of the points of the profile, m."""
        return np.hypot(self.gear.base_radius, self.roll_length)

    def flanks(self, which: str) -> list[int]:
        """Flank numbers of ``"drive"``, ``"coast"`` or ``"both"``."""
        choices = {"drive": [self.drive], "coast": [1 - self.drive], "both": [0, 1]}
        if which not in choices:
            raise ValueError(f"flank is {which!r}; choose 'drive', 'coast' or 'both'")
        return choices[which]

    def normal_angle(self, flank: int) -> np.ndarray:
        """Direction of the outward normal in the wheel's frame, rad, shape (z, ns)."""
        side = 1 - 2 * flank
        middle = 2 * math.pi * np.arange(self.gear.teeth)[:, None] / self.gear.teeth
        turned = self.gear.sign * self.roll_length / self.gear.base_radius
        tangent = middle + side * (self.gear.base_half_angle - turned)
        return tangent + side * 0.5 * math.pi

    def shift(self, x: np.ndarray | float, y: np.ndarray | float) -> None:
        """Displace the whole toothing by (x, y) in the wheel's frame, m; arrays run along the face."""
        x = np.broadcast_to(np.asarray(x, dtype=float), self.section.shape)
        y = np.broadcast_to(np.asarray(y, dtype=float), self.section.shape)
        lead = (self.gear.twist_tangent / self.gear.base_radius * self.section)[None, :, None]
        for flank in (0, 1):
            angle = self.normal_angle(flank)[:, None, :] + lead
            self.shape[flank] -= x[:, None] * np.cos(angle) + y[:, None] * np.sin(angle)

    def shorten(self, tooth: int, radius: np.ndarray) -> None:
        """Cut both flanks of a tooth at these radii along the face, m."""
        roll_length = np.sqrt(np.maximum(radius**2 - self.gear.base_radius**2, 0.0))
        # a shorter tooth ends at a larger radius where teeth point inwards
        shorter = np.maximum if self.gear.internal else np.minimum
        self.tip[:, tooth] = shorter(self.tip[:, tooth], roll_length)

    def tooth_list(self, teeth: object) -> list[int]:
        """Tooth numbers from ``"all"``, one number or several; numbers wrap around the wheel."""
        if isinstance(teeth, str):
            if teeth != "all":
                raise ValueError(f"teeth is {teeth!r}; give 'all', a tooth number or several")
            return list(range(self.gear.teeth))
        numbers = [teeth] if isinstance(teeth, int) else list(teeth)  # type: ignore[call-overload]
        return [int(n) % self.gear.teeth for n in numbers]
