# SPDX-License-Identifier: Apache-2.0
"""Machines on one host, for scenarios of several: a network namespace for each, and cables.

    with Spaces({"robot": "10.93.0.1", "vision": "10.93.0.2"}) as spaces:
        run = spaces.begin("robot", takt, "run", graph, "--machine", "robot")

Two are joined by one cable. With `middle` each has a cable to a namespace of that name, where its end has the machine's name; what
joins those ends there is the caller's. They are gone afterwards, whatever happens. As root, with ip (iproute2).
"""
import os
import subprocess


def ip(*words):
    subprocess.run(["ip", *words], check=True)


class Spaces:
    def __init__(self, machines, middle=None, mtu=None):
        self.addresses, self.middle = machines, middle
        self.names = {machine: f"takt-{machine}-{os.getpid()}" for machine in (*machines, *([middle] if middle else []))}
        self.end = ["mtu", str(mtu)] if mtu else []

    def __enter__(self):
        for name in self.names.values():
            ip("netns", "add", name)
        if self.middle:
            for machine in self.addresses:
                self._cable((machine, "cable"), (self.middle, machine))
                self.ip(self.middle, "link", "set", machine, "up")
        else:
            self._cable(*((machine, "cable") for machine in self.addresses))
        for machine, address in self.addresses.items():
            self.ip(machine, "addr", "add", f"{address}/24", "dev", "cable")
            for device in ("cable", "lo"):
                self.ip(machine, "link", "set", device, "up")
        return self

    def __exit__(self, *_):
        for name in self.names.values():
            subprocess.run(["ip", "netns", "del", name], check=False)

    def ip(self, machine, *words):
        ip("-n", self.names[machine], *words)

    def begin(self, machine, *words, **how):
        return subprocess.Popen(["ip", "netns", "exec", self.names[machine], *map(str, words)], text=True, **how)

    def _cable(self, one, two):
        self.ip(one[0], "link", "add", one[1], *self.end, "type", "veth", "peer", "name", two[1], *self.end, "netns", self.names[two[0]])
