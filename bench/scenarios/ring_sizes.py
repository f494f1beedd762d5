# SPDX-License-Identifier: Apache-2.0
"""How much the ring of a run takes, looked at from outside: for scenarios that keep one for long."""
import contextlib
import json
import os
import pathlib
import subprocess
import threading


def in_memory(ring):
    """Where the images of the run lie whose job events lie in that folder; None before there are any."""
    file = max(ring.glob("*.mcap"), default=None)
    return file and pathlib.Path("/dev/shm") / f"takt-flight-{file.stem.rsplit('-', 1)[0]}"


def size_mb(folder):
    total = 0
    for file in folder.glob("*.mcap") if folder else []:
        try:
            total += file.stat().st_size
        except FileNotFoundError:  # it had to go for a newer one
            pass
    return total / 1e6


@contextlib.contextmanager
def main_graph(rules):
    """A copy of the main graph with these rules of `record`, beside it, for as long as that lasts."""
    folder = pathlib.Path(__file__).resolve().parents[2] / "graph"
    graph = folder / f".ring_{os.getpid()}.yaml"
    graph.write_text("\n".join(f"record: {{{rules}}}" if line.startswith("record:") else line
                               for line in (folder / "ace.yaml").read_text().split("\n")))
    try:
        yield graph
    finally:
        graph.unlink()


def jobs_in(ring):
    """How many jobs its files hold, and how many are missing between the first and the last one of each file."""
    takt = os.environ.get("TAKT", str(pathlib.Path(__file__).resolve().parents[2] / "takt"))
    kept = missing = 0
    for file in sorted(ring.glob("*.mcap")):
        info = json.loads(subprocess.run([takt, "log", "info", str(file), "--json"], capture_output=True, text=True).stdout)
        kept += sum(node["jobs"] for node in info["nodes"])
        missing += sum(node.get("missing", 0) for node in info["nodes"])
    return kept, missing


class Sizes(threading.Thread):
    """The most that the ring in that folder (OUTPUT/flight/ring) took on disk and in memory, looked at ten times a second."""

    def __init__(self, ring, limits_mb):
        super().__init__(daemon=True)
        self.ring, self.limits_mb, self.ended = ring, limits_mb, threading.Event()
        self.most_mb = dict.fromkeys(limits_mb, 0.0)
        self.looks = 0
        self.start()

    def run(self):
        while not self.ended.wait(0.1):
            self.looks += 1
            for place, folder in (("disk", self.ring), ("memory", in_memory(self.ring))):
                if place in self.most_mb:
                    self.most_mb[place] = max(self.most_mb[place], size_mb(folder))

    def kept_within(self):
        """Ends the looking, prints what it saw; false if a place was ever above its limit, or never used."""
        self.ended.set()
        for place, mb in self.most_mb.items():
            print(f"{place}: at most {mb:.1f} MB of {self.limits_mb[place]} in {self.looks} looks")
        return all(0 < mb <= self.limits_mb[place] for place, mb in self.most_mb.items())
