"""CSV and gzip CSV: columns of numbers, with names, units and metadata in the lines above them.

Written files begin with `# key: value` lines (JSON values) and a row of names with units in brackets. Read are these
and most others: comma, semicolon, tab or blank as separator, decimal commas, names with or without units, a column of
times or time stamps, a column that only numbers the rows, headers of instruments, or nothing but numbers.
"""

from __future__ import annotations

import gzip
import io
import json
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np
import pandas as pd

from gearmbs.files import json_value
from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.beside_words import Words
from gearmbs.signals.files.cells import (
    COMMENT,
    GAP_CELLS,
    MINUS,
    WITHOUT,
    between_thousands,
    cell_kind,
    split_cells,
    thousands_column,
    with_minus,
    without_thousands,
)
from gearmbs.signals.files.encodings import encoding_of, utf16_without_mark
from gearmbs.signals.files.labview import read_lvm
from gearmbs.signals.files.own_clocks import on_one_clock, own_clocks
from gearmbs.signals.files.scales import named_factors, scale_told
from gearmbs.signals.files.scopes import scope_layout
from gearmbs.signals.files.table import Asked, Content, Format, begins_with
from gearmbs.signals.files.text_tables import (
    HEAD_LINES,
    INDEX_NAMES,
    LONGEST_SECONDS,
    TAIL_READ,
    CsvLayout,
    Times,
    digits_of,
    find_layout,
    index_meaning,
    last_lines,
    pointed,
)
from gearmbs.signals.signal.labels import FEWEST_EVEN, rises_evenly, role_of
from gearmbs.signals.signal.record import (
    REMEDY,
    SHAFT_COLUMNS,
    Progress,
    RateCandidate,
    Record,
    checked_gaps,
    chosen_rate,
    number_of,
    rate_by_times,
    rate_candidates,
    speed_of,
)
from gearmbs.signals.signal.shapes import is_missing
from gearmbs.signals.signal.signal import ROUNDED_TIMES, UNKNOWN_UNITS, check_teeth
from gearmbs.signals.signal.times import rate_about_even
from gearmbs.signals.signal.words import words_of
from gearmbs.wording import warn

CHUNK_ROWS = 1 << 17
# Times are written with few digits; beyond this many samples a gap is a gap.
MAX_JUMP = 2.0
# pandas before 3.1 rounds the last bit unless told otherwise; later versions are exact and warn at the option.
EXACT: dict[str, Any] = (
    {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}
)
COUNT = "gearmbs_samples"
"""Line of the header that says how many rows follow: a table cut at the end of a row looks whole."""
CUT = "CHECK THE END: "
"""Begin of what is said of a table that looks cut off, and warned of."""
FEWEST_FIXED = 20
"""Rows of the same number of digits that make a format: those without trailing zeros have fewer in one of ten."""
MOST_ODD = 0.05
"""Part of the characters of a text that may be none of UTF-8 or of control, as umlauts of older code pages are."""
CHOOSE = "choose other columns with channels=[...] (--channel)"
MOST_ALONE = 2
"""Columns of a table beside which there are no others to choose: times and one channel."""
LONGEST_EMPTY = 0.1
"""Share of the rows in which a speed may be missing in a row: a drive may change its speed meanwhile."""
LONGEST_STEP = 5.0
"""Usual distances of the rows with a speed that are as long: loggers that write it now and then skip a few."""
GAPS = [cell for cell in GAP_CELLS if cell not in ("inf", "-inf")]


@contextmanager
def _open_text(path: Path, packed: bool):
    with open(path, "rb") as raw:
        stream: IO[bytes] = gzip.GzipFile(fileobj=raw) if packed else raw  # type: ignore[assignment]
        encoding = encoding_of(stream.read(1 << 16))
        stream.seek(0)
        with io.TextIOWrapper(stream, encoding=encoding, errors="replace", newline=None) as text:
            yield text, raw


