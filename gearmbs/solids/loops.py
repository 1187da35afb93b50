"""Loops of a face as polygons in the plane of its parameters.

A face that goes around is cut open along a line between two of its loops, or from a loop to a pole.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.solids.curves import TURN
from gearmbs.solids.planes import Flat, FromPoint, area
from gearmbs.solids.surfaces import ROUND, Turned

SEAM = -10_000
"""Below it: keys of points on a cut, which are one on both of its sides."""
MOST_AROUND = 2000


def polygons_of(
    flat: Flat, left: float, loops: list[np.ndarray], places: np.ndarray, tolerance: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the sides of a face in the plane: polygons, and the numbers of their points, negative for new ones."""
    around: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    polygons: list[np.ndarray] = []
    numbers: list[np.ndarray] = []
    for loop in loops:
        uv = _unrolled(flat.to_plane(places[np.r_[loop, loop[:1]]]), flat)
        turns = _windings(uv, flat)
        if np.any(turns):
            around.append((uv, np.r_[loop, loop[:1]], turns))
        else:
            polygons.append(uv[:-1])
            numbers.append(np.array(loop))
    if not loops:
        polygon, number = _whole(flat, tolerance)
        return [polygon], [number]
    if around:
        polygon, number = _opened(flat, left, around, polygons, tolerance)
        low, high = polygon.min(axis=0), polygon.max(axis=0)
        inner = [_shifted_into(p, flat, polygon, low, high) for p in polygons]
        return [polygon, *inner], [number, *numbers]
    if len(polygons) > 1:
        outer = int(np.argmax([abs(area(p)) for p in polygons]))
        low, high = polygons[outer].min(axis=0), polygons[outer].max(axis=0)
        polygons = [
            p if k == outer else _shifted_into(p, flat, polygons[outer], low, high) for k, p in enumerate(polygons)
        ]
    return polygons, numbers


def _unrolled(uv: np.ndarray, flat: Flat) -> np.ndarray:
    """Return a chain of parameters without jumps by a period; at a pole u is that of the neighbour."""
    out = uv.copy()
    for pole in flat.surface.poles if not isinstance(flat, FromPoint) else ():
        at = np.flatnonzero(np.abs(out[:, 1] - pole) < 1e-9 * max(1.0, abs(pole)))
        for k in at.tolist():
            out[k, 0] = out[k - 1, 0] if k else out[min(k + 1, len(out) - 1), 0]
    for k, period in enumerate(flat.periods):
        if period is not None:
            out[:, k] = np.unwrap(out[:, k], period=period)
    return out


def _windings(uv: np.ndarray, flat: Flat) -> np.ndarray:
    """Return how often a closed chain goes around in u and in v."""
    return np.array([0 if p is None else round((uv[-1, k] - uv[0, k]) / p) for k, p in enumerate(flat.periods)])


