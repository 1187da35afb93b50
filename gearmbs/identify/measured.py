"""From recordings to what is fitted: tables of mesh harmonics with their scatter, through the band-pass and window of
the cases, and fits described in files: recordings, the cases that model them, what is free.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np

from gearmbs.identify.cases import WAYS, CaseProblem
from gearmbs.identify.parameters import Free, IdentifyError
from gearmbs.identify.tables import COLUMNS
from gearmbs.schema.described import check_keys, chosen, make, read_toml
from gearmbs.schema.quantities import Measure

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.signals.analysis.bands import MeshKeywords
    from gearmbs.studies import Case

SECTIONS = (
    "recording", "case", "free", "measured", "gains", "channels", "starts", "workers", "experiment", "derivatives_by",
    "store",
)  # fmt: skip
LEVELS = ("harmonics", "way", "sections", "floor")
FORMS: tuple[tuple[str, type, type], ...] = (
    ("recording", dict, str), ("case", dict, dict), ("free", list, dict), ("measured", dict, object),
    ("channels", dict, str), ("experiment", dict, dict),
)  # fmt: skip
"""Sections of a file, and of what they consist."""


def harmonic_table(
    signals: Mapping[str, xr.DataArray],
    *,
    harmonics: int = 3,
    way: Literal["band", "orders"] = "band",
    sections: int = 8,
    floor: float = 0.02,
    channels: Sequence[str] | None = None,
    **settings: Unpack[MeshKeywords],
) -> pd.DataFrame:
    """Return the RMS of the mesh harmonics of recordings with their relative standard deviations.

    Each recording is cut into sections; value and scatter are those of the sections' levels. The standard deviation
    is that of
    the mean, but at least ``floor``: what is systematic does not average out.

    Parameters
    ----------
    signals : mapping of str to DataArray
        Recordings by the name of the case that models them; dimensions (time, channel).
    harmonics : int
    way : {"band", "orders"}
        Through the band-pass about each harmonic, or by lines at the orders; see `gearmbs.signals.gmf_rms`.
    sections : int
    floor : float
        Least relative standard deviation, positive.
    channels : str or sequence of str, optional
        Default all.
    **settings
        For `gmf_rms`: ``gmf``, ``speed``, ``teeth``.

    Returns
    -------
    DataFrame
        With the columns `COLUMNS`.

    Raises
    ------
    IdentifyError
        For whatever is none of these.
    """
    import pandas as pd

    from gearmbs.signals import gmf_rms

    rows = []
    if not isinstance(signals, Mapping) or not signals:
        raise IdentifyError("signals: give recordings by the name of the case that models them, {name: signal}")
    sections, harmonics = _whole(sections, "sections"), _whole(harmonics, "harmonics")
    chosen(WAYS, way, "", IdentifyError, "way")
    if not 0.0 < floor < np.inf:
        raise IdentifyError(f"floor = {floor!r}; give the least relative standard deviation, as 0.02")
    wanted = (channels,) if isinstance(channels, str) else channels
    for case, signal in signals.items():
        if "channel" not in getattr(signal, "dims", ()) or "time" not in signal.dims:
            raise IdentifyError(f"signals: {case} is no signal with time and channels; read it by gearmbs.read_signal")
        names = [str(c) for c in signal.channel.values]
        for name in wanted or ():
            chosen(names, name, f"signals: {case}: ", IdentifyError, "channel")
        size = signal.sizes["time"] // sections
        levels = []
        for k in range(sections):
            part = signal.isel(time=slice(k * size, (k + 1) * size))
            part = part - part.mean("time")
            part.attrs.update(signal.attrs)
            levels.append(gmf_rms(part, harmonics=harmonics, **settings)[way].transpose("harmonic", "channel").values)
        stack = np.array(levels)
        mean = np.sqrt((stack**2).mean(axis=0))
        scatter = stack.std(axis=0, ddof=1) / np.sqrt(sections) / mean if sections > 1 else np.zeros_like(mean)
        for j, name in enumerate(names):
            if wanted is not None and name not in wanted:
                continue
            for h in range(harmonics):
                sigma = float(max(scatter[h, j], floor))
                rows.append((case, name, h + 1, float(mean[h, j]), sigma))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def load_problem(path: str | Path) -> tuple[CaseProblem, dict[str, Any]]:
    """Read a fit in TOML; return its problem and the settings of the search.

    ``[recording]`` names a file for each case, ``[case.NAME]`` the case that models it, with what all have in common
    under
    ``[case.all]``; ``[measured]`` says how recordings are read and cut; each ``[[free]]`` is a parameter;
    ``channels`` says which
    component of the force stands for which channel; ``store`` names a folder beside the file, ``derivatives_by`` is as
    of `CaseProblem`; ``[experiment.NAME]`` may list changes of the first case for `rank_experiments`. A recording may
    be a CSV table of harmonics, too.

    Raises
    ------
    IdentifyError
        For unknown keys, missing parts, and whatever is wrong with them.
    """
    path = Path(path)
    tree = read_toml(path, IdentifyError)
    check_keys(tree, SECTIONS, str(path), IdentifyError)
    for key in ("recording", "free"):
        if not tree.get(key):
            raise IdentifyError(f"{path}: [{key}] is missing")
    for key, form, inner in FORMS:
        if not isinstance(found := tree.get(key, form()), form) or not all(isinstance(v, inner) for v in _items(found)):
            raise IdentifyError(f"{path}: {key} = {found!r:.60} is none; see the page on identification for its form")
    measured = dict(tree.get("measured", {}))
    way = str(measured.get("way", "band"))
    table = _table(tree["recording"], measured, path.parent, tuple(tree.get("channels", {})))
    free = [_free(item, path) for item in tree["free"]]
    problem = CaseProblem(
        table,
        _cases(tree.get("case", {}), tree["recording"]),
        free,
        gains=tree.get("gains", "channel"),
        channels=tree.get("channels"),
        way=way,
        workers=_whole(tree.get("workers", 1), "workers"),
        derivatives_by=tree.get("derivatives_by", "steady"),
        store=None if "store" not in tree else path.parent / str(tree["store"]),
    )
    return problem, {"starts": _whole(tree.get("starts", 1), "starts"), "experiments": tree.get("experiment")}


def _items(found: Any) -> Collection:
    return found.values() if isinstance(found, dict) else found


def _whole(value: Any, name: str) -> int:
    """Return a whole number, 1 or more."""
    try:
        return int(Measure(low=1, whole=True).as_given(value))
    except ValueError as error:
        raise IdentifyError(f"{name} = {value!r}; {error}") from None


def _free(item: dict[str, Any], path: Path) -> Free | str:
    """Return a parameter of the file; a path alone starts at its case's value."""
    settings = dict(item)
    if "path" not in settings:
        raise IdentifyError(f"{path}: [[free]]: path is missing; write for instance contact.depth")
    name = settings.pop("path")
    return make(Free, settings, f"{path}: [[free]]: {name}", IdentifyError, name=name) if settings else name