def read_csv(
    path: Path,
    packed: bool,
    progress: Progress | None = None,
    rate: float | None = None,
    gaps: str | None = None,
    pulses: bool = False,
    channels: Sequence[str] | None = None,
) -> Record:
    """Read a text table; `packed` for gzip. A known `rate` (Hz) stands in for times that are only rounded.

    Of ``pulses`` a first column that rises evenly is one as the others. Where columns have times of their own, those
    of the `channels` that are asked for count.

    Raises
    ------
    SignalFileError
        If the file is damaged, binary, has no numbers, a row is short or not numeric (with its line number), or cells
        are empty and `gaps` does not say what to do with them.
    """
    with _damage_named(path):
        layout = _layout(path, packed, pulses)
        if pulses and layout.index is not None and layout.names[layout.index].strip().lower() not in INDEX_NAMES:
            layout = replace(layout, index=None)
        asked = None if pulses or layout.groups else channels
        named = {i: layout.names[i] for i in layout.beside}
        while True:
            words = Words(named)
            times = Times(layout, path)
            blocks: list[np.ndarray] = []
            clocks: list[np.ndarray | None] = []
            try:
                for values, stamped, fraction in _blocks(path, packed, layout, gaps, words):
                    blocks.append(values)
                    clocks.append(None if layout.groups else times.seconds(values, stamped))
                    if progress is not None:
                        progress(fraction, "reading")
                break
            except _WrongCell as wrong:
                lost = [name for name in asked or () if name not in (*layout.names, *SHAFT_COLUMNS)]
                if lost:
                    raise SignalFileError(path, f"has no channel {lost}; it holds {layout.names}") from None
                if not _may_be_left_out(wrong.column, layout, asked):
                    raise SignalFileError(path, wrong.fault) from wrong.__cause__
                # gaps, or words far down, in a column that nobody asked for
                layout = replace(layout, beside=(*layout.beside, wrong.column))
        if not blocks:
            raise SignalFileError(path, "holds no rows of numbers")
        known = [clock for clock in clocks if clock is not None]
        clock = np.concatenate(known) if known else None
        values = np.concatenate(blocks)
        count, said = len(values), words.said()
        rising = clock is not None and bool(np.all(np.diff(clock) > 0.0))
        if not rising and not layout.groups and (mixed := words.mixed()) is not None:
            raise SignalFileError(path, mixed)
        if layout.groups:
            one = on_one_clock(path, values, layout.groups, layout.names, layout.units, channels, gaps)
            values, clock, said = one.values, one.times, [*said, *one.said]
            layout = replace(layout, groups=(), clock=one.clock, beside=(*layout.beside, *one.left_out))
        said += [] if pulses else _bridged(path, values, layout, gaps, channels)
        found = _record(path, values, clock, layout, rate, pulses)
        said += _end_checked(path, packed, layout, count)
        return replace(found, notes=[*found.notes, *said]) if said else found


def _end_checked(path: Path, packed: bool, layout: CsvLayout, count: int) -> list[str]:
    """Return what is to be said of a table's end: a last row without an end may be cut within its last number.

    Raises
    ------
    SignalFileError
        Of a file of this package whose rows are fewer or more than its header says, or whose last one has no end.
    """
    own = number_of(layout.meta.get(COUNT))
    if own is not None and own[0] != count:
        raise SignalFileError(path, f"holds {count} of the {own[0]:g} samples that its header names: it is cut off")
    ended, lines = last_lines(path, packed)
    if own is not None:
        if not ended:
            raise SignalFileError(path, "its last line has no end: it is cut off within a number")
        return []
    where = f"{path.name}, line {layout.first + count}"
    told = [digits_of(split_cells(line, layout.separator)[-1]) for line in lines if split_cells(line, layout.separator)]
    fixed = len(told) > FEWEST_FIXED and len(set(told[:-1])) == 1 and told[0] not in (None, (0, 0))
    if fixed and told[-1] != told[0]:
        how = "The last line has no end, and its" if not ended else "The last line's"
        return [f"{CUT}{where}: {how} last number has fewer digits than all others before: the file looks cut off."]
    if ended:
        return []
    said = f"{where}: The last line has no end: if the file is cut off, its last sample is wrong."
    # of numbers written with as many digits as all others nothing is missing
    return [said if fixed else CUT + said]


