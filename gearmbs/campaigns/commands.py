"""``gearmbs campaign``: campaigns and the labelled data sets made of them from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearmbs._command import fail, guarded

app = typer.Typer(
    name="campaign", help="Plan, run and evaluate campaigns of many cases.", no_args_is_help=True, add_completion=False
)

Place = Annotated[Path, typer.Argument(help="Folder of the campaign.")]

OTHER_CODE = "If results so far come from other code: refuse to work, mix, or do those units again."


@app.command()
def plan(
    file: Annotated[Path, typer.Argument(help="Plan in TOML.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder; default: beside the plan.")] = None,
) -> None:
    """Check a plan and its corners, draw its cases and make the folder; nothing is simulated."""
    with guarded():
        from gearmbs.campaigns import Campaign, load_plan

        campaign = Campaign(out or file.with_suffix(".campaign"), load_plan(file))
        typer.echo(f"wrote {campaign.path}: {campaign.folder.case_count} cases in {campaign.folder.unit_count} units")


@app.command()
def run(
    folder: Place,
    workers: Annotated[int | None, typer.Option(help="Processes; default: the cores.")] = None,
    dask: Annotated[
        str | None,
        typer.Option(
            help='Address of a Dask scheduler; "local" for a cluster here; "slurm" or "pbs" for jobs of those.'
        ),
    ] = None,
    walltime: Annotated[str, typer.Option(help="Of a job of Slurm or PBS.")] = "01:00:00",
    queue: Annotated[str | None, typer.Option(help="Of Slurm or PBS.")] = None,
    minutes: Annotated[float | None, typer.Option(help="Start no further unit after so long.")] = None,
    other_code: Annotated[str, typer.Option(help=OTHER_CODE)] = "refuse",
    page: Annotated[
        Path | None, typer.Option(help="HTML file that says how it stands, for a browser that refreshes it.")
    ] = None,
) -> None:
    """Work on what is not done yet; after an interruption, the same command goes on."""
    with guarded():
        from gearmbs.campaigns import Campaign, dask_client

        campaign = Campaign(folder)
        how: dict[str, Any] = {"progress": True, "minutes": minutes, "other_code": other_code, "page": page or False}
        if dask is not None:
            jobs = {"walltime": walltime, "queue": queue} if dask in ("slurm", "pbs") else {}
            with dask_client(dask, workers, **jobs) as client:
                status = campaign.run(client=client, **how)
        else:
            status = campaign.run(workers, **how)
        typer.echo(str(status))
        if status.failed:
            typer.echo(f"see gearmbs campaign failed {folder}")


@app.command()
def work(
    folder: Place,
    part: Annotated[str, typer.Option(help='Which part of how many, as "3/200".')] = "1/1",
    minutes: Annotated[float | None, typer.Option(help="Start no further unit after so long.")] = None,
    other_code: Annotated[str, typer.Option(help=OTHER_CODE)] = "refuse",
) -> None:
    """Work here on one part of the units, as an element of a job array; parts need not know of each other."""
    with guarded():
        from gearmbs.campaigns import Campaign

        number, _, count = part.partition("/")
        if not (number.isdigit() and count.isdigit()):
            fail(f"--part is {part!r}; write it as 3/200")
        typer.echo(str(Campaign(folder).work(int(number), int(count), minutes=minutes, other_code=other_code)))


@app.command()
def status(
    folder: Place,
    watch: Annotated[bool, typer.Option(help="Say it again every five seconds until all is done.")] = False,
    page: Annotated[
        Path | None, typer.Option(help="Write it to this HTML file, too, with failures by cause and who is at work.")
    ] = None,
) -> None:
    """Tell how far a campaign is, from any shell that sees its folder."""
    with guarded():
        import time

        from gearmbs.campaigns import Campaign
        from gearmbs.campaigns.page import EVERY, LivePage

        live = None if page is None else LivePage(lambda: Campaign(folder).folder, page)
        while True:
            if live is not None:
                live.write(live=watch)
            now = Campaign(folder).status()
            typer.echo(str(now))
            if now.done:
                typer.echo(f"{now.processor_seconds:.4g} s of processor time, {now.overhead:.1%} outside simulations")
            if not watch or now.complete:
                break
            time.sleep(EVERY)


@app.command()
def failed(
    folder: Place,
    retry: Annotated[
        bool, typer.Option(help="Take their units out of the ledger, so that run does them again.")
    ] = False,
) -> None:
    """List the cases that failed, with the reason and what to do about it."""
    with guarded():
        from gearmbs.campaigns import Campaign

        campaign = Campaign(folder)
        for row in campaign.failed().to_dict("records"):
            typer.echo(f"case {row['index']}: {row['status']}: {row['message']}")
            if row["advice"]:
                typer.echo(f"    {row['advice']}")
        if retry:
            typer.echo(f"{campaign.retry()} units will be done again by gearmbs campaign run {folder}")


@app.command()
def show(folder: Place, case: Annotated[int, typer.Argument(help="Number of the case.")]) -> None:
    """Print the case behind a number: what was simulated, and its row of the table."""
    with guarded():
        from gearmbs.campaigns import Campaign

        campaign = Campaign(folder)
        thing = campaign.case(case)
        typer.echo(thing.model_dump_json(indent=1) if hasattr(thing, "model_dump_json") else str(thing))
        if campaign.folder.done():
            table = campaign.table
            row = table[table["index"] == case]
            typer.echo(row.T.to_string(header=False) if len(row) else f"case {case} is not done yet")


@app.command()
def extend(folder: Place, to: Annotated[int, typer.Option(help="Points of the design.")]) -> None:
    """Draw further points of the design; what is done stays."""
    with guarded():
        from gearmbs.campaigns import Campaign

        campaign = Campaign(folder).extend(to)
        typer.echo(str(campaign.status()))


@app.command()
def pack(
    folder: Place,
    unit: Annotated[int | None, typer.Option(help="Cases of a unit; default: 1024, or 64 MB of signals.")] = None,
) -> None:
    """Store what is done in fewer, larger units; former files go when what was written has been read back."""
    with guarded():
        from gearmbs.campaigns import Campaign

        packed = Campaign(folder).pack(unit).folder
        typer.echo(f"{packed.unit_count} units of {packed.unit_size} cases in {packed.store}")


@app.command()
def check(
    folder: Place,
    sweep: Annotated[bool, typer.Option(help="Remove litter, and put right what is damaged.")] = False,
) -> None:
    """Hold what is stored against the ledgers."""
    with guarded():
        from gearmbs.campaigns import Campaign

        found = Campaign(folder).check(sweep=sweep)
        typer.echo("\n".join(found) if found else "all is as the ledgers say")
        if any(not line.startswith("litter") for line in found):
            raise typer.Exit(1)


@app.command()
def export(
    folder: Place,
    out: Annotated[Path, typer.Option("--out", "-o", help="File, or folder for parquet.")],
    format: Annotated[str, typer.Option("--as", help="csv, netcdf, matlab, parquet or hf.")] = "parquet",
    split_by: Annotated[
        str | None, typer.Option(help="Column, as specimen, whose values each are in one split only (parquet, hf).")
    ] = None,
    test: Annotated[
        float | None, typer.Option(help="Part of its values that is for the test; a fifth if not given.")
    ] = None,
    held_out: Annotated[
        list[str] | None,
        typer.Option(help='Range of a column kept from training, as "severity=0.45:0.6"; repeat (parquet, hf).'),
    ] = None,
) -> None:
    """Write the results for others."""
    with guarded():
        from gearmbs.campaigns import Campaign

        ranges = {}
        for item in held_out or ():
            column, _, ends = item.rpartition("=")
            try:
                ranges[column] = tuple(float(end) for end in ends.split(":"))
            except ValueError:
                fail(f"--held-out is {item!r}; write it as severity=0.45:0.6")

        for path in Campaign(folder).export(out, format, split_by=split_by, test=test, held_out=ranges):
            typer.echo(f"wrote {path}")


@app.command()
def report(
    folder: Place,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="HTML file; default: in the folder.")] = None,
    result: Annotated[list[str] | None, typer.Option(help="Column to look at; repeat; default: the first few.")] = None,
) -> None:
    """Write one HTML page: plan, results, what decides them, failures."""
    with guarded():
        from gearmbs.campaigns import Campaign

        typer.echo(f"wrote {Campaign(folder).report(out or folder / 'report.html', result or None)}")


@app.command()
def sensitivity(folder: Place, result: Annotated[str, typer.Argument(help="Column of the table.")]) -> None:
    """Print what decides a result: Sobol' indices, elementary or main effects, by the design."""
    with guarded():
        from gearmbs.campaigns import Campaign, PolynomialChaos, SobolIndices

        found = Campaign(folder).sensitivity(result)
        # a table of effects is one already
        table: Any = found.table() if isinstance(found, (SobolIndices, PolynomialChaos)) else found
        typer.echo(table.to_string(float_format="%.4g"))
        if isinstance(found, SobolIndices) and found.explained > 0.0:
            typer.echo(
                f"polynomials as control variates explain {found.explained:.1%} of the variance of points left out"
            )
        if isinstance(found, PolynomialChaos):
            typer.echo(f"from a polynomial that explains {found.q_squared:.1%} of the variance of points left out")


