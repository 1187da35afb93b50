"""Descriptions as text: TOML files read into tables, values and tables written as TOML."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def read_toml(path: str | Path, error: type[ValueError] = ValueError) -> dict[str, Any]:
    """Return the tables of a TOML file, with or without a byte order mark.

    Parameters
    ----------
    path : path-like
    error : type
        What is raised if it cannot be read, is no text or no TOML, with the path in front.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as caught:
        raise error(f"{path}: cannot be read ({caught.strerror or caught})") from None
    except UnicodeDecodeError:
        raise error(
            f"{path}: not a text file, so no description in TOML; records are read by `gearmbs analyse`"
        ) from None
    except tomllib.TOMLDecodeError as caught:
        raise error(f"{path}: not a valid TOML file ({caught})") from None


def toml_value(value: Any) -> str:
    """Return a value as TOML writes it.

    Examples
    --------
    >>> toml_value(["20 mm", 0.5, True])
    '["20 mm", 0.5, true]'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return repr(value)


def toml_table(header: str, values: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table with its header, as ``[run]``, an empty line before; what is None is left out."""
    rows = [f"{name} = {toml_value(value)}" for name, value in values.items() if value is not None]
    return ["", header, *rows] if rows else []