def csv_pieces(
    path: Path, packed: bool, rate: float | None, gaps: str | None, layout: CsvLayout, channels: Sequence[str] | None
) -> Iterator[tuple[Record, float]]:
    """Read a text table block by block: records in their order, each with the fraction read by then.

    Of `channels` that are asked for others may hold words.

    Raises
    ------
    SignalFileError
        As `read_csv`, and if the times of a block do not go on where the last one ended.
    """
    with _damage_named(path):
        unread = [name for i, name in enumerate(layout.names) if _may_be_left_out(i, layout, channels)]
        layout = replace(layout, beside=tuple({*layout.beside, *map(layout.names.index, unread)}))
        times, first, count = Times(layout, path), None, 0
        words = Words({i: layout.names[i] for i in layout.beside if layout.names[i] not in unread})
        for values, stamped, fraction in _blocks(path, packed, layout, gaps, words):
            clock = times.seconds(values, stamped)
            said = _bridged(path, values, layout, gaps, channels)
            record = _record(path, values, clock, layout, rate if first is None else first.rate)
            record.notes += said
            record.notes += words.said() if first is None else []
            if first is None:
                first = record
            elif clock is not None and first.rate is not None:
                strayed = abs(float(clock[0]) - first.t0 - count / first.rate) * first.rate
                # the mean rate of rounded times is as good as the given one, and drifts from it as much
                if strayed > (MAX_JUMP if rate is None else max(MAX_JUMP, ROUNDED_TIMES * count)):
                    raise SignalFileError(path, f"its times jump by {strayed:.3g} samples after row {count}")
                record = replace(first, values=record.values, notes=record.notes)
            count += len(values)
            if checked_gaps(gaps) == "interpolate":
                record = replace(record, values=_filled(record.values))
            yield record, fraction
        for said_of_end in _end_checked(path, packed, layout, count):
            warn(said_of_end, UserWarning)


def _bridged(
    path: Path, values: np.ndarray, layout: CsvLayout, gaps: str | None, channels: Sequence[str] | None
) -> list[str]:
    """Fill columns that may be written in some rows only, in place; say of which, and how many rows.

    Raises
    ------
    SignalFileError
        If a speed is missing for long, beside rows in which it is there, or a load in less than half of them, `gaps`
        does not say what to do, and neither `channels` do without it.
    """
    said = []
    for i in layout.slow:
        there = np.flatnonzero(np.isfinite(values[:, i]))
        lost = len(values) - there.size
        if not lost or not there.size:
            continue
        steps = np.diff(there, prepend=-1, append=len(values))
        longest, usual = int(steps.max()) - 1, float(np.median(steps))
        name = layout.names[i]
        missing = f"{name!r} is empty in {lost} of {len(values)} rows, in up to {longest} in a row"
        refuse = checked_gaps(gaps) == "refuse" and not _may_be_left_out(i, layout, channels)
        if refuse and role_of(name, layout.units[i]) is None and i not in layout.own and 2 * lost < len(values):
            # a load that is written as often as vibration may be analysed
            raise SignalFileError(path, f"{missing}; {REMEDY}, or {CHOOSE}")
        odd = longest > max(LONGEST_EMPTY * len(values), LONGEST_STEP * usual)
        if odd and role_of(name, layout.units[i]) == "speed" and refuse:
            raise SignalFileError(
                path, f"{missing}, too many to tell the speed; pass gaps='interpolate' (--gaps interpolate) for "
                "straight lines across them, or channels=[...] (--channel) without it"
            )  # fmt: skip
        values[:, [i]] = _filled(values[:, [i]])
        said.append(f"{missing}, and interpolated.")
    return said


def _filled(values: np.ndarray) -> np.ndarray:
    """A block with its gaps interpolated; gaps at its ends hold the nearest sample, so that no row is lost."""
    bad = ~np.isfinite(values)
    if not bad.any():
        return values
    out = values.copy()
    at = np.arange(len(values))
    for c in np.flatnonzero(bad.any(axis=0)):
        good = ~bad[:, c]
        if good.any():
            out[:, c] = np.interp(at, at[good], values[good, c])
    return out


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except (EOFError, gzip.BadGzipFile, zlib.error) as exc:
        raise SignalFileError(path, f"its gzip data is damaged or cut short ({exc})") from exc


def _layout(path: Path, packed: bool, pulses: bool = False) -> CsvLayout:
    with _open_text(path, packed) as (text, _):
        head = [line for line, _ in zip(text, range(HEAD_LINES))]
    if any("\x00" in line for line in head):
        raise SignalFileError(path, "holds binary data, not text; is it in another format?")
    printed = _holds_printed_minus(path, packed)
    head = list(map(with_minus, head)) if printed else head
    layout = scope_layout(head) or find_layout(head, path)
    layout = replace(layout, printed=True) if printed else layout
    rows = [split_cells(line, layout.separator) for line in head[layout.first :] if not COMMENT.match(line)]
    threes = None if layout.halves else thousands_column(rows, layout.names, layout.decimal)
    if threes is not None:
        raise SignalFileError(
            path,
            f"{threes[0]!r} holds {threes[1]!r} beside numbers below 1000 without {layout.decimal!r}, which looks like "
            f"one between thousands; {WITHOUT}, or all of them with the same decimals",
        )
    plain, said = without_thousands(layout.meta) if layout.decimal == "," else (layout.meta, [])
    layout = replace(layout, meta=plain, notes=[*layout.notes, *said])
    groups = () if pulses or layout.stamps else own_clocks(layout.names, layout.units)
    clocks = [clock for clock, _ in groups]
    return replace(layout, groups=groups, index=None if layout.index in clocks else layout.index)


