"""Command line: a thin layer over the library's public calls; each command lives beside its package."""

from __future__ import annotations

import gc
import os
import sys
from typing import Annotated

import typer

from gearmbs import _command
from gearmbs.adams.commands import adams, plant
from gearmbs.campaigns.commands import app as campaign
from gearmbs.identify.commands import identify
from gearmbs.logs import listen
from gearmbs.signals.commands import analyse, compare, trend, waterfall
from gearmbs.signals.encoders.commands import transmission_error
from gearmbs.studies.commands import bench, campbell, gearbox, paper, resonance, run, sweep
from gearmbs.studies.export import export
from gearmbs.system import end_like_interrupt, forgive_output

app = typer.Typer(
    name="gearmbs",
    help="Multibody gear dynamics: simulate gear pairs and mechanisms, evaluate and compare vibration signals.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

of_records = (analyse, waterfall, trend, compare, transmission_error)
for command in (paper, run, sweep, bench, gearbox, resonance, campbell, *of_records, identify, adams, plant, export):
    app.command()(command)
app.add_typer(campaign)


def _noted(number: int) -> None:
    _command.ended_by = number


@app.callback(invoke_without_command=True)
def main(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    verbose: Annotated[
        int, typer.Option("--verbose", "-v", count=True, help="Say what is done; given twice, also by whom and how.")
    ] = 0,
) -> None:
    """Multibody gear dynamics."""
    if verbose:
        listen("info" if verbose == 1 else "debug")
    # many small products: threads of the linear algebra library double the time; numpy is not loaded yet
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    end_like_interrupt(_noted)
    forgive_output()
    # a command makes many objects and drops few: looking for cycles at every 700 of them costs a tenth of its start
    gc.set_threshold(50_000, 20, 20)
    if version:
        import gearmbs

        typer.echo(f"gearmbs {gearmbs.__version__}")
        raise typer.Exit


if __name__ == "__main__":
    sys.exit(app())
