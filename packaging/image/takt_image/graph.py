# SPDX-License-Identifier: Apache-2.0
"""The graph of an image: one that Takt ships with, or one of a folder of its own."""
import pathlib
import re
import shutil

from . import tools

SHIPPED = pathlib.PurePosixPath("/usr/share/takt")
OWN = pathlib.PurePosixPath("/usr/share/takt-robot")


class Graph:
    def __init__(self, file, shipped, profile=None):
        """`shipped`: the folder that has `graph/` and `schedules/` of Takt here."""
        self.file = pathlib.Path(file).resolve()
        if not self.file.is_file():
            raise tools.Failure(f"{file}: there is no such graph file", tools.BAD_INPUT)
        self.profile = profile
        name = re.search(r"^name:\s*([a-z][a-z0-9_]*)\s*(?:#.*)?$", self.file.read_text(), re.MULTILINE)
        if not name:
            raise tools.Failure(f"{file}: a graph begins with `takt: 1` and `name: NAME`", tools.BAD_INPUT)
        self.name = name[1]
        root = shipped.resolve()
        self.shipped = SHIPPED / self.file.relative_to(root).as_posix() if self.file.is_relative_to(root / "graph") else None

    def copy_to(self, folder):
        """Writes /etc/takt/NAME.yaml, and the graph's own folder if Takt does not ship it."""
        graph = self.shipped
        if graph is None:
            graph = OWN / self.file.name
            shutil.copytree(self.file.parent, folder / str(OWN)[1:], ignore=shutil.ignore_patterns("build*", "out", ".*", "*.mcap", "*.cpp", "*.hpp"))
        text = f"# What the service takt@{self.name} of this image runs.\ntakt: 1\nname: {self.name}\ninclude: [{graph}]\n"
        if schedule := re.search(r"^schedule:\s*(\S+)", self.file.read_text(), re.MULTILINE):
            place = pathlib.PurePosixPath(str(graph.parent)) / schedule[1]
            parts = []
            for part in place.parts:  # without .. : /etc/takt is another folder
                parts = parts[:-1] if part == ".." else [*parts, part]
            text += f"schedule: {pathlib.PurePosixPath(*parts)}\n"
        if self.profile:
            text += f"default_profile: {self.profile}\n"
        place = folder / "etc/takt" / f"{self.name}.yaml"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
        wanted = folder / "etc/systemd/system/takt.target.wants"
        wanted.mkdir(parents=True, exist_ok=True)
        (wanted / f"takt@{self.name}.service").symlink_to("/lib/systemd/system/takt@.service")
