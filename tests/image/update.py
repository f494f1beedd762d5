#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Updates of an image under QEMU: update.py [--work FOLDER] [--packages FOLDER] [--only NAME] [--good N] [--cuts N] [--seed N].

    refused    damaged, truncated, wrongly signed and older bundles are refused, and change nothing; so is one while the robot may move
    good       N good updates in a row, from slot to slot
    refuses    a release whose self-test fails; panics, hangs: one whose kernel panics, that never starts systemd
    torn       GRUB's variables are torn while the first slot is half written; both they and their copy are; an update succeeds all the same
    migrates   a release that brings the data forward; afterwards one of the old data is refused. Two that fail at it: the data are as before
    cuts       the power goes at N random instants of install, restart and self-test

Behind each bad one a good release runs after at most two boots, data are intact, and a further update succeeds. Exit 1: something is not as it
should be; 77: it cannot be tried here."""
import argparse
import os
import pathlib
import random
import sys
import tempfile
import time

import lab
from takt_image import qemu, tools

GOOD_S = 420
MOUNT = "mkdir -p /run/stick && mount -o ro /dev/vdb /run/stick"
INSTALL = f"rm -f /run/takt/no_update; {MOUNT} && rauc install /run/stick/update.raucb || {{ cat /run/takt/no_update; false; }}"
LET = "mkdir -p /run/takt && touch /run/takt/update_anyway"


class Machine:
    """One disk over many boots."""

    def __init__(self, image, folder):
        self.image, self.kept = image, folder / "machine.qcow2"
        self.kept.unlink(missing_ok=True)

    def boot(self, stick=None):
        return qemu.Guest(self.image, kept=self.kept, stick=stick, shell=True, watchdog=True)


def ready(guest, since=0):
    """Waits, from line `since` on, until a release has been judged good; what it is, and after how many boots."""
    number, _ = guest.wait_for(r"release \S+ in slot \S is good", 2 * GOOD_S, since)
    guest.connection = None  # a shell of an earlier boot
    said = [line for _, line in guest.lines[since:number] if "takt: slot" in line]
    boots = len(said) - 2 * sum("cannot be loaded" in line for line in said)  # that slot was said twice, and did not boot
    return settled(guest), boots


def settled(guest):
    """Facts of a machine whose release is good."""
    end = time.monotonic() + GOOD_S
    while True:
        try:
            text, _ = guest.ask("systemctl is-active takt-good", 30)
            if text == "active":
                return lab.facts(guest)
        except (tools.Failure, OSError):
            guest.connection = None
        if time.monotonic() > end:
            raise tools.Failure("no good release:\n" + "\n".join(line for _, line in guest.lines[-20:]), tools.NOT_OK)
        time.sleep(1)


def reason(text):
    """Of what RAUC printed, the line that says why."""
    lines = [line for line in text.splitlines() if "no_update" not in line] or [""]
    return next((line for line in lines if line.startswith("LastError") and "handler" not in line), lines[-1])


def updated(machine, stick):
    """Installs the update of a stick and restarts. What runs then, the reason of a refusal, and the number of boots to there."""
    with machine.boot(stick) as guest:
        ready(guest)
        guest.ask(LET)
        text, code = guest.ask(INSTALL, 600)
        if code:
            raise tools.Failure(f"install ended with {code}: {text}", tools.NOT_OK)
        since = len(guest.lines)
        guest.ask("systemctl --no-block reboot")
        said, boots = ready(guest, since)
        why, _ = guest.ask("cat /var/lib/takt/update/refused 2>/dev/null || true")
        guest.ask("sync; systemctl --no-block poweroff")
        end = time.monotonic() + 60
        while guest.process.poll() is None and time.monotonic() < end:
            guest.read(1)
        return said, why, boots


class Test:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.lab = lab.Lab(folder, options.packages)
        self.first = self.lab.build("1")
        self.failures = []

    def machine(self):
        return Machine(self.first / "takt.img", self.folder)

    def stick(self, *words, **keys):
        return self.lab.stick(self.lab.build(*words, **keys) / "takt.raucb")

    def check(self, right, what):
        print(f"  {'yes' if right else 'NO'}: {what}", flush=True)
        if not right:
            self.failures.append(what)

    def refused(self):
        good = self.lab.build("2") / "takt.raucb"
        content = good.read_bytes()
        damaged, short = self.folder / "damaged.raucb", self.folder / "short.raucb"
        damaged.write_bytes(content[:len(content) // 2] + bytes([content[len(content) // 2] ^ 1]) + content[len(content) // 2 + 1:])
        short.write_bytes(content[:len(content) * 2 // 3])
        foreign = self.lab.build("foreign", keys=self.lab.key("foreign_keys")) / "takt.raucb"
        machine = self.machine()
        older = self.lab.build("0") / "takt.raucb"
        for name, file, before in (("older", older, "systemctl stop takt@lasers"), ("while the robot may move", good, "true"), ("damaged", damaged, LET),
                                   ("truncated", short, LET), ("signed by another key", foreign, LET)):
            with machine.boot(self.lab.stick(file)) as guest:
                was, _ = ready(guest)
                guest.ask(before)
                text, code = guest.ask(INSTALL, 600)
                self.check(code != 0 and lab.facts(guest) == was, f"{name}: refused ({reason(text)})")
                guest.ask("sync")

    def good(self):
        machine = self.machine()
        for n in range(self.options.good):
            version = "2" if n % 2 == 0 else "1b"
            said, why, _ = updated(machine, self.stick(version))
            self.check(said["release"] == version and not why, f"update {n + 1}: release {said['release']} in slot {said['slot']}")

    def bad(self, kind):
        machine = self.machine()
        said, why, boots = updated(machine, self.stick(kind, other=kind))
        self.check(said["release"] == "1" and boots <= 2, f"{kind}: back at release {said['release']} after {boots} boots ({why or 'it never ran'})")
        said, _, _ = updated(machine, self.stick("2"))
        self.check(said["release"] == "2", f"{kind}: a further update gives release {said['release']}")

    def torn(self):
        machine = self.machine()
        said, _, _ = updated(machine, self.stick("2"))  # from here on slot B runs
        for name, damage in (("torn", ": >/boot/efi/grub/grubenv"), ("torn, and its copy", ": >/boot/efi/grub/grubenv; : >/boot/efi/grub/grubenv.copy")):
            with machine.boot() as guest:
                ready(guest)
                guest.ask(f"dd if=/dev/zero of=/dev/disk/by-partlabel/system-a bs=1M count=64 conv=notrunc; {damage}; sync")
            with machine.boot() as guest:
                said, boots = ready(guest)
                self.check(said["slot"] == "B" and boots <= 2, f"{name}: slot {said['slot']} runs after {boots} boots, slot A has no kernel")
                guest.ask("sync; systemctl --no-block poweroff")
                guest.read(20)
        said, _, _ = updated(machine, self.stick("3"))
        self.check(said["release"] == "3" and said["slot"] == "A", f"torn: release {said['release']} in slot {said['slot']} after an update")

    def data(self, guest):
        text, _ = guest.ask("cat /var/lib/takt/kept /var/lib/takt/fresh /var/lib/takt/machine/data_version 2>/dev/null; ls -d /var/lib/takt/machine/before 2>/dev/null")
        return " ".join(text.split())

    def migrates(self):
        machine = self.machine()
        with machine.boot() as guest:
            ready(guest)
            guest.ask("echo data >/var/lib/takt/kept; sync")
        for kind, ends, there in (("migrates_refuses", "1", "data 1"), ("migration_fails", "1", "data 1"), ("migrates", "migrates", "new data 1 2")):
            said, why, _ = updated(machine, self.stick(kind, other=kind))
            with machine.boot() as guest:
                ready(guest)
                now = self.data(guest)
                guest.ask("sync; systemctl --no-block poweroff")
                guest.read(20)
            self.check(said["release"] == ends and now == there, f"{kind}: release {said['release']} runs, data: {now} ({why or 'good'})")
        said, why, _ = updated(machine, self.stick("2"))
        self.check(said["release"] == "migrates" and "later release" in why, f"back to data of version 1: release {said['release']} runs ({why})")

    def cuts(self):
        chance = random.Random(self.options.seed)
        for n in range(self.options.cuts):
            machine = self.machine()
            stick = self.stick("2")
            with machine.boot(stick) as guest:
                ready(guest)
                guest.ask(f"{LET}; echo {n} >/var/lib/takt/kept; sync")
                guest.ask(f"({{ {INSTALL}; }} && sync && systemctl reboot) >/dev/null 2>&1 &")
                wait = chance.uniform(0, 150)
                end = time.monotonic() + wait
                while time.monotonic() < end:
                    guest.read(0.2)
                last = guest.lines[-1][1] if guest.lines else ""
            with machine.boot(stick) as guest:
                said, boots = ready(guest)
                kept, _ = guest.ask("cat /var/lib/takt/kept")
                guest.ask("sync; systemctl --no-block poweroff")
                guest.read(5)
            again, _, _ = updated(machine, stick)
            self.check(said["release"] in ("1", "2") and boots <= 2 and kept == str(n) and again["release"] == "2",
                       f"cut {n + 1} after {wait:.1f} s ({last[:40]}): release {said['release']} runs, data {'intact' if kept == str(n) else 'LOST'}, then release {again['release']}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", type=pathlib.Path)
    parser.add_argument("--packages", type=pathlib.Path)
    parser.add_argument("--only", action="append")
    parser.add_argument("--good", type=int, default=2)
    parser.add_argument("--cuts", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    os.environ["TAKT_IMAGE_UNCACHED"] = "1"
    with tempfile.TemporaryDirectory(prefix="takt-image-") as temporary:
        try:
            test = Test(options, options.work or pathlib.Path(temporary))
            for name, part in (("refused", test.refused), ("good", test.good), ("refuses", lambda: test.bad("refuses")), ("panics", lambda: test.bad("panics")),
                               ("hangs", lambda: test.bad("hangs")), ("torn", test.torn), ("migrates", test.migrates), ("cuts", test.cuts)):
                if options.only and name not in options.only:
                    continue
                began = time.monotonic()
                try:
                    part()
                except tools.Failure as failure:
                    test.check(False, f"{name}: {failure}")
                print(f"{name}: {time.monotonic() - began:.0f} s", flush=True)
        except tools.Failure as failure:
            print(f"NOT RUN: {failure}")
            return 77
    for what in test.failures:
        print("FAILED:", what.splitlines()[0])
    return bool(test.failures)


sys.exit(main())
