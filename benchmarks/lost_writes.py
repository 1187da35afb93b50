"""A power cut on paper: operations on files are traced as they are carried out, and what was not safe is lost.

What is taken to be safe is what POSIX promises and no more: the content of a file after ``fsync`` of the file, the
entry of a name in its folder after ``fsync`` of the folder. Entries that are not safe are lost or not, each by itself,
at random; a name may so stand for a content that is not safe, of which then any part is there.
"""

from __future__ import annotations

import json
import os
import random
import shutil
from pathlib import Path
from typing import Any


class Recorder:
    """Traces what is done to the files below a folder.

    Parameters
    ----------
    root : Path
    """

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()
        self.log = self.root.with_name("trace")
        self.start = self.root.with_name("start")

    def begin(self) -> None:
        """Take what is there now for safe."""
        shutil.rmtree(self.start, ignore_errors=True)
        shutil.copytree(self.root, self.start)
        self.log.mkdir(exist_ok=True)

    def trace(self) -> None:
        """Trace this process from now on."""
        fsync, replace, link, unlink, mkdir = os.fsync, os.replace, os.link, os.unlink, os.mkdir
        steps = (self.log / "steps").open("a")

        def note(kind: str, *paths: Any, **told: Any) -> None:
            names = [os.path.abspath(os.fsdecode(p)) for p in paths]
            if all(name.startswith(str(self.root)) for name in names):
                names = [os.path.relpath(name, self.root) for name in names]
                steps.write(json.dumps([kind, *names, told]) + "\n")
                steps.flush()

        def content(path: Any) -> str:
            name = f"{len(os.listdir(self.log))}"
            shutil.copyfile(path, self.log / name)
            return name

        def new_fsync(handle: int) -> None:
            path = os.readlink(f"/proc/self/fd/{handle}")
            if path.startswith(str(self.root)):
                note("entries", path) if os.path.isdir(path) else note("content", path, copy=content(path))
            fsync(handle)

        def new_replace(source: Any, target: Any, **kwargs: Any) -> None:
            if os.path.abspath(target).startswith(str(self.root)):
                note("replace", source, target, copy=content(source))
            replace(source, target, **kwargs)

        def new_link(source: Any, target: Any, **kwargs: Any) -> None:
            link(source, target, **kwargs)
            note("replace", source, target, copy=content(target))

        def new_unlink(path: Any, **kwargs: Any) -> None:
            unlink(path, **kwargs)
            note("unlink", path)

        def new_mkdir(path: Any, *args: Any, **kwargs: Any) -> None:
            mkdir(path, *args, **kwargs)
            note("mkdir", path)

        os.fsync, os.replace, os.link, os.unlink, os.mkdir = new_fsync, new_replace, new_link, new_unlink, new_mkdir

    def cut(self, chance: random.Random) -> None:
        """Leave of the folder what a power cut at some moment may leave."""
        lines = (self.log / "steps").read_text().splitlines()
        steps = [json.loads(line) for line in lines[: chance.randint(1, len(lines))]]
        shutil.rmtree(self.root)
        shutil.copytree(self.start, self.root)
        safe_content: dict[str, str] = {}
        for k, (kind, *paths, told) in enumerate(steps):
            if kind == "content":
                safe_content[paths[0]] = told["copy"]
            if kind not in ("replace", "unlink", "mkdir"):
                continue
            name = paths[-1]
            # the entry is safe if its folder was brought to the disk later
            safe = any(s[0] == "entries" and s[1] == (os.path.dirname(name) or ".") for s in steps[k + 1 :])
            if not safe and chance.random() < 0.5:
                continue
            place = self.root / name
            if not place.parent.is_dir():
                # the folder itself is lost
                continue
            if kind == "mkdir":
                place.mkdir(exist_ok=True)
            elif kind == "unlink":
                place.unlink(missing_ok=True)
            else:
                data = (self.log / told["copy"]).read_bytes()
                kept = safe_content.get(paths[0])
                if kept is None or (self.log / kept).read_bytes() != data:
                    data = data[: chance.randint(0, len(data))]
                place.write_bytes(data)
