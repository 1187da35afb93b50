"""Which kept kernels go into a wheel: those that this package's kernels would be looked for in."""

import shutil

from gearmbs.dae.equations.rotation import rotation_matrix
from gearmbs.kernels import cache, ship


def test_kernels_of_other_sources_are_left_out(tmp_path, monkeypatch):
    args = rotation_matrix.ready().declared_types()[0]
    own = cache.file_name(rotation_matrix, "entry", args)
    found = next(path for folder in cache.folders("gearmbs") if (path := folder / own).exists())
    kept = tmp_path / "gearmbs"
    kept.mkdir()
    shutil.copy(found, kept / own)
    # the same under the digest of other sources, and of a module that is no more
    shutil.copy(found, kept / f"{own.rpartition('-')[0]}-{'0' * 24}.entry")
    shutil.copy(found, kept / f"dae.no_more.rotation_matrix-{'0' * 24}.entry")
    (kept / f"dae.no_more.rotation_matrix-{'1' * 24}.part").write_bytes(b"cut")
    monkeypatch.setattr(cache, "own_folders", lambda package: (kept,))
    cache.folders.cache_clear()
    try:
        assert ship.current() == [own]
    finally:
        cache.folders.cache_clear()