class _Rewritten(io.TextIOBase):
    """A text whose lines are written anew."""

    def __init__(self, text: io.TextIOBase, written: Callable[[str], str]) -> None:
        self.text, self.written, self.rest = text, written, ""

    def read(self, size: int | None = -1) -> str:
        """Return so many characters of the rows, as whole rows where they are longer; all that are left of -1."""
        lines = self.text.readlines(-1 if size is None or size < 0 else size)
        self.rest += "".join(map(self.written, lines))
        taken = self.rest if size is None or size < 0 else self.rest[:size]
        self.rest = self.rest[len(taken) :]
        return taken


def _with_plain_numbers(layout: CsvLayout) -> Callable[[str], str]:
    """Return what makes numbers as Python has them of a line."""
    signed = with_minus if layout.printed else str
    return (lambda line: pointed(signed(line))) if layout.halves else signed


def _holds_printed_minus(path: Path, packed: bool) -> bool:
    """Return whether a text holds one of the signs that are printed for a minus."""
    with open(path, "rb") as raw:
        stream: IO[bytes] = gzip.GzipFile(fileobj=raw) if packed else raw  # type: ignore[assignment]
        piece = stream.read(TAIL_READ)
        encoding = encoding_of(piece[: 1 << 16])
        if encoding in ("utf-16", "utf-32"):
            encoding += "-le" if piece[:1] == b"\xff" else "-be"
        signs = [sign.encode(encoding, errors="ignore") for sign in MINUS]
        while piece:
            if any(sign and sign in piece for sign in signs):
                return True
            rest = stream.read(TAIL_READ)
            piece = piece[-4:] + rest if rest else b""
    return False


class _WrongCell(SignalFileError):
    """A column that holds something else than a number in a row."""

    def __init__(self, path: Path, fault: str, column: int) -> None:
        super().__init__(path, fault)
        self.column = column


def _may_be_left_out(column: int, layout: CsvLayout, channels: Sequence[str] | None) -> bool:
    """Return whether a column is none of those asked for, if some are, nor needed with them."""
    apart = (layout.clock, layout.index, *layout.stamps)
    asked = channels is not None and layout.names[column] not in (*channels, *SHAFT_COLUMNS)
    return asked and column not in apart


def _blocks(
    path: Path, packed: bool, layout: CsvLayout, gaps: str | None, seen: Words
) -> Iterator[tuple[np.ndarray, pd.DataFrame | None, float]]:
    """Tables of numbers (NaN in columns of time stamps, which come as text beside them), and the fraction read."""
    width, first, separator = len(layout.names), layout.first, layout.separator
    size = path.stat().st_size
    refuse = checked_gaps(gaps) == "refuse"
    words, slow = (*layout.stamps, *layout.beside), layout.slow
    kinds: dict[int, Any] = {i: str if i in words else float for i in range(width)}
    try:
        with _open_text(path, packed) as (text, raw):
            for _ in range(first):
                text.readline()
            table = pd.read_csv(
                _Rewritten(text, _with_plain_numbers(layout)) if layout.halves or layout.printed else text,
                sep=r"\s+" if separator is None else separator,
                decimal=layout.decimal,
                header=None,
                names=list(range(width)),
                index_col=False,
                dtype=kinds,
                na_values=GAPS,
                comment="#",
                skip_blank_lines=True,
                skipinitialspace=True,
                chunksize=CHUNK_ROWS,
                **EXACT,
            )
            for block in table:
                stamped = block[list(layout.stamps)] if layout.stamps else None
                seen.add(block)
                numbers = block.drop(columns=list(words)) if words else block
                values = np.full((len(block), width), np.nan)
                values[:, numbers.columns] = numbers.to_numpy()
                values[is_missing(values)] = np.nan
                wanted = [i for i in range(width) if i not in {*words, *layout.empty, *slow}]
                if refuse and not np.isfinite(values[:, wanted]).all():
                    raise ValueError("missing values")
                yield values, stamped, min(1.0, raw.tell() / size)
    except (ValueError, pd.errors.ParserError) as exc:
        if isinstance(exc, SignalError):
            raise
        fault, column = _first_bad_line(path, packed, layout, width, refuse, exc)
        raise (SignalFileError(path, fault) if column is None else _WrongCell(path, fault, column)) from exc