def _shifted_into(polygon: np.ndarray, flat: Flat, outer: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return a polygon moved by periods into the box of the outer one."""
    middle = 0.5 * (polygon.min(axis=0) + polygon.max(axis=0))
    choices = [polygon]
    for k, period in enumerate(flat.periods):
        if period is not None:
            first = np.ceil((low[k] - middle[k]) / period - 1e-9)
            last = np.floor((high[k] - middle[k]) / period + 1e-9)
            moves = np.arange(first, last + 1.0) if last >= first else np.zeros(1)
            choices = [c + m * period * np.eye(2)[k] for c in choices for m in moves]
    return next((c for c in choices if _holds(outer, c[0])), choices[0])


def _holds(polygon: np.ndarray, p: np.ndarray) -> bool:
    """Return whether a polygon holds a point."""
    (x, y), (x2, y2) = polygon.T, np.roll(polygon, -1, axis=0).T
    cross = (y > p[1]) != (y2 > p[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x + (p[1] - y) * (x2 - x) / (y2 - y)
    return bool(np.sum(cross & (p[0] < at)) % 2)


def _whole(flat: Flat, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the whole domain of a surface without loops: a sphere or a torus, whose sides are one."""
    surface = flat.surface
    if surface.kind not in ("SPHERE", "TORUS"):
        raise ModelError(f"a face on a {surface.kind} has no edges; save the solid as .stl")
    assert isinstance(surface, Turned)
    torus = surface.kind == "TORUS"
    bend = surface.radius + surface.tube
    n = max(8, int(np.ceil(ROUND / min(TURN, 2.0 * np.arccos(max(1.0 - tolerance / bend, 0.0))))))
    if n > MOST_AROUND:
        raise ModelError(f"a face on a {surface.kind} needs {n} chords around it; give a larger tolerance")
    # keys of the corners: of a torus both pairs of sides are one; of a sphere two sides, and each other one is a pole
    bottom = [-1 - i if torus else -1 for i in range(n)]
    top = [-1 - (n - i) % n if torus else -2 for i in range(n)]
    up = [-1, *(SEAM - j for j in range(1, n))]
    down = [-1 if torus else -2, *(SEAM - (n - j) for j in range(1, n))]
    steps = np.arange(n) / n
    ones = np.ones(n)
    u = np.concatenate([steps, ones, 1.0 - steps, 0.0 * ones])
    v = np.concatenate([0.0 * ones, steps, ones, 1.0 - steps])
    uv = np.column_stack([ROUND * u, ROUND * v if torus else np.pi * (v - 0.5)])
    return uv, np.array([*bottom, *up, *top, *down])


def _opened(
    flat: Flat,
    left: float,
    around: list[tuple[np.ndarray, np.ndarray, np.ndarray]],
    holes: list[np.ndarray],
    tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the polygon of a face that goes around, cut open along a line between its two loops, or to a pole."""
    k = 0 if around[0][2][0] else 1
    other = 1 - k
    if any(abs(w[2][k]) != 1 or w[2][other] for w in around) or len(around) > 2:
        raise ModelError(f"a face on a {flat.surface.kind} winds around it in a way that is not read; save it as .stl")
    period = flat.periods[k]
    assert period is not None
    # the loop that has the face above it, and the one that has it below: left of +u is +v, left of +v is -u
    up = 1.0 if k == 0 else -1.0
    lower = [w for w in around if w[2][k] * left * up > 0]
    upper = [w for w in around if w[2][k] * left * up < 0]
    if len(around) == 2 and (len(lower) != 1 or len(upper) != 1):
        raise ModelError(f"two loops of a face on a {flat.surface.kind} go around it the same way; save it as .stl")
    pair = []
    for found, is_lower in ((lower, True), (upper, False)):
        if found:
            uv, index = found[0][0], found[0][1]
            if uv[-1, k] < uv[0, k]:
                uv, index = uv[::-1], index[::-1]
            pair.append((uv, index))
        else:
            pair.append(_pole(flat, k, is_lower, around[0][0], period))
    (low_uv, low_index), (high_uv, high_index) = pair
    turn = flat.periods[other]
    if turn is not None:
        gap = np.mean(high_uv[:, other]) - np.mean(low_uv[:, other])
        high_uv = high_uv - np.floor(gap / turn) * turn * np.eye(2)[other]
    a, b, shift = _bridge(flat, k, low_uv, high_uv, holes, period)
    e = np.eye(2)[k]
    low_uv, low_index = _from(low_uv, low_index, a, period * e)
    high_uv, high_index = _from(high_uv, high_index, b, period * e)
    high_uv = high_uv + shift * e
    line, line_index = _line(flat, low_uv[0], high_uv[0], tolerance)
    ring = np.vstack([low_uv, line + period * e, high_uv[::-1], line[::-1]])
    index = np.concatenate([low_index, line_index, high_index[::-1], line_index[::-1]])
    return ring, index


def _pole(flat: Flat, k: int, lower: bool, loop: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the side of a face at a pole: one point for all u."""
    at = loop[:, 1 - k]
    choices = [p for p in flat.surface.poles if (p < at.min() if lower else p > at.max())]
    if k != 0 or not choices:
        raise ModelError(f"a face on a {flat.surface.kind} goes around but has one side only; save the solid as .stl")
    pole = max(choices) if lower else min(choices)
    return np.array([[loop[:, 0].min(), pole], [loop[:, 0].min() + period, pole]]), np.array([-2, -2])


def _bridge(
    flat: Flat, k: int, low: np.ndarray, high: np.ndarray, holes: list[np.ndarray], period: float
) -> tuple[int, int, float]:
    """Return points of both loops that a line joins without crossing a loop, and the shift of the upper one."""
    spans = np.ptp(np.vstack([low, high]), axis=0)
    spans[spans == 0.0] = 1.0
    a_segments = [np.stack([p, np.roll(p, -1, axis=0)], axis=1) for p in holes if len(p)]
    chains = [np.stack([c[:-1], c[1:]], axis=1) for c in (low, high)]
    e = np.eye(2)[k]
    moved = [s + m * period * e for s in (*a_segments, *chains) for m in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    segments = np.concatenate(moved)
    candidates = []
    for i, p in enumerate(low[:-1]):
        q = high[:-1]
        shift = np.round((p[k] - q[:, k]) / period) * period
        off = np.abs(p[k] - q[:, k] - shift)
        candidates += [(float(off[j]), i, j, float(shift[j])) for j in range(len(q))]
    for _, i, j, shift in sorted(candidates)[:4000]:
        if not _crosses(low[i] / spans, (high[j] + shift * e) / spans, segments / spans):
            return i, j, shift
    raise ModelError(f"a face on a {flat.surface.kind} cannot be cut open between its loops; save the solid as .stl")


def _crosses(p: np.ndarray, q: np.ndarray, segments: np.ndarray) -> bool:
    """Return whether a line from p to q meets a segment elsewhere than at its own ends."""
    a, b = segments[:, 0], segments[:, 1]

    def side(o: np.ndarray, d: np.ndarray, x: np.ndarray) -> np.ndarray:
        return d[..., 0] * (x[..., 1] - o[..., 1]) - d[..., 1] * (x[..., 0] - o[..., 0])

    sa, sb = side(p, q - p, a), side(p, q - p, b)
    sp, sq = side(a, b - a, p[None]), side(a, b - a, q[None])
    tiny = 1e-12
    own = (np.abs(a - p).sum(axis=1) < tiny) | (np.abs(b - p).sum(axis=1) < tiny)
    own |= (np.abs(a - q).sum(axis=1) < tiny) | (np.abs(b - q).sum(axis=1) < tiny)
    hit = (sa * sb <= tiny**2) & (sp * sq <= tiny**2) & ~own
    # a segment at one of the ends must not lie along the line
    if np.any(hit):
        return True
    length = float(np.sum((q - p) ** 2))
    far = np.where(np.abs(a - p).sum(axis=1) < tiny, 1, 0)
    ends = np.where(far[:, None] == 1, b, a)[own]
    along = np.abs(side(p, q - p, ends)) < 1e-9 * max(length, 1e-300)
    part = (ends - p) @ (q - p) / max(length, 1e-300)
    return bool(np.any(along & (part > 1e-9) & (part < 1.0 - 1e-9)))


def _from(uv: np.ndarray, index: np.ndarray, start: int, period: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a chain around, from another of its points on; the last point is the first, a period further."""
    uv = np.vstack([uv[start:-1], uv[:start] + period, uv[start : start + 1] + period])
    return uv, np.r_[index[start:-1], index[:start], index[start]]


def _line(flat: Flat, a: np.ndarray, b: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the inner points of a cut from a to b, and their keys, alike on both sides of the cut."""
    n = 1
    while n < 4096:
        t = np.linspace(0.0, 1.0, 2 * n + 1)[:, None]
        p = flat.to_space((1 - t) * a + t * b)
        if np.linalg.norm(p[1::2] - 0.5 * (p[:-1:2] + p[2::2]), axis=1).max() <= tolerance:
            break
        n *= 2
    t = np.linspace(0.0, 1.0, n + 1)[1:-1, None]
    return (1 - t) * a + t * b, SEAM - np.arange(n - 1)
