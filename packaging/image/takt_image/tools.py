# SPDX-License-Identifier: Apache-2.0
"""What all steps share: other programs, their failures, and how long each step took."""
import contextlib
import os
import pathlib
import shutil
import subprocess
import sys
import time

OK, NOT_OK, BAD_INPUT, SYSTEM = 0, 1, 2, 3  # exit codes, as every takt command has them

# Which Debian package has a program.
PACKAGES = {
    "grub-editenv": "grub-common", "grub-mkimage": "grub-common", "mcopy": "mtools", "mkfs.vfat": "dosfstools", "mksquashfs": "squashfs-tools",
    "mmdebstrap": "mmdebstrap", "openssl": "openssl", "qemu-img": "qemu-utils", "qemu-system-x86_64": "qemu-system-x86", "rauc": "rauc", "sfdisk": "fdisk",
    "unshare": "util-linux", "xz": "xz-utils", "zstd": "zstd",
}


class Failure(Exception):
    """What went wrong, in words for the user; `code` is the exit code."""

    def __init__(self, text, code=SYSTEM):
        super().__init__(text)
        self.code = code


def say(text):
    """A line for the user. Results go to stdout, the way there to stderr."""
    print(f"takt image: {text}", file=sys.stderr, flush=True)


def need(*programs, files=()):
    """Fails with the command that installs what is missing. `files`: pairs of a path and its package."""
    os.environ["PATH"] = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"  # where an ordinary user does not look
    missing = {PACKAGES.get(name, name) for name in programs if shutil.which(name) is None}
    missing |= {package for path, package in files if not os.path.exists(path)}
    if missing:
        raise Failure(f"these packages are missing; run:  sudo apt install {' '.join(sorted(missing))}")


def run(*command, stdin=None, cwd=None, env=None):
    """Runs a program and returns what it printed. Fails with the end of its output."""
    command = [str(word) for word in command]
    done = subprocess.run(command, input=stdin, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=cwd, env=env, check=False)
    text = done.stdout.decode(errors="replace")
    if done.returncode:
        raise Failure(f"{command[0]} ended with {done.returncode}:\n" + "\n".join(text.splitlines()[-25:]))
    return text


@contextlib.contextmanager
def step(what):
    """Reports the seconds of a step once it is done."""
    began = time.monotonic()
    yield
    say(f"{what}: {time.monotonic() - began:.0f} s")


def megabytes(path):
    return pathlib.Path(path).stat().st_size / 1e6


def cache_folder():
    folder = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "takt" / "image"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