def _record(
    path: Path,
    values: np.ndarray,
    clock: np.ndarray | None,
    layout: CsvLayout,
    given: float | None,
    pulses: bool = False,
) -> Record:
    candidates = rate_candidates(layout.meta)
    t0 = number_of(layout.meta.get("t0"))
    start = 0.0 if t0 is None else t0[0]
    notes = list(layout.notes)
    dropped = {*layout.stamps, *layout.empty, *layout.beside}
    dropped |= set() if layout.clock is None else {layout.clock}
    if layout.index is not None:
        # a heading that means rows is believed sooner than none or any other
        fewest = 2 if layout.names[layout.index].strip().lower() in INDEX_NAMES else FEWEST_EVEN
        meaning, seconds = index_meaning(values[:, layout.index], clock, fewest)
        if meaning is not None:
            dropped.add(layout.index)
            notes.append(meaning)
            clock = seconds if seconds is not None else clock
            second = layout.names[1].strip() if len(layout.names) > 1 else "none"
            # with a colon it is a line of the header
            bare = (second == "ch2" or second.endswith(":")) and layout.units[1].lower() in ("", UNKNOWN_UNITS)
            if clock is None and bare and values.shape[1] - len(dropped) > 1 and 1 not in dropped:
                # beside the numbers of the rows, and without a heading that says otherwise
                times = values[:, 1]
                even = len(times) >= FEWEST_EVEN and rises_evenly(times) and not np.all(np.diff(times) == 1.0)
                if even and float(times[1] - times[0]) <= LONGEST_SECONDS:
                    dropped.add(1)
                    notes.append("The second column rises evenly; it is taken for the time in s.")
                    clock = times
    rate: float | None = None
    said: list[str] = []
    if clock is not None and len(clock) > 1:
        start = float(clock[0])
        by_clock = rate_about_even(clock) if pulses else rate_by_times(clock, path, given, bool(candidates))
        if by_clock is not None and candidates:
            sure = [c for c in candidates if not c.weak]
            candidates = [*sure, RateCandidate("the column of times", by_clock), *(c for c in candidates if c.weak)]
        rate = by_clock
    if candidates:
        rate, said = chosen_rate(path, candidates, given)
    speed, more = speed_of(layout.meta)
    own = layout.meta.get("speed")
    teeth = layout.meta.get("teeth")
    try:
        teeth = None if teeth is None else check_teeth(json.loads(teeth) if isinstance(teeth, str) else teeth)
        speed = float(own) if isinstance(own, (int, float)) else speed
    except (SignalError, ValueError, TypeError) as exc:
        raise SignalFileError(path, f"its header is not understood: {exc}") from exc
    kept = [i for i in range(len(layout.names)) if i not in dropped]
    if not kept:
        raise SignalFileError(path, f"holds no column of samples beside {layout.names}")
    attrs = layout.meta.get("attrs", {})
    told = {} if COUNT in layout.meta else layout.meta
    factors = {i: named_factors(told, words_of(layout.names[i])) for i in kept}
    scales = [scale_told(layout.names[i], layout.units[i], values[:, i], factors[i]) for i in kept]
    notes += [words for words in scales if words is not None]
    return Record(
        values if len(kept) == values.shape[1] else values[:, kept],
        [layout.names[i] for i in kept],
        [layout.units[i] for i in kept],
        rate,
        start,
        speed,
        teeth,
        attrs if isinstance(attrs, dict) else {},
        [*notes, *said, *more],
    )


def write_csv(record: Record, path: Path, packed: bool, progress: Progress | None = None) -> None:
    """Write a text table whose numbers read back to the same bits; `packed` for gzip."""
    with open(path, "wb") as raw:
        stream: IO[bytes] = gzip.GzipFile(fileobj=raw, mode="wb", filename="", mtime=0) if packed else raw  # type: ignore
        with io.TextIOWrapper(stream, encoding="utf-8", newline="\n") as text:
            meta = {"sampling_rate": record.rate, "t0": record.t0, "speed": record.speed, "teeth": record.teeth}
            for key, value in meta.items():
                if value is not None:
                    text.write(f"# {key}: {json.dumps(value)}\n")
            text.write(f"# {COUNT}: {len(record.values)}\n")
            if record.attrs:
                text.write(f"# attrs: {json.dumps(json_value(record.attrs))}\n")
            cells = [f"{name} [{unit}]" for name, unit in zip(record.names, record.units)]
            text.write(",".join(_quoted(cell) for cell in cells) + "\n")
            count = record.values.shape[0]
            for start in range(0, count, CHUNK_ROWS):
                block = pd.DataFrame(record.values[start : start + CHUNK_ROWS])
                # in numpy's legacy print mode, which other packages set, numbers would lose digits
                with np.printoptions(legacy=False):
                    block.to_csv(text, header=False, index=False, lineterminator="\n")
                if progress is not None:
                    progress(min(1.0, (start + CHUNK_ROWS) / count), "writing")


