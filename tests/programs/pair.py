"""A pair with a fault: signals of two states, their averages and a figure."""

from pathlib import Path

import gearmbs as gm


def main(folder: Path) -> float:
    """Return the larger level of the third harmonic of the mesh, N."""
    healthy = gm.Case(
        name="healthy",
        gears={"teeth": (21, 34), "module": "2.5 mm", "face_width": "20 mm"},
        operation={"speed": "1500 rpm", "torque": "60 N m", "duration": 0.2},
    )
    broken = healthy.changed(name="broken tooth", fault={"teeth": "broken tooth"})
    ideal = gm.IdealMesh.with_damping_ratio(healthy.pair().with_changes(backlash="0.1 mm"), "4e8 N/m", backlash=True)
    levels: list[float] = [ideal.depth]
    for record in gm.run_cases([healthy, broken]):
        signal = gm.record_signal(record, "line_of_action")
        report = gm.analyse(signal, teeth=21)
        levels.append(float(report.harmonics["band"].sel(harmonic=3).max()))
    figure = gm.average_plot(gm.analyse(signal, teeth=21).average, teeth=21)
    figure.savefig(folder / "pinion.png")
    return max(levels)
