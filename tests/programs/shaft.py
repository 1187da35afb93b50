"""A shaft that bends: critical speeds, and the same shaft in a mechanism."""

from pathlib import Path

import numpy as np

from gearmbs.flexible import Disc, Rotor, Shaft, ShaftSection, Support
from gearmbs.mechanism import Mechanism


def main(folder: Path) -> float:
    """Return the first critical speed, rad/s."""
    shaft = Shaft(
        [ShaftSection("500 mm", "25 mm")], [Disc("250 mm", outer="150 mm", width="20 mm", inner="25 mm")],
        {"left": 0, "right": "500 mm"},
    )  # fmt: skip
    rotor = Rotor(shaft, [Support("left", "10 kN/mm"), Support("right", "10 kN/mm")])
    critical: np.ndarray = rotor.critical_speeds(2)
    m = Mechanism("rotor")
    model = shaft.modal_model(4)
    body = model.add_to(m, "shaft", damping=0.01, position=(0, 0, 0))
    for seat in ("left", "right"):
        place = model.place(seat)
        m.bushing(seat, body.marker(place), m.ground.marker(place), stiffness=(1e7, 1e7, 1e7))
    frequencies = m.linear_modes().frequencies
    (folder / "critical.txt").write_text(" ".join(f"{f:.1f}" for f in [*critical, *frequencies]))
    return float(critical[0])
