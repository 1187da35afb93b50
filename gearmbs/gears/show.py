"""Tables of a wheel and a pair in the units of a drawing, for terminals and notebooks."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

from gearmbs._shown import html_table
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.mesh import Mesh
from gearmbs.units import Given, shown

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

    geometry, point = pair.geometry, pair.operating_point
    force, share = point.normal_force(geometry), pair.contact_model.face_share(geometry)
    one, two = geometry.driver, geometry.driven
    tilt = geometry.plane if geometry.misalignment else ""
    table = Table(title=f"Gear pair {one.teeth}/{two.teeth}")
    for column in ("", one.name, two.name):
        table.add_column(column, justify="left" if not column else "right")

    def both(label: str, form: str, attribute: str) -> None:
        table.add_row(label, *(format(getattr(w, attribute), form) for w in geometry.wheels))

    def measures(label: str, attribute: str, unit: str = "mm") -> None:
        table.add_row(label, *(shown(getattr(w, attribute), unit, ".4f") for w in geometry.wheels))

    both("teeth", "d", "teeth")
    for label, attribute in SIZES:
        if attribute != "bore_radius" or any(w.bore_radius for w in geometry.wheels):
            measures(label, attribute)
    if any(w.profile_shift for w in geometry.wheels):
        both("profile shift x (ISO 21771)", "+.4f", "profile_shift")
    if two.internal:
        both("profile shift outwards", "+.4f", "outward_shift")
        measures("outer radius", "outer_radius")
    if one.helix_angle:
        measures("helix angle", "helix_angle", "deg")
        table.add_row("hand", *(w.hand for w in geometry.wheels))
    measures("mass", "mass", "kg")
    table.add_section()
    for label, value in (
        ("centre distance", shown(geometry.centre_distance, "mm", ".4f")),
        ("working pressure angle", shown(geometry.working_pressure_angle, "deg", ".3f")),
        ("contact ratio", f"{geometry.contact_ratio:.4f}"),
        *_overlap(geometry),
        ("path of contact", shown(geometry.path_of_contact, "mm", ".3f")),
        ("normal backlash", shown(geometry.flank_backlash, "mm", ".4f")),
        *((f"{name.replace('_', ' ')}", shown(getattr(geometry, name), unit)) for name, unit in _given(geometry)),
        ("misalignment", f"{shown(geometry.misalignment, 'deg', '.3f')} {tilt}".strip()),
        ("load torque, driven wheel", shown(point.torque, "N m", ".1f")),
        ("normal force", shown(force, "N", ".1f")),
        ("contact law", str(pair.contact_model.law)),
        ("penetration, one pair", shown(pair.contact_model.penetration(force, share=share), "um", ".2f")),
    ):
        table.add_row(label, value, "")
    if geometry.jams:
        table.add_row(
            "jams",
            f"needs {shown(geometry.jam_backlash, 'mm', '.4f')} of normal backlash, has "
            f"{shown(geometry.normal_backlash, 'mm', '.4f')}",
            "",
        )
    return table


def _given(geometry: PairGeometry) -> list[tuple[str, str]]:
    """Settings of the placement that stand beside what follows from them, where they were given."""
    fields = ("centre_distance_error", "axial_shift", "backlash")
    return [(name, "mm") for name in fields if isinstance(getattr(geometry, name), Given)]


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
    material = gear.material
    rows = [
        ("teeth", str(gear.teeth)),
        *((label, shown(getattr(gear, name), "mm", ".4f")) for label, name in SIZES),
        ("pressure angle", shown(gear.pressure_angle, "deg")),
        *([("helix angle", f"{shown(gear.helix_angle, 'deg')}, {gear.hand} hand")] if gear.helix_angle else []),
        ("profile shift", f"{gear.profile_shift:.6g}"),
        ("mass", shown(gear.mass, "kg", ".4f")),
        ("material", f"E = {shown(material.youngs_modulus, 'GPa')}, {shown(material.density, 'kg/m^3')}"),
    ]
    return html_table(f"Wheel {gear.name}", ("", ""), rows)
