"""Material that is missing from rings and elements, as periodic splines over their angle.

A ball that rolls over a gap stands on its edges: at a distance e from the nearer edge its centre has dropped by

    r - sqrt(r^2 - e^2)    (r: radius of the element),

at most by the depth of the gap. In the middle of a gap of width B this is r - sqrt(r^2 - B^2/4), and the path has a
kink there, where the element strikes the far edge. Edges are rounded by a smooth average over their width.
"""

from __future__ import annotations

import numpy as np

from gearmbs.bearings.profile_kernel import MARGIN

LEAST_NODES = 1024
MOST_NODES = 1 << 16
PER_EDGE = 6
"""Nodes of the spline over the width of the finest edge."""


def drop(distance: np.ndarray, radius: float, depth: float) -> np.ndarray:
    """Return how far an element's centre has dropped at a distance inside the edge of a gap, m."""
    inside = np.clip(distance, 0.0, radius)
    return np.minimum(radius - np.sqrt(radius**2 - inside**2), depth)


def spall_depth(width: float, radius: float) -> float:
    """Return how far an element of a radius drops into the middle of a gap without bottom, m.

    Examples
    --------
    >>> [round(1e6 * spall_depth(1e-3 * width, 3.97e-3), 2) for width in (0.2, 0.5, 1.0, 2.0)]
    [1.26, 7.88, 31.61, 128.01]
    """
    return float(drop(np.array(0.5 * width), radius, np.inf))


def node_count(edge: float, radius: float) -> int:
    """Return the number of nodes, a power of two, that resolves an edge on a ring of a radius."""
    wanted = PER_EDGE * 2.0 * np.pi * radius / edge
    return int(np.clip(2 ** int(np.ceil(np.log2(max(wanted, 1.0)))), LEAST_NODES, MOST_NODES))


def angles(nodes: int) -> np.ndarray:
    """Return the angles of the nodes, rad."""
    return np.arange(nodes) * (2.0 * np.pi / nodes)


def rounded(values: np.ndarray, width: float) -> np.ndarray:
    """Return a periodic profile averaged over a width in rad, by the smooth bump (1 - x^2)^3."""
    nodes = values.size
    half = 0.5 * width * nodes / (2.0 * np.pi)
    if half < 0.5:
        return values
    reach = int(np.ceil(half))
    x = np.arange(-reach, reach + 1) / half
    bump = np.clip(1.0 - x**2, 0.0, None) ** 3
    kernel = np.zeros(nodes)
    np.add.at(kernel, np.arange(-reach, reach + 1) % nodes, bump / bump.sum())
    return np.fft.irfft(np.fft.rfft(values) * np.fft.rfft(kernel), nodes)


def spline_coefficients(values: np.ndarray) -> np.ndarray:
    """Return the coefficients of the periodic cubic B-spline through values at even nodes, the first three repeated."""
    nodes = values.size
    response = (4.0 + 2.0 * np.cos(2.0 * np.pi * np.arange(nodes // 2 + 1) / nodes)) / 6.0
    inner = np.fft.irfft(np.fft.rfft(values) / response, nodes)
    # the kernel begins one node before the interval
    return np.take(inner, np.arange(-1, nodes + MARGIN - 1), mode="wrap")
