"""``gearmbs campaign dataset`` and ``baseline``: labelled data sets from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearmbs._command import fail, guarded


def dataset(
    out: Annotated[Path, typer.Argument(help="Folder of the data set; its campaign is beside it.")],
    signals: Annotated[int, typer.Option(help="At least so many signals.")] = 20_000,
    specimens: Annotated[int, typer.Option(help="Individuals with manufacturing errors of their own.")] = 200,
    duration: Annotated[str, typer.Option(help="Length of a record.")] = "0.5 s",
    sensors: Annotated[int, typer.Option(help="Signals of each simulated record, at places on the housing.")] = 4,
    seed: Annotated[int, typer.Option(help="Of design, specimens and sensors.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes; default: the cores.")] = None,
    dask: Annotated[str | None, typer.Option(help='Address of a Dask scheduler, or "local".')] = None,
    url: Annotated[str | None, typer.Option(help="Where it will be published, for the metadata.")] = None,
    published: Annotated[str | None, typer.Option(help="When, as 2026-01-31, for the metadata.")] = None,
) -> None:
    """Make a labelled data set of gear faults: simulate, put sensors on, split by specimen, write card and metadata."""
    with guarded():
        from gearmbs.campaigns import Campaign, dask_client
        from gearmbs.campaigns.datasets import SensorLayers, data_set_plan, write_data_set
        from gearmbs.units import to_si

        seconds = to_si(duration, "time", "--duration")
        plan = data_set_plan(signals, specimens=specimens, duration=seconds, sensors=sensors, seed=seed)
        campaign = Campaign(out.with_name(out.name + ".campaign"), plan)
        if dask is not None:
            with dask_client(dask, workers) as client:
                status = campaign.run(client=client, progress=True)
        else:
            status = campaign.run(workers, progress=True)
        typer.echo(str(status))
        layers = SensorLayers(sensors=sensors, seed=seed)
        for path in write_data_set(campaign, out, layers=layers, seed=seed, url=url, published=published):
            typer.echo(f"wrote {path}")


def baseline(
    folder: Annotated[Path, typer.Argument(help="Folder of a data set's campaign.")],
    recording: Annotated[
        list[str] | None, typer.Option(help="Real recording with its state, as healthy=h.csv; repeat.")
    ] = None,
    teeth: Annotated[int, typer.Option(help="Teeth of the driver in the recordings.")] = 0,
    rate: Annotated[str | None, typer.Option(help="Sampling rate of the recordings, where they do not say.")] = None,
    window: Annotated[float, typer.Option(help="Length of a window, s.")] = 0.25,
    sensors: Annotated[int, typer.Option(help="Signals of each simulated record.")] = 4,
) -> None:
    """Train the baseline on a data set's campaign: with and without a leak, and tested on real recordings."""
    with guarded():
        from gearmbs.campaigns import Campaign
        from gearmbs.campaigns.datasets import (
            SensorLayers,
            feature_table,
            from_simulation_to_recordings,
            leak_and_no_leak,
            one_state_a_group,
        )

        campaign = Campaign(folder)
        # the sensors that the data set was made with
        layers = SensorLayers(sensors=sensors, seed=campaign.plan.seed)
        x, labels, specimens, _ = feature_table(campaign, layers, window=window)
        single = one_state_a_group(labels, specimens)
        for what, rows in (("all states of each specimen", slice(None)), ("one state of each specimen", single)):
            for name, found in leak_and_no_leak(x[rows], labels[rows], specimens[rows]).items():
                typer.echo(f"{what}, {name}: {found}")
        if recording:
            real = _recordings(recording, teeth, rate, window)
            found, alone = from_simulation_to_recordings(x, labels, *real)
            typer.echo(f"real recordings: {found}")
            for name, value in sorted(alone.items(), key=lambda item: -abs(item[1] - 0.5)):
                typer.echo(f"    {name} alone, in the direction of the simulation: AUROC {value:.3f}")


def _recordings(items: list[str], teeth: int, rate: str | None, window: float) -> tuple[Any, Any, Any]:
    """Return features, states and numbers of recordings given as ``state=file``."""

    import numpy as np

    from gearmbs.campaigns.datasets import recording_features
    from gearmbs.signals import estimate_speed
    from gearmbs.signals.files.simulated import read_any
    from gearmbs.units import to_si

    if teeth < 1:
        fail("--recording needs --teeth, the number of teeth of its driver")
    given: dict[str, Any] = (
        {} if rate is None else {"rate": to_si(rate if not rate.isdigit() else f"{rate} Hz", "frequency", "--rate")}
    )
    rows, states, numbers = [], [], []
    for number, item in enumerate(items):
        state, equals, file = item.partition("=")
        if not equals:
            fail(f"--recording is {item!r}; write it as healthy=record.csv")
        signal = read_any(Path(file), teeth=teeth, **given)
        shaft = float(signal.attrs.get("speed") or estimate_speed(signal).speed) / (2.0 * np.pi)
        found = recording_features(signal, shaft=shaft, teeth=teeth, window=window)
        rows.append(found)
        states += [state.strip()] * len(found)
        numbers += [number] * len(found)
    return np.concatenate(rows), np.array(states), np.array(numbers)
