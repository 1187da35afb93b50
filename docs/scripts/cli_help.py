"""The help texts of the command line, for the documentation."""

from __future__ import annotations

import typer
from IPython.display import Markdown, display

from gearmbs.cli import app


def option_rows(command) -> list[str]:
    """Return a Markdown table of a command's arguments and options."""
    rows = ["| argument or option | default | meaning |", "|---|---|---|"]
    for parameter in command.params:
        names = ", ".join(f"`{name}`" for name in [*parameter.opts, *parameter.secondary_opts])
        if parameter.param_type_name == "argument":
            names = f"`{(parameter.name or '').upper()}`"
        if names == "`--help`":
            continue
        default = "" if parameter.default is None or callable(parameter.default) else f"`{parameter.default}`"
        help_text = getattr(parameter, "help", "") or ""
        rows.append(f"| {names} | {default} | {help_text} |")
    return rows


def show() -> None:
    """Display every command with its arguments and options."""
    group = typer.main.get_command(app)
    listed = {}
    for name, command in group.commands.items():
        inside = getattr(command, "commands", {})
        listed |= {f"{name} {own}": below for own, below in inside.items()} or {name: command}
    for name, command in listed.items():
        text = [f"**`gearmbs {name}`** — {(command.help or '').strip()}", "", *option_rows(command)]
        display(Markdown("\n".join(text)))
