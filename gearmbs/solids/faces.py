"""Faces cut into triangles in the parameters of their surfaces.

The loops of a face, as chains of points shared with its neighbours, are the sides of polygons in the plane of u and v;
a constrained Delaunay triangulation fills them, and points are added on its inner edges until these stay within the
tolerance of the surface.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.solids.surfaces import ROUND, TURN, Flat, FromPoint, Surface, Turned, area, free_point

# Loops of a face as polygons in the plane of its parameters.
#
# A face that goes around is cut open along a line between two of its loops, or from a loop to a pole.


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


ROUNDS = 14
"""Times that points are added."""
KEY = 1_000_000
"""More than the points of a face: makes one number of a pair of them."""
CHUNK = 500
"""Points that are compared with all sides at a time."""
MOST = 200_000
"""Points of a face."""


class Crossed(ModelError):
    """The chains of points of a face's edges cross, as where arcs are closer to each other than to their chords."""


def cut(
    surface: Surface, outward: float, loops: list[np.ndarray], places: np.ndarray, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cut a face into triangles.

    Parameters
    ----------
    surface : Surface
    outward : float
        1 if the normal of the surface points out of the body, else -1.
    loops : list of ndarray of int
        Numbers of the points around each loop, the face on the left seen from outside.
    places : ndarray, shape (n, 3)
        Points of the body's edges, m.
    tolerance : float
        Largest distance of a triangle's edges from the surface, m.

    Returns
    -------
    added : ndarray, shape (k, 3)
        Points inside the face; their numbers go on from n.
    triangles : ndarray of int, shape (m, 3)
        Anticlockwise seen from outside.

    Raises
    ------
    ModelError
        If the loops cross.
    """
    left = outward * surface.sense
    if loops:
        edge = places[np.unique(np.concatenate(loops))]
        off = np.linalg.norm(surface.points(surface.project(edge)) - edge, axis=1).max()
        if off > max(tolerance, 1e-6):
            raise ModelError(f"its edges are {off:.3g} m off its {surface.kind}; the file contradicts itself")
    if surface.kind == "SPHERE" and loops:
        assert isinstance(surface, Turned)
        flat: Flat = FromPoint(surface, free_point(surface, left, loops, places))
    else:
        flat = Flat(surface)
    polygons, numbers = polygons_of(flat, left, loops, places, tolerance)
    new_places = _Places(places)
    uv: list[np.ndarray] = []
    index: list[int] = []
    sides: list[np.ndarray] = []
    for polygon, number in zip(polygons, numbers, strict=True):
        start = sum(len(p) for p in uv)
        count = len(polygon)
        uv.append(polygon)
        index += [new_places.number(n, flat, p) for n, p in zip(number, polygon, strict=True)]
        sides.append(np.column_stack([start + np.arange(count), start + (np.arange(count) + 1) % count]))
    return _filled(
        flat, surface, left, *_joined(np.vstack(uv), np.array(index), np.vstack(sides)), new_places, tolerance
    )


def _joined(uv: np.ndarray, index: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return polygons whose common corners, where loops touch, are one."""
    size = max(float(np.ptp(uv, axis=0).max()), 1e-300)
    keys = np.column_stack([np.round(uv / (1e-9 * size)), index])
    _, first, back = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return uv[first], index[first], back.reshape(-1)[sides]


class _Places:
    """Points of a face: those of its edges, and those added inside."""

    def __init__(self, places: np.ndarray) -> None:
        self.first = len(places)
        self.known = places
        self.added: list[np.ndarray] = []
        self._of_key: dict[int, int] = {}

    def number(self, number: int, flat: Flat, uv: np.ndarray) -> int:
        """Return the number of a point of a polygon; a negative one is a key of a point that is still to be made."""
        if number >= 0:
            return int(number)
        if number not in self._of_key:
            self._of_key[number] = self.add(flat.to_space(uv[None])[0])
        return self._of_key[number]

    def add(self, place: np.ndarray) -> int:
        self.added.append(place)
        return self.first + len(self.added) - 1

    def all(self) -> np.ndarray:
        return np.vstack([self.known, *[p[None] for p in self.added]]) if self.added else self.known


def _scales(flat: Flat, uv: np.ndarray, tolerance: float) -> np.ndarray:
    """Return by what u and v are multiplied, so that lengths count chords whose sag is the tolerance."""
    low, high = uv.min(axis=0), uv.max(axis=0)
    spans = np.maximum(high - low, 1e-12)
    t = np.linspace(0.05, 0.95, 7)
    out = np.empty(2)
    for k in range(2):
        step = 0.02 * spans[k]
        grid = np.stack(np.meshgrid(low[0] + t * spans[0], low[1] + t * spans[1]), axis=-1).reshape(-1, 2)
        d = step * np.eye(2)[k]
        bend = (
            np.linalg.norm(flat.to_space(grid + d) - 2.0 * flat.to_space(grid) + flat.to_space(grid - d), axis=1).max()
            / step**2
        )
        chord = np.sqrt(8.0 * tolerance / max(bend, 1e-300))
        # no direction counts as less than one chord in all
        out[k] = 1.0 / min(chord, spans[k])
    return out


def _seeds(flat: Flat, uv: np.ndarray, sides: np.ndarray, scale: np.ndarray, tolerance: float) -> np.ndarray:
    """Return points inside polygons, about as far apart as chords whose sag is the tolerance."""
    low, high = uv.min(axis=0), uv.max(axis=0)
    if isinstance(flat, FromPoint):
        chord = min(TURN, np.sqrt(8.0 * tolerance / flat.radius)) / np.sqrt(2.0)
        k = np.arange(min(int(4.0 * np.pi / chord**2), MOST))
        z = 1.0 - (2.0 * k + 1.0) / max(len(k), 1)
        phi = k * np.pi * (3.0 - np.sqrt(5.0))
        ring = np.sqrt(1.0 - z**2)
        directions = np.column_stack([ring * np.cos(phi), ring * np.sin(phi), z])
        directions = directions[directions @ flat.away < 0.999]
        seeds = flat.to_plane(flat.centre + flat.radius * directions)
        # lengths in the plane are larger than on the ball of radius 1 by this
        size = chord * (1.0 + 0.25 * np.sum(seeds**2, axis=1))
    else:
        count = np.ceil((high - low) * scale - 1e-9)
        if count.min() > 1.0:
            # a cell's diagonal bends in both directions
            count = np.ceil(np.sqrt(2.0) * count)
        if np.prod(np.maximum(count - 1.0, 1.0)) > MOST:
            raise ModelError(f"a face on a {flat.surface.kind} needs more than {MOST} points; give a larger tolerance")
        u, v = (low[k] + (high[k] - low[k]) * np.arange(1, int(count[k])) / count[k] for k in range(2))
        seeds = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2) * scale
        uv = uv * scale
        size = np.full(len(seeds), 1.0)
    a, b = uv[sides[:, 0]], uv[sides[:, 1]]
    kept = [np.zeros((0, 2))]
    for part in range(0, len(seeds), CHUNK):
        p, reach = seeds[part : part + CHUNK, None], size[part : part + CHUNK]
        along = b - a
        t = np.clip(np.sum((p - a) * along, axis=2) / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
        apart = np.linalg.norm(a + t[..., None] * along - p, axis=2).min(axis=1)
        cross = (a[:, 1] > p[..., 1]) != (b[:, 1] > p[..., 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            at = a[:, 0] + (p[..., 1] - a[:, 1]) * along[:, 0] / along[:, 1]
        inside = np.sum(cross & (p[..., 0] < at), axis=1) % 2 == 1
        kept.append(seeds[part : part + CHUNK][inside & (apart > 0.4 * reach)])
    return np.vstack(kept) / (1.0 if isinstance(flat, FromPoint) else scale)


def _filled(
    flat: Flat,
    surface: Surface,
    left: float,
    uv: np.ndarray,
    index: np.ndarray,
    sides: np.ndarray,
    new_places: _Places,
    tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Fill polygons with triangles whose inner edges are within the tolerance of the surface."""
    plane = surface.kind == "PLANE"
    scale = np.ones(2) / max(float(np.ptp(uv, axis=0).max()), 1e-12)
    if isinstance(flat, FromPoint):
        scale = np.ones(2)
    elif not plane:
        scale = _scales(flat, uv, tolerance)
    if not plane:
        within = _seeds(flat, uv, sides, scale, tolerance)
        index = np.concatenate([index, [new_places.add(p) for p in flat.to_space(within)]]).astype(np.int64)
        uv = np.vstack([uv, within])
    ends = np.sort(sides, axis=1)
    fixed = ends[:, 0] * KEY + ends[:, 1]
    for _ in range(ROUNDS):
        triangles = triangulated(uv * scale, sides)
        if plane:
            break
        inner = np.unique(
            np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])), axis=0
        )
        inner = inner[~np.isin(inner[:, 0] * KEY + inner[:, 1], fixed)]
        if not len(inner):
            break
        middle = 0.5 * (uv[inner[:, 0]] + uv[inner[:, 1]])
        x = new_places.all()
        there = flat.to_space(middle)
        sag = np.linalg.norm(there - 0.5 * (x[index[inner[:, 0]]] + x[index[inner[:, 1]]]), axis=1)
        deep = sag > 1.05 * tolerance
        if not deep.any():
            break
        if len(uv) + deep.sum() > MOST:
            raise ModelError(f"a face on a {surface.kind} needs more than {MOST} points; give a larger tolerance")
        index = np.r_[index, [new_places.add(p) for p in there[deep]]]
        uv = np.vstack([uv, middle[deep]])
    triangles = triangles if left > 0.0 else triangles[:, ::-1]
    added = np.array(new_places.added).reshape(-1, 3)
    out = index[triangles]
    a, b, c = out.T
    return added, out[(a != b) & (b != c) & (c != a)]


def triangulated(points: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return triangles, anticlockwise, of what lies within polygons: in one, out of a second inside it, and so on.

    Raises
    ------
    ModelError
        If the library is not there, sides cross or points coincide.
    """
    try:
        import pythoncdt as cdt
    except ImportError:
        raise ModelError(
            "solids with curved or notched faces are cut by pythoncdt: pip install 'gearmbs[solids]'"
        ) from None
    t = cdt.Triangulation(cdt.VertexInsertionOrder.AUTO, cdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0)
    try:
        t.insert_vertices(np.ascontiguousarray(points, dtype=np.float64))  # type: ignore[call-overload]
        t.insert_edges(np.ascontiguousarray(sides, dtype=np.uint32))  # type: ignore[call-overload]
        t.erase_outer_triangles_and_holes()
    except (RuntimeError, ValueError) as error:
        raise Crossed(f"its edges cross or meet: {str(error).splitlines()[0]}") from None
    found = t.triangles_array()
    return np.array(found["vertices"], dtype=np.int64).reshape(-1, 3)
