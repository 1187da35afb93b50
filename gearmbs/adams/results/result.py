"""The result of running a deck, with the files it can be written to."""

from __future__ import annotations

import re
from pathlib import Path

from gearmbs.adams.parse.commands import Linear
from gearmbs.adams.results.msg import message_text, request_text
from gearmbs.adams.results.record import RunRecord
from gearmbs.adams.results.res import results_text
from gearmbs.dae.analyses.plant import FORMATS, LinearPlant
from gearmbs.files import whole_file


class AdamsResult(RunRecord):
    """All analyses of a run, one after the other.

    Attributes
    ----------
    deck : Deck
    script : Script
    log : list of (Command, Segment, Modes, LinearPlant or None)
        The commands that were carried out, with what they gave.
    errors : list of Diagnostic
        What ended the script.
    """

    def write(self, prefix: str | Path) -> list[Path]:
        """Write .req, .res, .msg and .nc files; the message file alone when no analysis was carried out.

        The plants of LINEAR/STATEMAT go to the .mat files that the commands name, or to PREFIX_plant1.mat and so on.
        Each file appears when it is whole. Results of a run that was interrupted, or in
        which a routine of the user failed, are named PREFIX.partial.

        Parameters
        ----------
        prefix : path
            File name without extension; its directory is made when it does not exist.

        Returns
        -------
        list of Path
        """
        files = self.files(prefix)
        for path, content in zip(files, (message_text, request_text, results_text)):
            with whole_file(path) as part:
                part.write_text(content(self), encoding="utf-8", newline="\n")
        if self.segments:
            # in memory first: the format's library ends the program where the disk is full
            data = self.to_dataset().to_netcdf(engine="h5netcdf")
            with whole_file(files[-1]) as part:
                part.write_bytes(data)
        return files + self._write_plants(Path(prefix))

    def files(self, prefix: str | Path) -> list[Path]:
        """Return the names of the message file and, if there are any, of the files of results."""
        prefix = Path(prefix)
        results = prefix.name + (".partial" if self.partial else "")
        endings = (".req", ".res", ".nc") if self.segments else ()
        return [prefix.with_name(f"{prefix.name}.msg"), *(prefix.with_name(results + ending) for ending in endings)]

    def _write_plants(self, prefix: Path) -> list[Path]:
        found = [(c, p) for c, p in self.log if isinstance(c, Linear) and isinstance(p, LinearPlant)]
        files = []
        for k, (command, plant) in enumerate(found, 1):
            name = re.split(r"[\\/]", command.data_file)[-1] if command.data_file else f"{prefix.name}_plant{k}"
            files.append(plant.save(prefix.with_name(name if name.endswith(FORMATS) else f"{name}.mat")))
        return files
