"""Files of data sets: written as a whole or not at all, and held against their digests when they are read."""

from __future__ import annotations

import hashlib
import json
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest

from gearmbs.campaigns import CampaignError
from gearmbs.campaigns.datasets import SensorLayers, make, read_data_set, write_data_set
from tests.campaigns.support import ringing
from tests.says import says

PARTS = {"test": 0.5, "validation": 0.0}


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Six specimens in two states."""
    return ringing(tmp_path_factory.mktemp("files") / "c")


@pytest.fixture(scope="module")
def written(campaign, tmp_path_factory):
    """Its data set."""
    out = tmp_path_factory.mktemp("files") / "data"
    write_data_set(campaign, out, **PARTS)
    return out


@pytest.fixture
def copied(written, tmp_path):
    """A copy of it, to be damaged."""
    return shutil.copytree(written, tmp_path / "data")


def contents(folder):
    """Return the digests of all files of a folder."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.mark.slow
def test_no_flipped_bit_is_read(copied):
    """Of 150 single bits 126 gave other numbers without a word."""
    whole = read_data_set(copied)
    generator = np.random.default_rng(0)
    files = sorted(copied.glob("data/*.parquet"))
    for _ in range(40):
        file = files[generator.integers(len(files))]
        content = file.read_bytes()
        flipped = bytearray(content)
        flipped[generator.integers(len(content))] ^= 1 << int(generator.integers(8))
        file.write_bytes(flipped)
        with pytest.raises(CampaignError, match=says(str(file), "SHA-256", "write the data set again")):
            read_data_set(copied)
        file.write_bytes(content)
    assert read_data_set(copied).equals(whole)