def _first_bad_line(
    path: Path, packed: bool, layout: CsvLayout, width: int, refuse: bool, exc: Exception
) -> tuple[str, int | None]:
    """Return what is wrong in words, and the column of which it is the only fault."""
    with _open_text(path, packed) as (text, _):
        for number, line in enumerate(text, 1):
            if number <= layout.first or not line.strip() or COMMENT.match(line):
                continue
            cells = split_cells(_with_plain_numbers(layout)(line).split("#")[0], layout.separator)
            if layout.separator == "\t" and len(cells) == width - 1 and layout.empty:
                cells.append("")
            if len(cells) > width or (refuse and len(cells) < width):
                return f"line {number} has {len(cells)} values where {width} are expected: {line.strip()[:60]!r}", None
            for column, cell in enumerate(cells):
                if column in (*layout.stamps, *layout.empty, *layout.beside):
                    continue
                kind = cell_kind(cell, layout.decimal)
                if kind == "gap" and refuse and column not in layout.slow:
                    shown = f"{cell[:40]!r}" if cell else "nothing"
                    others = f", or {CHOOSE}" if width > MOST_ALONE else ""
                    return f"line {number} holds {shown} in column {layout.names[column]!r}; {REMEDY}{others}", column
                sign = between_thousands(cell)
                if kind not in ("number", "gap") and sign is not None:
                    return f"line {number} holds {cell[:40]!r}, with {sign!r} between thousands; {WITHOUT}", column
                if kind not in ("number", "gap"):
                    shown = f"{cell[:40]!r} in column {layout.names[column]!r}"
                    remedy = f"; {CHOOSE}" if width > MOST_ALONE else ""
                    return f"line {number} holds {shown}, which is not a number{remedy}", column
                value = float(cell.replace(",", ".") if layout.decimal == "," else cell) if kind == "number" else 0.0
                if refuse and is_missing(np.array(value)) and column not in layout.slow:
                    return f"line {number} holds {cell[:40]!r}, which instruments write for no number; {REMEDY}", None
    return f"cannot be read as a table ({exc})", None


def _quoted(cell: str) -> str:
    return '"' + cell.replace('"', '""') + '"' if any(c in cell for c in ',"\n') else cell


def _is_utf16(head: bytes) -> bool:
    return head.startswith((b"\xff\xfe", b"\xfe\xff")) or utf16_without_mark(head) is not None


def _is_text(head: bytes) -> bool:
    text = head.decode("utf-8", errors="replace")
    odd = sum(1 for c in text if (ord(c) < 32 and c not in "\t\r\n\f\x1a") or c == "\ufffd")
    return "\x00" not in text and odd <= MOST_ODD * len(text)


def _format(packed: bool, contents: dict[str, Content], also: tuple[str, ...] = ()) -> Format:
    def read(path: Path, asked: Asked) -> Record:
        if asked.content == "lvm":
            return read_lvm(path, asked.rate, asked.channels)
        return read_csv(path, packed, asked.progress, asked.rate, asked.gaps, asked.pulses, asked.channels)

    def pieces(path: Path, asked: Asked) -> Iterator[tuple[Record, float]] | None:
        if asked.content == "lvm":
            return None
        with _damage_named(path):
            layout = _layout(path, packed)
        return None if layout.groups else csv_pieces(path, packed, asked.rate, asked.gaps, layout, asked.channels)

    def write(record: Record, path: Path, progress: Progress | None) -> None:
        write_csv(record, path, packed, progress)

    return Format(read=read, write=write, pieces=pieces, contents=contents, also=also, through="pandas")


FORMATS = {
    "csv": _format(
        False,
        {
            "utf16": Content("text in UTF-16", _is_utf16),
            "text": Content("plain text", _is_text, rest=True),
        },
        also=("lvm",),
    ),
    "csv.gz": _format(True, {"gzip": Content("gzip data", begins_with(b"\x1f\x8b"))}),
}
