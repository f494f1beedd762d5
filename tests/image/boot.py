#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An image is built and booted under BIOS and UEFI: boot.py [--work FOLDER] [--packages FOLDER]. Prints what each boot showed. Exit 1: something
is not as it should be; 77: it cannot be tried here."""
import argparse
import pathlib
import sys
import tempfile

import lab
from takt_image import qemu, tools

# (what, command in the guest, what it must print)
CHECKS = (
    ("no failed unit", "systemctl --failed --no-legend --plain | grep -v '^$' || true", ""),
    ("no listening socket but on loopback", "ss -ltnuH | awk '{print $5}' | grep -v '^127\\.\\|^\\[::1\\]' || true", ""),
    ("the root is read-only", "touch /etc/x 2>/dev/null && echo writable || true", ""),
    ("no setuid file", "find / -xdev -type f -perm /6000", ""),
    ("no world-writable file", "find / -xdev -type f -perm -002; find /var -xdev -type f -perm -002", ""),
    ("no password, no login", "cut -d: -f2 /etc/shadow | sort -u; pgrep -l 'getty|login' | grep -v logind || true", "!"),
    ("the graph runs", "systemctl is-active takt@lasers", "active"),
    ("the service is closed", "systemd-analyze security --no-pager takt@lasers | sed -n 's/.*exposure level for takt@lasers.service: \\([0-9.]*\\) .*/\\1/p' | awk '{print ($1 <= 2.2)}'", "1"),
    ("locked memory and real-time policies", "grep -l . /proc/[0-9]*/task/*/sched 2>/dev/null | xargs grep -h '^policy' 2>/dev/null | awk '$3 == 6 || $3 == 1' | wc -l | awk '{print ($1 > 0)}'", "1"),
    ("the watchdog is fed", "cat /sys/class/watchdog/watchdog0/state", "active"),
    ("the data partition has grown", "df --output=size -BM /var | tail -1 | tr -dc 0-9 | awk '{print ($1 > 1000)}'", "1"),
)


def boot(disk, uefi, failures):
    name = "UEFI" if uefi else "BIOS"
    with qemu.Guest(disk, uefi=uefi, shell=True, watchdog=True) as guest:
        _, (ready, _) = guest.wait_for(r"takt@lasers|takt: .*lasers: active|Started.*lasers|release .* is good", 300)
        _, (good, _) = guest.wait_for("is good", 300)
        said = lab.facts(guest)
        times, _ = guest.ask("systemctl show -p ActiveEnterTimestampMonotonic --value takt@lasers | awk '{printf \"%.1f\", $1 / 1e6}'; systemd-analyze time --no-pager | head -1")
        print(f"{name}: {said}; first line of the console after {ready:.0f} s, good after {good:.0f} s; takt@lasers ready {times}")
        for what, command, wanted in CHECKS:
            printed, _ = guest.ask(command)
            right = printed.strip() == wanted
            print(f"  {'yes' if right else 'NO'}: {what}" + ("" if right else f": {printed}"))
            failures += [] if right else [f"{name}: {what}"]
        if not (said["realtime"] and said["root"].startswith("squashfs-ro") and said["firmware"] == name):
            failures.append(f"{name}: {said}")
        guest.ask("takt status; journalctl -b --no-pager -u takt@lasers | tail -5")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", type=pathlib.Path)
    parser.add_argument("--packages", type=pathlib.Path)
    options = parser.parse_args()
    failures = []
    try:
        with tempfile.TemporaryDirectory(prefix="takt-image-") as temporary:
            built = lab.Lab(options.work or pathlib.Path(temporary), options.packages).build("1")
            for uefi in (False, True):
                boot(built / "takt.img", uefi, failures)
    except tools.Failure as failure:
        print(f"NOT RUN: {failure}" if "are missing" in str(failure) else f"FAILED: {failure}")
        return 77 if "are missing" in str(failure) else 1
    for what in failures:
        print("FAILED:", what)
    return bool(failures)


sys.exit(main())