def test_files_that_are_missing_or_too_many(copied):
    whole = read_data_set(copied)
    first, *rest = sorted(copied.glob("data/*.parquet"))
    shutil.copy(first, copied / "data" / "more-00000-of-00001.parquet")
    with pytest.raises(CampaignError, match=says("more-00000-of-00001.parquet", "none of the data set")):
        read_data_set(copied)
    (copied / "data" / "more-00000-of-00001.parquet").unlink()
    first.rename(copied / "away")
    with pytest.raises(CampaignError, match=says(first.name, "croissant.json", "check=False")):
        read_data_set(copied)
    # a part of the splits will do who says so
    assert len(read_data_set(copied, check=False)) == sum(pq.read_metadata(file).num_rows for file in rest)
    (copied / "away").rename(first)
    card = copied / "croissant.json"
    text = card.read_text()
    card.unlink()
    with pytest.raises(CampaignError, match=says("croissant.json", "digests", "check=False")):
        read_data_set(copied)
    assert read_data_set(copied, check=False).equals(whole)
    for wrong in (text[: len(text) // 2], "[]", '{"distribution": [{"sha256": 1}]}'):
        card.write_text(wrong)
        with pytest.raises(CampaignError, match=says(str(card), "damaged")):
            read_data_set(copied)
    card.write_text(text)
    (first).write_bytes(b"PAR1")
    with pytest.raises(CampaignError, match=says(str(first), "cannot be read")):
        read_data_set(copied, check=False)


def test_other_readers_find_damaged_pages(copied, campaign, tmp_path):
    """Of data sets and of exports, by the checksum of each page."""
    exported = campaign.export(tmp_path / "out", "parquet")
    for file in (next(copied.glob("data/*.parquet")), exported[0]):
        pq.read_table(file, page_checksum_verification=True)
        group = pq.read_metadata(file).row_group(0)
        names = [group.column(k).path_in_schema for k in range(group.num_columns)]
        column = group.column(next(k for k, name in enumerate(names) if name.startswith("signal.")))
        content = bytearray(file.read_bytes())
        first = column.dictionary_page_offset or column.data_page_offset
        content[first + 3 * column.total_compressed_size // 4] ^= 1
        file.write_bytes(content)
        with pytest.raises(OSError, match="CRC"):
            pq.read_table(file, page_checksum_verification=True)


@pytest.mark.slow
def test_what_is_refused_leaves_the_former_data_set(copied, campaign, monkeypatch):
    (copied / "notes.txt").write_text("mine")
    before = contents(copied)
    wrong = [
        ({"published": "tomorrow"}, ("published", "tomorrow", "2026-01-31")),
        ({"withheld": (0.9, 0.1)}, ("withhold", "0.9", "lower end")),
        ({"test": 0.9, "validation": 0.9}, ("split", "6 groups", "too few")),
        ({"layers": 3}, ("layers", "3", "SensorLayers")),
    ]
    for settings, words in wrong:
        with pytest.raises(CampaignError, match=says(*words)):
            write_data_set(campaign, copied, **{**PARTS, **settings})
    with monkeypatch.context() as patch:
        patch.setattr(make, "write_croissant", lambda *_: (_ for _ in ()).throw(OSError("stale handle 7")))
        with pytest.raises(OSError, match="stale handle 7"):
            write_data_set(campaign, copied, **PARTS)
    assert contents(copied) == before


@pytest.mark.slow
def test_one_split_and_a_date_are_written(campaign, tmp_path):
    out = tmp_path / "data"
    write_data_set(campaign, out, test=0.0, validation=0.0, withheld=(2.0, 2.0), published="2026-01-31")
    assert set(read_data_set(out)["split"]) == {"train"}
    assert "specimens in two splits: 0" in (out / "README.md").read_text()
    assert json.loads((out / "croissant.json").read_text())["datePublished"] == "2026-01-31"


@pytest.mark.slow
def test_nothing_of_a_former_data_set_is_left(campaign, tmp_path):
    out = tmp_path / "data"
    write_data_set([campaign, ringing(tmp_path / "other", 21.0)], out, **PARTS)
    assert (out / "plan-pair-2.json").exists()
    (out / "notes.txt").write_text("mine")
    (out / "data" / "withheld-00000-of-00007.parquet").write_bytes(b"")
    (out / ".writing-abc").mkdir()
    paths = write_data_set(campaign, out, **PARTS)
    assert {*out.rglob("*")} == {*paths, out / "data", out / "notes.txt"}
    write_data_set(campaign, tmp_path / "new", **PARTS)
    assert contents(out).items() >= contents(tmp_path / "new").items()


def test_states_that_are_not_crossed_are_refused(tmp_path):
    """The level of a point would be that of its one state, and the noise would tell it."""
    with pytest.raises(CampaignError, match=says("state", "not crossed", "crossed=True")):
        write_data_set(ringing(tmp_path / "c", crossed=False), tmp_path / "data", **PARTS)
    assert not (tmp_path / "data").exists()


@pytest.mark.slow
def test_what_no_factor_varies_stands_in_the_case(tmp_path):
    write_data_set(ringing(tmp_path / "c", varied=False), tmp_path / "data", **PARTS)
    rows = read_data_set(tmp_path / "data")
    assert rows["operation.speed"].eq(100.0).all()
    assert rows["operation.torque"].between(5.0, 20.0).all()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("modes", -1),
        ("modes", 1.5),
        ("lowest", 0.0),
        ("highest", -5.0),
        ("damping", (0.0, 0.0)),
        ("damping", (0.08, 0.02)),
        ("noise", (0.2, 0.1)),
        ("noise", (-1.0, 1.0)),
        ("noise", 0.1),
        ("wander", -0.01),
        ("wander", 0.5),
        ("bits", 0),
        ("bits", 16.5),
        ("headroom", 0.0),
        ("headroom", float("nan")),
        ("seed", -1),
        ("paths", (1,)),
        ("noises", 5),
    ],
)
def test_layers_that_are_none(name, value):
    with pytest.raises(CampaignError, match=says("layers", name, "give")):
        SensorLayers(**{name: value})


def test_layers_at_the_ends_of_what_they_may_be():
    with pytest.raises(CampaignError, match=says("lowest", "6000", "highest", "100")):
        SensorLayers(lowest=6000.0, highest=100.0)
    layers = SensorLayers(modes=0, damping=[0.02, 0.02], noise=(0.0, 0.0), wander=0.0, bits=2, headroom=0.5, seed=0)
    assert layers.damping == (0.02, 0.02)
    assert SensorLayers(lowest="400 Hz").lowest == 400.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("bits", [2, 8, 16])
def test_nothing_clips_without_headroom(sign, bits):
    """Numbers of n bits reach less far up than down."""
    x = np.random.default_rng(0).standard_normal(3000)
    x *= sign * np.sign(x[np.argmax(np.abs(x))])
    layers = SensorLayers(headroom=1.0, bits=bits)
    largest = float(np.abs(x).max())
    values, clipped = layers.converted(x, layers.full_scale(largest))
    assert clipped == 0
    assert np.abs(values).max() == pytest.approx(largest, rel=1e-12)
    assert SensorLayers(headroom=0.9, bits=bits).converted(x, 0.9 * largest)[1] > 0
