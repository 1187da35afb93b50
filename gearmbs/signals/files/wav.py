"""WAV: samples as 64-bit floats, everything else in the file's own comment field (LIST/INFO/ICMT)."""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.table import Content, Format
from gearmbs.signals.signal.record import Record, metadata_json, record_from_json
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

BLOCK = 1 << 17


def read_wav(path: Path) -> Record:
    """Read a WAV file; integer samples become fractions of full scale.

    Raises
    ------
    SignalFileError
        If a chunk is cut short, there are no samples, or the comment contradicts the header.
    """
    from scipy.io import wavfile

    comment = _check_chunks(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, data = wavfile.read(path)
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as WAV ({exc})") from exc
    return _record(path, data, rate, comment)


def wav_pieces(path: Path) -> Iterator[tuple[Record, float]] | None:
    """Read a WAV file block by block, or return None for sample sizes that cannot be (24 bits).

    Raises
    ------
    SignalFileError
        As `read_wav`.
    """
    from scipy.io import wavfile

    comment = _check_chunks(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, data = wavfile.read(path, mmap=True)
    except Exception:
        return None
    count = len(data)
    return (
        (_record(path, data[start : start + BLOCK], rate, comment), min(start + BLOCK, count) / count)
        for start in range(0, count, BLOCK)
    )


def _record(path: Path, data: np.ndarray, rate: int, comment: str | None) -> Record:
    values = data[:, None] if data.ndim == 1 else data
    if values.dtype == np.uint8:
        values = (values.astype(float) - 128.0) / 128.0
    elif values.dtype.kind == "i":
        values = values / float(-int(np.iinfo(values.dtype).min))
    values = values.astype(float)
    if comment is not None:
        record = record_from_json(values, comment, path)
        if record.rate is None or abs(record.rate - rate) > 0.51:
            raise SignalFileError(
                path, f"its header says {rate} Hz, its comment {record.rate} Hz; one of them is wrong"
            )
        return record
    names = [f"ch{i + 1}" for i in range(values.shape[1])]
    return Record(values, names, [UNKNOWN_UNITS] * len(names), float(rate))


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


def _check_chunks(path: Path) -> str | None:
    """Walk the chunks; return this package's comment if there is one."""
    total = path.stat().st_size
    comment = None
    with open(path, "rb") as file:
        kind = file.read(12)[:4]
        if kind == b"RF64":
            return None
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
                    comment = text if text.startswith('{"sampling_rate"') else None
            file.seek(start + size + size % 2)
    if not seen_data:
        raise SignalFileError(path, "holds no samples")
    return comment


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