@app.command()
def figure(
    folder: Place,
    kind: Annotated[
        str, typer.Argument(help="main effects, tornado, scatter matrix or parallel coordinates.")
    ] = "main effects",
    out: Annotated[Path, typer.Option("--out", "-o", help="Picture: PNG, SVG or PDF.")] = Path("figure.png"),
    result: Annotated[list[str] | None, typer.Option(help="Column; repeat; default: what varies most.")] = None,
    factor: Annotated[list[str] | None, typer.Option(help="Column; repeat; default: all that vary.")] = None,
) -> None:
    """Draw results over factors."""
    with guarded():
        from gearmbs.campaigns import Campaign

        Campaign(folder).figure(kind, result or None, factor or None).savefig(out, dpi=120)
        typer.echo(f"wrote {out}")


@app.command("map")
def condition(
    folder: Place,
    holds: Annotated[str, typer.Argument(help='Condition, as "orders.line_of_action.2 > 30".')],
    across: Annotated[str, typer.Option(help="Factor of the horizontal axis.")],
    along: Annotated[str, typer.Option(help="Factor of the vertical axis.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Picture: PNG, SVG or PDF.")],
    bins: Annotated[int, typer.Option(help="Along each axis, of equal numbers of cases.")] = 8,
) -> None:
    """Draw over two factors in which part of the cases a condition holds."""
    with guarded():
        from gearmbs.campaigns import Campaign, condition_figure

        condition_figure(Campaign(folder), holds, across, along, bins).savefig(out, dpi=120)
        typer.echo(f"wrote {out}")


