"""Experiment against model as in section 4 of the paper: scale, band-pass, compare state by state and load by load."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
import xarray as xr

from gearmbs.progress import staged
from gearmbs.signals.analysis.analysis import analyse
from gearmbs.signals.analysis.bands import HALF_WIDTH
from gearmbs.signals.analysis.comparison_report import ComparisonReport
from gearmbs.signals.analysis.report import LOUD, AnalysisReport
from gearmbs.signals.conversion import Dimension, convert, rms_within
from gearmbs.signals.errors import SignalError
from gearmbs.signals.optical import instrument_faults, turn_floor
from gearmbs.signals.signal.inputs import Given, Units, to_signal
from gearmbs.signals.signal.signal import like, rate_of, require
from gearmbs.units import to_si

Progress = Callable[[float, str], None]
States = Mapping[str, Mapping[str, Any]]
Scope = Literal["load", "all", "each"]
FEATURES = ("kurtosis", "fm4", "energy_ratio", "sideband_level")


class CompareKeywords(TypedDict, total=False):
    """Keywords of `compare` but for what is known of the experiment, for type checkers."""

    gaps: str | None
    reference: str
    scope: Scope
    channel: str | None
    model_channel: str | None
    way: Literal["band", "orders"]
    harmonics: int
    half_width: float
    wheel: int
    quantity: Dimension | None
    band: tuple[Any, Any] | None
    progress: Progress | None


@staged("comparing")
def compare(
    experiment: States | Mapping[str, Any],
    model: States | Mapping[str, Any] | None = None,
    *,
    rate: Given | None = None,
    units: Units | None = None,
    teeth: int | Sequence[int] | None = None,
    speed: Any = None,
    gaps: str | None = None,
    reference: str = "healthy",
    scope: Scope = "load",
    channel: str | None = None,
    model_channel: str | None = None,
    way: Literal["band", "orders"] = "band",
    harmonics: int = 3,
    half_width: float = HALF_WIDTH,
    wheel: int = 1,
    quantity: Dimension | None = None,
    band: tuple[Any, Any] | None = None,
    progress: Progress | None = None,
) -> ComparisonReport:
    """Compare the gear mesh harmonics of states and loads, measured and simulated.

    For every load and state the RMS of the first GMF harmonics is taken (`analyse`). The model's are multiplied by
    the ratio of the mean-free RMS, experiment over model, of the whole records, or of what both have in ``band``.

    Parameters
    ----------
    experiment : mapping of load to mapping of state to record
        E.g. {"low": {"healthy": s1, "misaligned": s2}, "high": {...}}, loads from low to high, or of one load
        {"healthy": s1, "misaligned": s2}. Records are data of any shape (`to_signal`): signals, arrays, tables, files.
        Each needs `teeth`; its speed is used if it has one, and found from the mesh line otherwise.
    model : the same, optional
        Without it the report says what each state does to the experiment. Its loads and states must cover some of the
        experiment's; the rest is left out and named.
    rate, units, teeth, speed, gaps : optional
        What the records of the experiment do not say themselves, as for `to_signal`.
    reference : str
        The state the others are held against.
    scope : {"load", "all", "each"}
        Which records set the scaling factor: "load", the reference state at each load (its factor kept for the faults);
        "all", the reference state at the first load, for everything; "each", every record its own.
    channel, model_channel : str, optional
        Channel to compare; needed with a model where a signal has more than one.
    way : {"band", "orders"}
        RMS in the band (the paper's) or of the line alone.
    harmonics, half_width
        As for `gmf_rms`.
    wheel : int
        Whose shaft the indicators follow (`analyse`).
    quantity : {"displacement", "velocity", "acceleration"}, optional
        To convert the experiment to (`convert`), as the paper did with the velocity of its laser.
    band : (float or str, float or str), optional
        For it, Hz: outside nothing is left. The model's RMS for the factor is that within it.
    progress : callable, optional
        Called as progress(fraction, stage); without it a bar is shown where somebody watches, see `gearmbs.progress`.

    Returns
    -------
    ComparisonReport

    Raises
    ------
    SignalError
        If the reference is missing at a load, a channel is not named, or the units of experiment and model are of
        different kinds.
    MissingMetadataError
        If a signal does not know its tooth count.
    """
    if scope not in ("load", "all", "each"):
        raise SignalError(f"scope: must be 'load', 'all' or 'each', got {scope!r}")
    if way not in ("band", "orders"):
        raise SignalError(f"way: must be 'band' or 'orders', got {way!r}")
    if band is not None and quantity is None:
        raise SignalError(
            f"band: {band} is that of a conversion, and nothing is converted; give quantity='acceleration', say "
            "(--as acceleration), or leave band out"
        )
    experiment = _signals(experiment, rate=rate, units=units, teeth=teeth, speed=speed, gaps=gaps)
    if quantity is not None:
        # a conversion hides what instruments did, which an analysis remarks on
        experiment = {
            load: {state: _remarked(signal) for state, signal in states.items()} for load, states in experiment.items()
        }
        experiment = _converted(experiment, quantity, band)
    model = None if model is None else _signals(model)
    loads, states, left_out = _common_cases(experiment, model, reference)
    sides = [("experiment", experiment, channel)] + ([] if model is None else [("model", model, model_channel)])
    kept = [(load, s) for load in loads for s in states if all(s in cases[load] for _, cases, _ in sides)]
    total = len(kept) * len(sides)
    done = 0

    def tell(fraction: float, stage: str) -> None:
        if progress is not None:
            progress((done + fraction) / total, stage)

    found: dict[str, dict[tuple[str, str], xr.Dataset]] = {}
    notes: list[str] = []
    for side, cases, pick in sides:
        found[side] = {}
        for load, state in kept:
            signal = _picked(cases[load][state], pick, side, single=model is not None)
            report, found[side][load, state] = _features(signal, harmonics, half_width, way, wheel, tell)
            if side == "model" and band is not None:
                found[side][load, state]["level"] = _level_within(signal, band)
            done += 1
            if side == "experiment":
                own = signal.attrs.get("notes", ()) if quantity is not None else ()
                told = [note for note in report.notes if note.startswith(LOUD) or "drop-outs" in note or note in own]
                notes += [
                    f"{state} at load {load}: {note}" for note in sorted(told, key=lambda n: not n.startswith(LOUD))
                ]
    notes = _other_speeds(found["experiment"], reference) + notes
    edges = None if band is None else (to_si(band[0], "frequency", "band"), to_si(band[1], "frequency", "band"))
    inside, said = _inside(found["experiment"], edges)
    found = {side: {at: one.sel(harmonic=inside) for at, one in cases.items()} for side, cases in found.items()}
    data = _tabulate(found["experiment"], loads, states, "experiment")
    silent = [str(c) for c, stands in zip(data["channel"].values, _stand(data)) if not stands]
    notes = [*said, *_silence_told(silent, data.sizes["channel"]), *notes]
    if model is not None:
        data = _with_model(data, _tabulate(found["model"], loads, states, "model"), reference, scope)
    data = data.rename(rms="experiment")
    data.attrs.update(reference=reference, scope=scope, way=way, half_width=half_width)
    data.attrs["silent"] = silent if len(silent) < len(data.get("channel", ())) else []
    return ComparisonReport(data, reference, left_out, notes)


SAME_SPEED = 0.05
"""Share by which the mesh frequencies of records of one load may differ: speeds of drives change by 3 % at most with
their load, and a level that grows as the square of the speed by 1 dB, from which it counts as a change, at 6 %."""


STANDS = 3.0
"""Times as high as those beside it from which a mesh line is there: of chance one in 8000 is."""


def _stand(data: xr.Dataset) -> np.ndarray:
    """Return of which channels a mesh line stands out of the orders beside it in any record, or nothing is known."""
    over = data["over_floor"]
    highest = over.max([dim for dim in over.dims if dim != "channel"]).values
    return ~(highest < STANDS)


def _silence_told(silent: Sequence[str], count: int) -> list[str]:
    """Say which channels show no mesh line."""
    if not silent:
        return []
    names = ", ".join(map(repr, silent))
    if len(silent) == count:
        return [
            f"CHECK THE SPEED: no mesh line stands out of what is beside it, on none of {names}: what changes there is "
            "noise, or something else."
        ]
    return [f"{names}: no mesh line stands out of what is beside it in any record; what changes there does not count."]


def _inside(
    found: Mapping[tuple[str, str], xr.Dataset], band: tuple[float, float] | None
) -> tuple[list[int], list[str]]:
    """Return the harmonics within the band (Hz) of a conversion, in all records, and what is said of the others."""
    numbers = [int(k) for k in next(iter(found.values()))["harmonic"].values]
    if band is None:
        return numbers, []
    gmf = [float(one["gmf"]) for one in found.values()]
    inside = [k for k in numbers if k * min(gmf) >= band[0] and k * max(gmf) <= band[1]]
    gone = ", ".join(f"{k} x GMF ({k * max(gmf):.4g} Hz)" for k in numbers if k not in inside)
    if not inside:
        raise SignalError(
            f"band: {gone} {'lie' if len(numbers) > 1 else 'lies'} outside {band[0]:g} to {band[1]:g} Hz, beyond which "
            "the conversion leaves nothing; give a band that holds the harmonics (--band)"
        )
    if not gone:
        return numbers, []
    return inside, [f"{gone}: left out, for the conversion keeps {band[0]:g} to {band[1]:g} Hz alone."]


def _other_speeds(found: Mapping[tuple[str, str], xr.Dataset], reference: str) -> list[str]:
    """Say which records ran at another speed than the reference at their load."""
    said = []
    for (load, state), data in found.items():
        gmf, other = float(found[load, reference]["gmf"]), float(data["gmf"])
        if abs(other / gmf - 1.0) > SAME_SPEED:
            said.append(
                f"CHECK THE SPEED: {state} at load {load} has its mesh at {other:.2f} Hz, {reference} at {gmf:.2f} Hz: "
                "levels change with the speed, and what is told of the state is not the state's alone. Compare records "
                "of one speed."
            )
    return said


def _signals(cases: Mapping[str, Any], **known: Any) -> dict[str, dict[str, xr.DataArray]]:
    """Records by load and state as signals; states alone are those of one load."""
    nested = [isinstance(value, Mapping) and not isinstance(value, xr.Dataset) for value in cases.values()]
    if not cases or (any(nested) and not all(nested)):
        raise SignalError("experiment: give records by state, {'healthy': ...}, or by load and state, {'low': {...}}")
    loads = cases if all(nested) else {"all": cases}
    return {
        str(load): {str(state): to_signal(data, **known) for state, data in states.items()}
        for load, states in loads.items()
    }


def _converted(
    experiment: States, quantity: Dimension, band: tuple[Any, Any] | None
) -> dict[str, dict[str, xr.DataArray]]:
    """Return the records as one quantity, each channel that is of motion."""
    if band is None:
        raise SignalError(
            f"band: {quantity} of records in other quantities needs the band in which it is wanted; give for instance "
            "band=('100 Hz', '5 kHz')"
        )
    low, high = (to_si(edge, "frequency", "band") for edge in band)
    return {
        load: {state: convert(signal, quantity, band=(low, high)) for state, signal in states.items()}
        for load, states in experiment.items()
    }


def _level_within(signal: xr.DataArray, band: tuple[Any, Any]) -> tuple[str, np.ndarray]:
    """Return the RMS of each channel within a band, beyond which the experiment has nothing either."""
    low, high = (to_si(edge, "frequency", "band") for edge in band)
    return "channel", np.array([rms_within(column, rate_of(signal), (low, high)) for column in signal.values.T])


def _remarked(signal: xr.DataArray) -> xr.DataArray:
    """Return a signal with remarks on what its instrument did to it."""
    remarks = instrument_faults(signal)
    return signal.assign_attrs(notes=[*signal.attrs.get("notes", ()), *remarks]) if remarks else signal


def _with_model(data: xr.Dataset, model: xr.Dataset, reference: str, scope: str) -> xr.Dataset:
    """Put the model's levels beside the experiment's, scaled."""
    data, model = data.isel(channel=0, drop=True), model.isel(channel=0, drop=True)
    units = (data.attrs["units"], model.attrs["units"])
    if units[0] != units[1] and "unknown" not in units:
        raise SignalError(
            f"units: the experiment is in {units[0]!r}, the model in {units[1]!r}; "
            "bring both to one with convert or force_to_acceleration"
        )
    factor = _factors(data["level"], model["level"], reference, scope)
    data["model"] = model["rms"] * factor
    data["factor"] = factor
    data["model_unscaled"] = model["rms"]
    data["model_gmf"] = model["gmf"]
    return data


def compare_files(
    experiment: Mapping[str, Mapping[str, str | Path]],
    model: Mapping[str, Mapping[str, str | Path]] | None = None,
    *,
    teeth: int | Sequence[int] | None = None,
    rate: Given | None = None,
    units: Units | None = None,
    speed: Any = None,
    **settings: Unpack[CompareKeywords],
) -> ComparisonReport:
    """Read the files and `compare` them, which takes files as well.

    Parameters
    ----------
    experiment, model : mapping of load to mapping of state to path
    teeth, rate, units, speed
        Metadata that the experiment's files lack (`read_signal`); the model's files must know theirs.
    **settings
        The settings of `compare`.

    Returns
    -------
    ComparisonReport
    """
    return compare(experiment, model, teeth=teeth, rate=rate, units=units, speed=speed, **settings)


def _common_cases(experiment: States, model: States | None, reference: str) -> tuple[list[str], list[str], list[str]]:
    sides = [("experiment", experiment)] + ([] if model is None else [("model", model)])
    loads = [load for load in experiment if model is None or load in model]
    if not loads:
        raise SignalError(f"loads: experiment {list(experiment)} and model {list(model or {})} have none in common")
    left_out = [f"load {load!r} of the {n}" for n, side in sides for load in side if load not in loads]
    states: list[str] = [reference]
    for load in loads:
        for name, side in sides:
            if reference not in side[load]:
                raise SignalError(
                    f"reference: the {name} at load {load!r} has no state {reference!r}, only {list(side[load])}; "
                    "say which of them the others are held against: reference=... (--reference)"
                )
        for state in experiment[load]:
            if all(state in side[load] for _, side in sides):
                if state not in states:
                    states.append(state)
            else:
                left_out.append(f"state {state!r} at load {load!r} of the experiment")
        if model is not None:
            left_out += [f"state {s!r} at load {load!r} of the model" for s in model[load] if s not in experiment[load]]
    return loads, states, left_out


def _picked(signal: xr.DataArray, channel: str | None, side: str, single: bool) -> xr.DataArray:
    names = [str(c) for c in signal["channel"].values]
    if channel is not None:
        if channel not in names:
            raise SignalError(f"channel: the {side} has no {channel!r}, only {names}")
        return signal[:, [names.index(channel)]]
    if single and len(names) > 1:
        keyword = "channel" if side == "experiment" else "model_channel"
        raise SignalError(f"{keyword}: name the {side}'s channel to compare, one of {names}")
    return signal


def _features(
    signal: xr.DataArray, harmonics: int, half_width: float, way: str, wheel: int, tell: Progress
) -> tuple[AnalysisReport, xr.Dataset]:
    require(signal, "teeth", needed_for="the gear mesh frequency")
    report = analyse(signal, harmonics=harmonics, half_width=half_width, wheel=wheel, lines=1, progress=tell)
    assert isinstance(report, AnalysisReport)
    found = report.harmonics.sizes["harmonic"]
    if found < harmonics:
        raise SignalError(
            f"harmonics: only {found} of {harmonics} fit below half the sampling rate of {report.source!r}; "
            "ask for fewer"
        )
    data = xr.Dataset({"rms": report.harmonics[way].drop_vars(["frequency", "channel_units"])})
    floor = None if report.average is None else turn_floor(report.average, _teeth(signal, wheel), harmonics)
    dims = ("harmonic", "channel")
    unknown = np.full((harmonics, signal.sizes["channel"]), np.nan)
    for name, end in (("least", "low"), ("most", "high")):
        # of the line alone; what is in the band beside it moves as it does
        share = unknown if floor is None else floor[end] / floor["rms"]
        data[name] = data["rms"] * xr.DataArray(share, dims=dims)
    with np.errstate(divide="ignore", invalid="ignore"):
        data["over_floor"] = (dims, unknown if floor is None else floor["rms"] / floor["floor"])
    data["level"] = report.levels["rms"]
    data["gmf"] = report.gmf
    for name in FEATURES:
        if report.indicators is not None:
            data[name] = report.indicators[name]
        else:
            data[name] = ("channel", np.full(signal.sizes["channel"], np.nan))
    data.attrs["units"] = report.harmonics["band"].attrs["units"]
    return report, data


def _teeth(signal: xr.DataArray, wheel: int) -> int:
    """Return the teeth of the wheel that averages follow."""
    counts = require(signal, "teeth", needed_for="the gear mesh frequency")
    return counts[min(wheel, len(counts)) - 1]


def _tabulate(found: dict[tuple[str, str], xr.Dataset], loads: list[str], states: list[str], side: str) -> xr.Dataset:
    first = next(iter(found.values()))
    for (load, state), one in found.items():
        if one["channel"].values.tolist() != first["channel"].values.tolist():
            raise SignalError(
                f"channels: {state!r} at load {load!r} of the {side} has {one['channel'].values.tolist()}, "
                f"others have {first['channel'].values.tolist()}"
            )
        if one.attrs["units"] != first.attrs["units"]:
            raise SignalError(
                f"units: {state!r} at load {load!r} of the {side} is in {one.attrs['units']!r}, "
                f"others are in {first.attrs['units']!r}"
            )
    empty = xr.full_like(first, np.nan)
    rows = [xr.concat([found.get((load, s), empty) for s in states], "state") for load in loads]
    data = xr.concat(rows, "load").assign_coords(load=loads, state=states)
    data.attrs = {"units": first.attrs["units"]}
    return data


def _factors(measured: xr.DataArray, simulated: xr.DataArray, reference: str, scope: str) -> xr.DataArray:
    ratio = measured / simulated
    if scope == "each":
        return ratio
    at_reference = ratio.sel(state=reference, drop=True)
    if scope == "all":
        at_reference = xr.full_like(at_reference, float(at_reference.values[0]))
    return at_reference * xr.ones_like(ratio)


# Scaling simulated signals to a measured RMS, one factor for the healthy case and its faults (section 4).


def remove_mean(signal: xr.DataArray) -> xr.DataArray:
    """The signal less each channel's mean over the record."""
    return like(signal, signal.values - signal.values.mean(axis=0))


def dynamic_rms(signal: xr.DataArray) -> xr.DataArray:
    """RMS of each channel with its mean removed, dimension (channel,)."""
    return xr.DataArray(
        signal.values.std(axis=0),
        dims=("channel",),
        coords={"channel": signal["channel"].values},
        attrs={"long_name": "RMS"},
    )


def rms_factor(signal: xr.DataArray, target: float, channel: str | None = None) -> float:
    """Factor that brings the mean-free RMS of one channel to `target`.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    target : float
        Wanted RMS, in the units of the result.
    channel : str, optional
        Which channel; may be left out if there is only one.

    Raises
    ------
    SignalError
        If the target is not positive, the channel is not named or unknown, or the channel does not vary.
    """
    if not (math.isfinite(target) and target > 0.0):
        raise SignalError(f"target: must be a positive RMS, got {target!r}")
    names = [str(c) for c in signal["channel"].values]
    if channel is None and len(names) > 1:
        raise SignalError(f"channel: name the one whose RMS counts, of {names}")
    if channel is not None and channel not in names:
        raise SignalError(f"channel: there is no {channel!r}, only {names}")
    values = signal.values[:, names.index(channel) if channel is not None else 0]
    level = float(values.std())
    if level <= 1e-14 * float(np.abs(values).max(initial=0.0)):
        raise SignalError(f"signal: channel {channel or names[0]!r} does not vary, it cannot be scaled to an RMS")
    return target / level


def scale(signal: xr.DataArray, factor: float) -> xr.DataArray:
    """The mean-free signal times `factor`; the factor is noted in the attributes."""
    return like(signal, factor * (signal.values - signal.values.mean(axis=0)), scale_factor=float(factor))


def scale_states(
    states: Mapping[str, xr.DataArray], target: float, *, reference: str = "healthy", channel: str | None = None
) -> dict[str, xr.DataArray]:
    """Scale the reference state to a target RMS and every other state by the same factor.

    Parameters
    ----------
    states : mapping of name to xarray.DataArray
        Signals of the healthy pair and of the faults.
    target : float
        RMS the reference shall have, mean removed.
    reference : str
        The state whose factor is kept.
    channel : str, optional
        Channel whose RMS counts.

    Returns
    -------
    dict of name to xarray.DataArray
        Mean-free, all multiplied by the same factor (attribute `scale_factor`).

    Raises
    ------
    SignalError
        If the reference is not among the states, or see `rms_factor`.
    """
    if reference not in states:
        raise SignalError(f"reference: there is no state {reference!r}, only {list(states)}")
    factor = rms_factor(states[reference], target, channel)
    return {name: scale(signal, factor) for name, signal in states.items()}
