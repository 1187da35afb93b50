"""Tables of a wheel and a pair in the units of a drawing, for terminals and notebooks."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

from gearmbs._shown import html_table
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.mesh import Mesh

if TYPE_CHECKING:
    from rich.table import Table

    from gearmbs.gears.spec import GearSpec


SIZES = (
    ("module", "module"),
    ("pitch radius", "pitch_radius"),
    ("tip radius", "tip_radius"),
    ("base radius", "base_radius"),
    ("root radius", "root_radius"),
    ("root arc", "fillet_radius"),
    ("face width", "face_width"),
    ("bore radius", "bore_radius"),
)
"""Lengths of a wheel that its table shows."""


def pair_table(pair: Mesh) -> Table:
    """Table of a gear pair for a terminal or a notebook."""
    from rich.table import Table

    mm = 1e3
    geometry, point = pair.geometry, pair.operating_point
    force = point.normal_force(geometry)
    one, two = geometry.driver, geometry.driven
    tilt = geometry.plane if geometry.misalignment else ""
    table = Table(title=f"Gear pair {one.teeth}/{two.teeth}")
    for column in ("", one.name, two.name):
        table.add_column(column, justify="left" if not column else "right")

    def both(label: str, form: str, attribute: str, factor: float = mm) -> None:
        table.add_row(label, *(format(getattr(w, attribute) * factor, form) for w in geometry.wheels))

    both("teeth", "d", "teeth", 1)
    for label, attribute in (
        ("module mm", "module"),
        ("pitch radius mm", "pitch_radius"),
        ("tip radius mm", "tip_radius"),
        ("base radius mm", "base_radius"),
        ("root radius mm", "root_radius"),
        ("root arc mm", "fillet_radius"),
        ("face width mm", "face_width"),
    ):
        both(label, ".4f", attribute)
    if any(w.profile_shift for w in geometry.wheels):
        both("profile shift x (ISO 21771)", "+.4f", "profile_shift", 1)
    if two.internal:
        both("profile shift outwards", "+.4f", "outward_shift", 1)
        both("outer radius mm", ".4f", "outer_radius")
    if one.helix_angle:
        both("helix angle deg", ".4f", "helix_angle", math.degrees(1))
        table.add_row("hand", *(w.hand for w in geometry.wheels))
    both("mass kg", ".4f", "mass", 1)
    table.add_section()
    for label, value in (
        ("centre distance mm", f"{geometry.centre_distance * mm:.4f}"),
        ("working pressure angle deg", f"{math.degrees(geometry.working_pressure_angle):.3f}"),
        ("contact ratio", f"{geometry.contact_ratio:.4f}"),
        *_overlap(geometry),
        ("path of contact mm", f"{geometry.path_of_contact * mm:.3f}"),
        ("normal backlash mm", f"{geometry.normal_backlash * mm:.4f}"),
        (
            "misalignment deg",
            f"{math.degrees(geometry.misalignment):.3f} {tilt}",
        ),
        ("load torque N m", f"{point.torque:.1f}"),
        ("normal force N", f"{force:.1f}"),
        ("penetration, one pair um", f"{pair.contact_model.penetration(force) * 1e6:.2f}"),
    ):
        table.add_row(label, value, "")
    if geometry.jams:
        table.add_row(
            "jams",
            f"needs {geometry.jam_backlash * mm:.4f} mm of normal backlash, has {geometry.normal_backlash * mm:.4f}",
            "",
        )
    return table


def _overlap(geometry: PairGeometry) -> list[tuple[str, str]]:
    """Rows of helical wheels."""
    if geometry.driver.helix_angle == 0:
        return []
    return [
        ("overlap ratio", f"{geometry.overlap_ratio:.4f}"),
        ("total contact ratio", f"{geometry.total_contact_ratio:.4f}"),
    ]


def pair_html(pair: Mesh) -> str:
    """Return the table as HTML for a notebook."""
    table = pair_table(pair)
    columns = [list(column.cells) for column in table.columns]
    head = "".join(f"<th>{html.escape(str(c.header))}</th>" for c in table.columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in zip(*columns)
    )
    title = html.escape(str(table.title))
    return f"<table><caption>{title}</caption><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def wheel_html(gear: GearSpec) -> str:
    """Return a wheel as a table for a notebook."""
    mm = 1e3
    rows = [
        ("teeth", str(gear.teeth)),
        *((label, f"{getattr(gear, name) * mm:.4f} mm") for label, name in SIZES),
        ("pressure angle", f"{math.degrees(gear.pressure_angle):.6g} deg"),
        ("profile shift", f"{gear.profile_shift:.6g}"),
        ("mass", f"{gear.mass:.4f} kg"),
        ("material", f"E = {gear.material.youngs_modulus * 1e-9:.6g} GPa, {gear.material.density:.6g} kg/m^3"),
    ]
    return html_table(f"Wheel {gear.name}", ("", ""), rows)
