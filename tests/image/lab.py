# SPDX-License-Identifier: Apache-2.0
"""Images for tests, each built once in a folder: releases that are good, and some that are not."""
import os
import pathlib
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "packaging/image"))
sys.dont_write_bytecode = True

from takt_image import bundle, qemu, tools  # noqa: E402

# Releases that are not good, and some that differ: files over those of a good one.
OTHER = {
    "refuses": {"etc/takt/machine/refuses": "a test\n"},
    "panics": {"usr/sbin/init": "#!/bin/sh\nmount -t proc proc /proc\necho c >/proc/sysrq-trigger\n"},
    "hangs": {"usr/sbin/init": "#!/bin/sh\nwhile :; do sleep 1000; done\n"},
}


MIGRATION = "keep kept fresh\nsed -i 's/^/new /' kept\necho 1 >fresh\n"
NEWER = {"usr/share/takt/image/data_version": "2\n", "usr/share/takt/image/migrate/1": MIGRATION}
OTHER["migrates"] = NEWER
OTHER["migrates_refuses"] = {**NEWER, **OTHER["refuses"]}
OTHER["migration_fails"] = {**NEWER, "usr/share/takt/image/migrate/1": MIGRATION + "echo 'no room' >&2\nfalse\n"}


class Lab:
    def __init__(self, folder, packages=None):
        self.folder = folder
        self.packages = packages
        folder.mkdir(parents=True, exist_ok=True)
        self.keys = self.key("keys")

    def key(self, name):
        folder = self.folder / name
        if not (folder / "update.pem").exists():
            bundle.make_keys(folder)
        return folder

    def build(self, version, other=None, keys=None, slot=None):
        """The folder of a release: takt.img, takt.raucb, system.img. `other`: a kind of OTHER."""
        out = self.folder / f"release-{version}"
        if (out / "takt.raucb").exists():
            return out
        overlay = self.folder / "overlay"
        shutil.rmtree(overlay, ignore_errors=True)
        shutil.copytree(ROOT / "tests/image/guest", overlay, symlinks=True)
        for path, text in OTHER.get(other, {}).items():
            (overlay / path).parent.mkdir(parents=True, exist_ok=True)
            (overlay / path).write_text(text)
            (overlay / path).chmod(0o755)
        words = [str(ROOT / "takt"), "image", "build", "--graph", str(ROOT / "graph/lasers.yaml"), "--machine", str(ROOT / "packaging/machines/qemu.yaml"), "--keys",
                 str(keys or self.keys), "--version", version, "--files", str(overlay), "--output", str(out), "--raw", "--slot", str(slot or 512)]
        if self.packages:
            words += ["--packages", str(self.packages)]
        subprocess.run(words, check=True)
        return out

    def stick(self, bundle_file):
        """A disk with one file, update.raucb, as somebody carries it to the robot."""
        tools.need("mkfs.vfat", "mcopy")
        disk = bundle_file.with_suffix(".stick")
        if not disk.exists():
            with open(disk, "wb") as file:
                file.truncate(bundle_file.stat().st_size + (16 << 20))
            tools.run("mkfs.vfat", "-n", "UPDATE", disk)
            tools.run("mcopy", "-i", disk, bundle_file, "::update.raucb")
        return disk


def facts(guest):
    """What a booted machine is."""
    script = ". /usr/libexec/takt/machine/common; echo $(release) $(slot) $(uname -r) $(cat /sys/kernel/realtime) $(findmnt -no FSTYPE,OPTIONS / | cut -c1-12 | tr ' ' -) $([ -d /sys/firmware/efi ] && echo UEFI || echo BIOS)"
    text, _ = guest.ask(script)
    release, slot, kernel, realtime, root, firmware = text.split()
    return {"release": release, "slot": slot, "kernel": kernel, "realtime": realtime == "1", "root": root, "firmware": firmware}