@app.command()
def slurm(
    folder: Place,
    elements: Annotated[int, typer.Option(help="Elements of the job array.")] = 100,
    minutes: Annotated[int, typer.Option(help="Wall time of an element.")] = 60,
    system: Annotated[str, typer.Option(help="slurm or pbs.")] = "slurm",
) -> None:
    """Print a job script for Slurm or PBS that works on a campaign as a job array; nothing is submitted."""
    with guarded():
        from gearmbs.campaigns.cluster import job_script

        typer.echo(job_script(folder, elements, minutes, system))


@app.command()
def dataset(
    out: Annotated[Path, typer.Argument(help="Folder of the data set; the campaigns of its gearboxes are beside it.")],
    signals: Annotated[int, typer.Option(help="At least so many.")] = 20_000,
    gearbox: Annotated[
        list[str] | None, typer.Option(help='"one stage" or "two stages"; repeat; default: both.')
    ] = None,
    specimens: Annotated[int, typer.Option(help="Individuals of each gearbox, with errors of their own.")] = 100,
    duration: Annotated[str, typer.Option(help="Length of a record.")] = "0.25 s",
    noise_from: Annotated[
        list[Path] | None, typer.Option(help="Recording whose random part becomes the sensors' noise; repeat.")
    ] = None,
    path_from: Annotated[
        list[Path] | None,
        typer.Option(help="Recording whose resonances become the path from the housing to the sensors; repeat."),
    ] = None,
    rate: Annotated[str | None, typer.Option(help="Sampling rate of the recordings, where they do not say.")] = None,
    bearing_defects: Annotated[
        bool, typer.Option("--bearing-defects", help="Spalls of rolling bearings as sources beside the teeth.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Of design, specimens and sensors.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes; default: the cores.")] = None,
    dask: Annotated[str | None, typer.Option(help='Address of a Dask scheduler, or "local".')] = None,
    url: Annotated[str | None, typer.Option(help="Where it will be published, for the metadata.")] = None,
    published: Annotated[str | None, typer.Option(help="When, as 2026-01-31, for the metadata.")] = None,
) -> None:
    """Make a labelled data set of gear faults: simulate, put sensors on, split by specimen, write card and metadata."""
    with guarded():
        from gearmbs.campaigns import Campaign, CampaignError, dask_client
        from gearmbs.campaigns.datasets import (
            GEARBOXES,
            SensorLayers,
            data_set_plan,
            identify_noise,
            identify_path,
            split_by_group,
            write_data_set,
        )
        from gearmbs.schema.described import chosen
        from gearmbs.signals.files.simulated import read_any
        from gearmbs.units import to_si

        boxes = [chosen(GEARBOXES, name, "", CampaignError, "gearbox") for name in dict.fromkeys(gearbox or GEARBOXES)]
        given = _given_rate(rate)
        # splits that cannot be made are told before hours of simulation
        split_by_group(range(specimens))
        at = boxes[0].rate
        noises = [noise for file in noise_from or () for noise in identify_noise(read_any(file, **given), at)]
        paths = [path for file in path_from or () for path in identify_path(read_any(file, **given))]
        layers = SensorLayers(noises=tuple(noises), paths=tuple(paths), seed=seed)
        seconds = to_si(duration, "time", "--duration")
        campaigns = []
        for box in boxes:
            plan = data_set_plan(
                -(-signals // len(boxes)),
                gearbox=box,
                specimens=specimens,
                duration=seconds,
                layers=layers,
                bearing_defects=bearing_defects,
                seed=seed,
            )
            campaigns.append(Campaign(out.with_name(f"{out.name}-{box.name.replace(' ', '-')}.campaign"), plan))
        for campaign in campaigns:
            if dask is not None:
                with dask_client(dask, workers) as client:
                    status = campaign.run(client=client, progress=True)
            else:
                status = campaign.run(workers, progress=True)
            typer.echo(f"{campaign.path.name}: {status}")
        for path in write_data_set(campaigns, out, layers=layers, seed=seed, url=url, published=published):
            typer.echo(f"wrote {path}")


@app.command("path")
def identified_path(
    recording: Annotated[Path, typer.Argument(help="Recording of a machine that runs, of one state.")],
    modes: Annotated[int, typer.Option(help="Of each channel, the strongest.")] = 6,
    rate: Annotated[str | None, typer.Option(help="Sampling rate of the recording, where it does not say.")] = None,
) -> None:
    """Print the resonances of a recording's sensors, which dataset --path-from puts between housing and sensors."""
    with guarded():
        import math

        from gearmbs.campaigns.datasets import identify_path
        from gearmbs.signals.files.simulated import read_any

        signal = read_any(recording, **_given_rate(rate))
        typer.echo("| channel | frequency, Hz | damping ratio | peak, dB |\n|---|---|---|---|")
        for name, path in zip(signal["channel"].values, identify_path(signal, modes), strict=True):
            # over the highest, since no recording knows the gain
            lowest = min(mode.damping * mode.mass for mode in path.modes)
            for mode in sorted(path.modes, key=lambda mode: mode.frequency):
                level = 20.0 * math.log10(lowest / (mode.damping * mode.mass))
                typer.echo(f"| {name} | {mode.frequency:.1f} | {mode.damping:.4f} | {level:.1f} |")


@app.command()
def baseline(
    folder: Annotated[Path, typer.Argument(help="Folder of a data set.")],
    recording: Annotated[
        list[str] | None, typer.Option(help="Real recording with its state, as healthy=h.csv; repeat.")
    ] = None,
    teeth: Annotated[int, typer.Option(help="Teeth of the driver in the recordings.")] = 0,
    rate: Annotated[str | None, typer.Option(help="Sampling rate of the recordings, where they do not say.")] = None,
    window: Annotated[float, typer.Option(help="Length of a window, s.")] = 0.25,
) -> None:
    """Train the baseline on a data set: on artefacts alone, with and without a leak, and tested on real recordings."""
    with guarded():
        from gearmbs.campaigns.datasets import (
            artefact_leaks,
            feature_table,
            from_recordings_to_recordings,
            from_simulation_to_recordings,
            leak_and_no_leak,
            one_state_a_group,
            read_data_set,
        )

        rows = read_data_set(folder)
        for name, found in artefact_leaks(rows).items():
            typer.echo(f"artefacts alone, {name}: {found}")
        x, labels, specimens, _ = feature_table(rows, window=window)
        single = one_state_a_group(labels, specimens)
        for what, kept in (("all states of each specimen", slice(None)), ("one state of each specimen", single)):
            for name, found in leak_and_no_leak(x[kept], labels[kept], specimens[kept]).items():
                typer.echo(f"{what}, {name}: {found}")
        if recording:
            real = _recordings(recording, teeth, rate, window)
            found, alone = from_simulation_to_recordings(x, labels, *real)
            typer.echo(f"from simulation to real recordings: {found}")
            typer.echo(f"from real recordings to others: {from_recordings_to_recordings(*real)}")
            for name, value in sorted(alone.items(), key=lambda item: -abs(item[1] - 0.5)):
                typer.echo(f"    {name} alone, in the direction of the simulation: AUROC {value:.3f}")


def _given_rate(rate: str | None) -> dict[str, Any]:
    """Return the sampling rate that an option gives, Hz, as a keyword of readers."""
    from gearmbs.units import to_si

    if rate is None:
        return {}
    try:
        found = float(rate)
    except ValueError:
        found = to_si(rate, "frequency", "--rate")
    if not 0.0 < found < float("inf"):
        fail(f"--rate is {rate!r}; give a frequency above 0, as 12800 or '12.8 kHz'")
    return {"rate": found}


def _recordings(items: list[str], teeth: int, rate: str | None, window: float) -> tuple[Any, Any, Any]:
    """Return features, states and numbers of recordings given as ``state=file``."""

    import numpy as np

    from gearmbs.campaigns.datasets import recording_features
    from gearmbs.signals import estimate_speed
    from gearmbs.signals.files.simulated import read_any

    if teeth < 1:
        fail("--recording needs --teeth, the number of teeth of its driver")
    given = _given_rate(rate)
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