def _cases(given: dict[str, Any], recordings: dict[str, str]) -> dict[str, Case]:
    """Return the case of each recording: what all have in common, changed by its own."""
    from gearmbs.studies import make_case

    common = given.get("all", {})
    for name in given:
        if name != "all" and name not in recordings:
            raise IdentifyError(f"[case.{name}]: no recording has this name; write all, {', '.join(recordings)}")
    cases = {}
    for name in recordings:
        data = {section: dict(values) if isinstance(values, dict) else values for section, values in common.items()}
        for section, values in given.get(name, {}).items():
            data[section] = {**data.get(section, {}), **values} if isinstance(values, dict) else values
        cases[name] = make_case({**data, "name": name}, name)
    return cases


def _table(
    recordings: dict[str, str], measured: dict[str, Any], folder: Path, channels: tuple[str, ...]
) -> pd.DataFrame:
    """Return the harmonics of all recordings."""
    import pandas as pd

    from gearmbs.signals import estimate_speed
    from gearmbs.signals.files.simulated import read_any
    from gearmbs.units import to_si

    levels = {key: measured.pop(key) for key in LEVELS if key in measured}
    if "speed" in measured:
        measured["speed"] = to_si(measured["speed"], "angular speed", "measured.speed")
    if isinstance(measured.get("teeth"), list):
        measured["teeth"] = tuple(measured["teeth"])
    parts = []
    for name, file in recordings.items():
        place = folder / file
        if place.suffix == ".csv" and place.exists():
            with place.open(encoding="utf-8") as lines:
                head = lines.readline()
            if "harmonic" in head:
                parts.append(pd.read_csv(place).assign(case=name))
                continue
        try:
            signal = read_any(place, **measured)
        except TypeError as error:
            word = str(error).rpartition("argument ")[2]
            raise IdentifyError(
                f"[measured]: unknown key {word}; see gearmbs.read_signal for those there are"
            ) from None
        if "speed" not in signal.attrs:
            signal.attrs["speed"] = estimate_speed(signal).speed
        parts.append(harmonic_table({name: signal}, channels=channels or None, **levels))
    return pd.concat(parts, ignore_index=True)
