"""WAV: samples as 64-bit floats, everything else in the file's own comment field (LIST/INFO/ICMT).

Cue points, as recorders and wave editors set them, are kept with their labels; three or more become a channel of
pulses.
"""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.table import Content, Format
from gearmbs.signals.signal.record import Record, metadata_json, record_from_json
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

BLOCK = 1 << 17
CUE = "cue tacho"
"""Channel of the cue points, whose name says that they are no vibration."""
FEWEST_CUES = 3
"""Cue points that may be pulses of a shaft: fewer give no speed, and are marks of an editor."""
POINT = 24
"""Bytes of a cue point: number, place in the play list, chunk, its start, its block, sample."""


@dataclass
class _Beside:
    """What stands in a file beside its samples: this package's comment, cue points as samples, their labels."""

    comment: str | None = None
    cues: dict[int, int] = field(default_factory=dict)
    labels: dict[int, str] = field(default_factory=dict)


def read_wav(path: Path) -> Record:
    """Read a WAV file; integer samples become fractions of full scale.

    Raises
    ------
    SignalFileError
        If a chunk is cut short, there are no samples, or the comment contradicts the header.
    """
    from scipy.io import wavfile

    beside = _check_chunks(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, data = wavfile.read(path)
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as WAV ({exc})") from exc
    return _record(path, data, rate, beside, 0, len(data))


def wav_pieces(path: Path) -> Iterator[tuple[Record, float]] | None:
    """Read a WAV file block by block, or return None for sample sizes that cannot be (24 bits).

    Raises
    ------
    SignalFileError
        As `read_wav`.
    """
    from scipy.io import wavfile

    beside = _check_chunks(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, data = wavfile.read(path, mmap=True)
    except Exception:
        return None
    count = len(data)
    return (
        (_record(path, data[start : start + BLOCK], rate, beside, start, count), min(start + BLOCK, count) / count)
        for start in range(0, count, BLOCK)
    )


def _record(path: Path, data: np.ndarray, rate: int, beside: _Beside, start: int, count: int) -> Record:
    """Return samples from the one numbered start on, of count in all."""
    values = data[:, None] if data.ndim == 1 else data
    if values.dtype == np.uint8:
        values = (values.astype(float) - 128.0) / 128.0
    elif values.dtype.kind == "i":
        values = values / float(-int(np.iinfo(values.dtype).min))
    values = values.astype(float)
    if beside.comment is not None:
        record = record_from_json(values, beside.comment, path)
        if record.rate is None or abs(record.rate - rate) > 0.51:
            raise SignalFileError(
                path, f"its header says {rate} Hz, its comment {record.rate} Hz; one of them is wrong"
            )
    else:
        names = [f"ch{i + 1}" for i in range(values.shape[1])]
        record = Record(values, names, [UNKNOWN_UNITS] * len(names), float(rate))
    marks = sorted((sample, number) for number, sample in beside.cues.items() if sample < count)
    if marks:
        record.attrs["cue"] = [
            {"time": sample / rate, "label": beside.labels.get(number, "")} for sample, number in marks
        ]
    at = np.unique([sample for sample, _ in marks])
    if at.size >= FEWEST_CUES:
        pulses = _pulses(at, np.arange(start, start + len(values)))
        record.values = np.column_stack([record.values, pulses])
        record.names, record.units = [*record.names, CUE], [*record.units, UNKNOWN_UNITS]
        record.notes = [*record.notes, f"{at.size} cue points are the rising edges of channel {CUE!r}."]
    return record


def _pulses(marks: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return a wave that rises through a half at each mark and is high until halfway to the next."""
    ends = np.append(marks[1:], 2 * marks[-1] - marks[-2])
    last = np.searchsorted(marks, samples, side="right") - 1
    since, pitch = samples - marks[last], (ends - marks)[last]
    return np.where(last < 0, 0.0, np.where(since == 0, 0.5, np.where(since < 0.5 * pitch, 1.0, 0.0)))


def write_wav(record: Record, path: Path) -> None:
    """Write 64-bit float samples and the metadata as a comment."""
    if record.rate is None or round(record.rate) < 1:
        raise SignalFileError(path, f"a WAV file cannot hold the sampling rate {record.rate} Hz; use another format")
    from scipy.io import wavfile

    buffer = io.BytesIO()
    wavfile.write(buffer, round(record.rate), record.values)
    text = metadata_json(record).encode("utf-8") + b"\0"
    text += b"\0" * (len(text) % 2)
    body = b"INFO" + b"ICMT" + struct.pack("<I", len(text)) + text
    buffer.seek(0, io.SEEK_END)
    if buffer.tell() % 2:
        buffer.write(b"\0")
    buffer.write(b"LIST" + struct.pack("<I", len(body)) + body)
    size = buffer.tell() - 8
    buffer.seek(4)
    buffer.write(struct.pack("<I", size))
    path.write_bytes(buffer.getbuffer())


def _check_chunks(path: Path) -> _Beside:
    """Walk the chunks; return what stands beside the samples."""
    total = path.stat().st_size
    beside = _Beside()
    with open(path, "rb") as file:
        kind = file.read(12)[:4]
        if kind == b"RF64":
            return beside
        word = ">I" if kind == b"RIFX" else "<I"
        seen_data = False
        while (header := file.read(8)) and len(header) == 8:
            name, size = header[:4], struct.unpack(word, header[4:])[0]
            start = file.tell()
            if start + size > total:
                raise SignalFileError(
                    path,
                    f"is cut short: its {name.decode('latin-1')!r} chunk promises {size} bytes, "
                    f"{total - start} are there",
                )
            seen_data |= name == b"data" and size > 0
            if name == b"LIST":
                body = file.read(size)
                at = body.find(b"ICMT")
                if body[:4] == b"INFO" and at >= 0:
                    length = struct.unpack(word, body[at + 4 : at + 8])[0]
                    text = body[at + 8 : at + 8 + length].rstrip(b"\0").decode("utf-8", errors="replace")
                    beside.comment = text if text.startswith('{"sampling_rate"') else None
                elif body[:4] == b"adtl":
                    beside.labels |= _labels(body, word)
            elif name == b"cue ":
                body = file.read(size)
                for at in range(4, size - POINT + 1, POINT):
                    number, sample = (struct.unpack(word, body[at + k : at + k + 4])[0] for k in (0, POINT - 4))
                    beside.cues[number] = sample
            file.seek(start + size + size % 2)
    if not seen_data:
        raise SignalFileError(path, "holds no samples")
    return beside


def _labels(body: bytes, word: str) -> dict[int, str]:
    """Return the labels of cue points by their numbers, of a list of associated data."""
    found, at = {}, 4
    while at + 12 <= len(body):
        size, number = struct.unpack(word, body[at + 4 : at + 8])[0], struct.unpack(word, body[at + 8 : at + 12])[0]
        if body[at : at + 4] == b"labl":
            found[number] = body[at + 12 : at + 8 + size].rstrip(b"\0").decode("utf-8", errors="replace")
        at += 8 + size + size % 2
    return found


FORMATS = {
    "wav": Format(
        read=lambda path, asked: read_wav(path),
        write=lambda record, path, progress: write_wav(record, path),
        pieces=lambda path, asked: wav_pieces(path),
        contents={
            "wav": Content("a WAV file", lambda head: head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE")
        },
        through="SciPy, 64-bit floats; metadata in the comment chunk",
    )
}
