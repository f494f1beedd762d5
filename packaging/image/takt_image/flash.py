# SPDX-License-Identifier: Apache-2.0
"""Writes an image to a disk of this machine, after looking twice."""
import json
import os
import pathlib
import stat
import subprocess
import sys

from . import tools


def device_facts(device):
    """Size, model, and what is mounted from it."""
    listed = json.loads(tools.run("lsblk", "--json", "--bytes", "--output", "PATH,TYPE,SIZE,MODEL,RM,RO,MOUNTPOINTS", device))["blockdevices"][0]
    mounted = [place for part in [listed, *listed.get("children", [])] for place in part.get("mountpoints") or [] if place]
    return listed, mounted


def opened(image):
    """A process that prints the image, unpacked."""
    command = {".xz": ["xz", "--decompress", "--stdout"], ".zst": ["zstd", "--decompress", "--stdout"]}.get(image.suffix, ["cat"])
    tools.need(command[0])
    return subprocess.Popen([*command, str(image)], stdout=subprocess.PIPE)


def unpacked_bytes(image):
    if image.suffix == ".xz":
        try:
            return int(tools.run("xz", "--robot", "--list", image).splitlines()[-1].split("\t")[4])
        except tools.Failure as failure:
            raise tools.Failure(f"{image} is damaged: {failure}", tools.BAD_INPUT) from None
    if image.suffix == ".zst":
        process = opened(image)
        size = 0
        while block := process.stdout.read(1 << 20):
            size += len(block)
        if process.wait():
            raise tools.Failure(f"{image} is damaged", tools.BAD_INPUT)
        return size
    return image.stat().st_size


def write(image, device, yes=False):
    """Writes and reads back. Refuses what is no whole disk, is too small, is in use, or read-only."""
    tools.need("lsblk")
    if not image.is_file():
        raise tools.Failure(f"{image}: there is no such image", tools.BAD_INPUT)
    try:
        if not stat.S_ISBLK(os.stat(device).st_mode):
            raise tools.Failure(f"{device} is no disk; `lsblk` lists them", tools.BAD_INPUT)
    except OSError as error:
        raise tools.Failure(f"{device}: {error.strerror}; `lsblk` lists disks", tools.BAD_INPUT) from None
    facts, mounted = device_facts(device)
    if facts["type"] not in ("disk", "loop"):
        raise tools.Failure(f"{device} is a {facts['type']}; an image takes a whole disk", tools.BAD_INPUT)
    if mounted:
        raise tools.Failure(f"{device} is in use: {', '.join(mounted)}", tools.BAD_INPUT)
    if facts["ro"]:
        raise tools.Failure(f"{device} is read-only", tools.BAD_INPUT)
    size = unpacked_bytes(image)
    if size > facts["size"]:
        raise tools.Failure(f"{device} has {facts['size'] / 1e6:.0f} MB, the image {size / 1e6:.0f}", tools.BAD_INPUT)
    if not yes:
        print(f"All of {device} ({(facts['model'] or 'no model').strip()}, {facts['size'] / 1e9:.1f} GB) is overwritten. Go on? Type yes: ", end="", file=sys.stderr, flush=True)
        if sys.stdin.readline().strip() != "yes":
            raise tools.Failure("nothing was written", tools.NOT_OK)
    with tools.step(f"{size / 1e6:.0f} MB written to {device} and read back"):
        copy_and_compare(image, device, size)


def copy_and_compare(image, device, size):
    try:
        target = os.open(device, os.O_RDWR | os.O_EXCL)  # which the kernel refuses while anything has a part of it
    except OSError as error:
        raise tools.Failure(f"{device}: {error.strerror}") from None
    with os.fdopen(target, "r+b", buffering=0) as disk:
        source = opened(image)
        while block := source.stdout.read(4 << 20):
            view = memoryview(block)
            while view:
                view = view[disk.write(view):]
        if source.wait():
            raise tools.Failure(f"{image} is damaged; {device} has a part of it", tools.BAD_INPUT)
        os.fsync(disk.fileno())
        os.posix_fadvise(disk.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        disk.seek(0)
        source = opened(image)
        at = 0
        while block := source.stdout.read(4 << 20):
            if disk.read(len(block)) != block:
                raise tools.Failure(f"{device} does not hold what was written, from byte {at} to {at + len(block)} on")
            at += len(block)
        source.wait()
    if at != size:
        raise tools.Failure(f"{device}: {at} bytes compared, {size} written")
