"""``gearmbs waterfall``: what changes with the speed of records, as figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import check_kind, guarded, stage_bar
from gearmbs.signals.command_parts import Gaps, Rate, Units, check_targets, hand_over, sample_units, save_figures

if TYPE_CHECKING:
    import xarray as xr

Orders = Annotated[str | None, typer.Option(help='Orders of the shaft to mark, e.g. "1,29,58".')]
Maximum = Annotated[str | None, typer.Option(help='Highest frequency shown, e.g. "6 kHz".')]
Folder = Annotated[Path, typer.Option("--out", "-o", help="Folder for the figures.")]


def waterfall(
    files: Annotated[list[Path], typer.Argument(help="One run-up or coast-down, or records of constant speed.")],
    speed: Annotated[
        list[str] | None,
        typer.Option(help='Speed, e.g. "1500 rpm", or a file with it over time; repeat, one for each file.'),
    ] = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel that holds the speed.")] = None,
    tacho: Annotated[str | None, typer.Option(help="Channel with the tacho pulses.")] = None,
    pulses: Annotated[float, typer.Option(help="Tacho pulses a revolution.")] = 1.0,
    channel: Annotated[str | None, typer.Option(help="Channel to draw; default: the first.")] = None,
    orders: Orders = None,
    steps: Annotated[int | None, typer.Option(help="Spectra over equal intervals of the speed of a run-up.")] = None,
    style: Annotated[str, typer.Option(help="lines or map.")] = "lines",
    maximum: Maximum = None,
    rate: Rate = None,
    units: Units = None,
    gaps: Gaps = None,
    out: Folder = Path("waterfall"),
) -> None:
    """Draw spectra over speed; of a run-up spectrogram, order map and tracked orders, too."""
    with guarded(), stage_bar(files[0].name) as move:
        for file in files:
            check_kind(file, "record")
        check_targets(out=out)
        from gearmbs.signals import waterfall as spectra_over_speed
        from gearmbs.signals.simulated import read_any
        from gearmbs.signals.speed_file import parse_speed
        from gearmbs.view import changing_speed_figures, waterfall_plot

        helpers = [name for name in (tacho, speed_channel) if name]
        chosen = None if channel is None else [channel, *helpers]
        known = [parse_speed(text) for text in speed or []]
        if steps is not None and len(files) > 1:
            raise ValueError(f"--steps divides the speed of one run-up; each of {len(files)} files gives one spectrum")
        if known and len(known) != len(files):
            raise ValueError(f"--speed is given {len(known)} times for {len(files)} files; give one for each")
        signals = []
        for k, file in enumerate(files):
            signals.append(read_any(file, rate=rate, units=sample_units(units), channels=chosen, gaps=gaps))
            move(0.5 * (k + 1) / len(files), "reading")
        marked = numbers(orders, "--orders")
        shown: dict[str, Any] = {"style": style, "maximum": maximum, "channel": channel}
        told: dict[str, Any] = {"tacho": tacho, "pulses_per_rev": pulses} if tacho else {}
        told |= {"speed_channel": speed_channel} if speed_channel else {}
        if len(signals) > 1:
            if helpers:
                signals, known = _with_mean_speeds(signals, known, helpers, told)
            data = spectra_over_speed(signals, known or None, maximum=maximum)
            figures = {"waterfall": waterfall_plot(data, orders=marked, **shown)}
        else:
            shaft: dict[str, Any] = {"speed": known[0]} if known else {}
            shaft |= told
            kept = _vibration(signals[0], helpers)
            if helpers:
                from gearmbs.signals import shaft_phase

                shaft = {"phase": shaft_phase(signals[0], **shaft)}
            data = spectra_over_speed(kept, steps=steps, maximum=maximum, **shaft)
            figures = changing_speed_figures(kept, orders=marked or None, title=files[0].name, **shaft)
            figures["waterfall"] = waterfall_plot(data, orders=marked, **shown)
        files_written = save_figures(figures, out)
    low, high = (float(data["speed"][k]) * 30.0 / math.pi for k in (0, -1))
    hand_over(f"{data.sizes['speed']} spectra from {low:.4g} to {high:.4g} rpm", None, files_written)


def _vibration(signal: xr.DataArray, helpers: list[str]) -> xr.DataArray:
    """Return a signal without the channels that tell its speed."""
    return signal.drop_sel(channel=[name for name in helpers if name in signal["channel"].values])


def _with_mean_speeds(
    signals: list[xr.DataArray], known: list[Any], helpers: list[str], told: dict[str, Any]
) -> tuple[list[xr.DataArray], list[float]]:
    """Return records without the channels that tell their speeds, and each record's mean speed, rad/s."""
    from gearmbs.signals import shaft_phase

    speeds = []
    for signal, given in zip(signals, known or [None] * len(signals), strict=True):
        phase = shaft_phase(signal, given, **told)
        span = float(phase["time"][-1] - phase["time"][0])
        speeds.append(float(phase[-1] - phase[0]) / span)
    return [_vibration(signal, helpers) for signal in signals], speeds


def numbers(text: str | None, option: str) -> list[float]:
    """Return the numbers of a text such as "1,29,58", none of None."""
    try:
        return [] if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; give numbers with commas, for instance 1,29,58") from None
