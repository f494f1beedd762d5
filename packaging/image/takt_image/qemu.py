# SPDX-License-Identifier: Apache-2.0
"""A machine that is not there: the image under QEMU. Without root, without a network, on a copy of the disk that is not kept unless asked."""
import os
import pathlib
import re
import select
import shutil
import socket
import subprocess
import tempfile
import time

from . import tools

FIRMWARE = pathlib.Path("/usr/share/OVMF")
DISK_GIB = 4


def kvm_runs():
    """Whether guests run with /dev/kvm. That it can be opened says nothing: where the processor shows no virtualisation of its own, a guest
    gets through its BIOS and then hangs."""
    flags = re.search(r"^flags\s*:(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return os.access("/dev/kvm", os.R_OK | os.W_OK) and flags is not None and bool({"vmx", "svm"} & set(flags[1].split()))


class Guest:
    """A started machine. `lines` has what its serial line said so far; as a context it ends with the block.

        with Guest(disk) as guest:
            guest.wait_for("is good", 300)"""

    def __init__(self, disk, uefi=False, memory=1024, kept=None, stick=None, shell=False, kvm=None, echo=None, watchdog=False):
        """`kept`: a file that takes what the guest writes, made if it is not there; None: it is forgotten. `stick`: a further disk, read-only.
        `shell`: the socket of a test image's shell is opened. `echo`: called with each line."""
        tools.need("qemu-system-x86_64", "qemu-img")
        self.work = tempfile.TemporaryDirectory(prefix="takt-guest-")
        folder = pathlib.Path(self.work.name)
        self.lines, self.echo, self.rest = [], echo, ""
        self.began = time.monotonic()
        overlay = pathlib.Path(kept) if kept else folder / "disk.qcow2"
        if not overlay.exists():
            tools.run("qemu-img", "create", "-q", "-f", "qcow2", "-b", pathlib.Path(disk).resolve(), "-F", "raw", overlay, f"{DISK_GIB}G")
        self.kvm = kvm_runs() if kvm is None else kvm
        words = ["qemu-system-x86_64", "-accel", "kvm" if self.kvm else "tcg,thread=multi", "-cpu", "host" if self.kvm else "max", "-smp", "2", "-m", str(memory),
                 "-display", "none", "-serial", "stdio", "-monitor", "none", "-nic", "none", "-device", "virtio-rng-pci",
                 "-drive", f"file={overlay},format=qcow2,if=virtio,cache=none" if os.environ.get("TAKT_IMAGE_UNCACHED") else f"file={overlay},format=qcow2,if=virtio"]
        if stick:
            words += ["-drive", f"file={stick},format=raw,if=virtio,readonly=on"]
        if watchdog:
            words += ["-device", "i6300esb", "-action", "watchdog=reset"]
        if uefi:
            code = FIRMWARE / "OVMF_CODE_4M.fd"
            if not code.exists():
                raise tools.Failure("these packages are missing; run:  sudo apt install ovmf")
            shutil.copy(FIRMWARE / "OVMF_VARS_4M.fd", folder / "vars.fd")
            words += ["-drive", f"if=pflash,format=raw,readonly=on,file={code}", "-drive", f"if=pflash,format=raw,file={folder / 'vars.fd'}"]
        self.socket = None
        if shell:
            self.socket = folder / "shell"
            words += ["-device", "virtio-serial-pci", "-chardev", f"socket,id=shell,path={self.socket},server=on,wait=off", "-device", "virtserialport,chardev=shell,name=takt.shell"]
        self.process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.connection = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()
        self.work.cleanup()

    def kill(self):
        """As if the power went."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()

    def read(self, seconds):
        """Takes what the serial line says within that time; False once the guest has ended."""
        ready, _, _ = select.select([self.process.stdout], [], [], seconds)
        if not ready:
            return True
        content = os.read(self.process.stdout.fileno(), 65536)
        text = self.rest + content.decode(errors="replace").replace("\r", "")
        *lines, self.rest = text.split("\n")
        for line in lines:
            line = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", line)
            self.lines.append((time.monotonic() - self.began, line))
            if self.echo:
                self.echo(line)
        return bool(content)

    def wait_for(self, pattern, seconds, since=0):
        """The first line from number `since` on that has the pattern, and its number. Fails after that time, with the last lines."""
        end, at = time.monotonic() + seconds, since
        while True:
            for number in range(at, len(self.lines)):
                if re.search(pattern, self.lines[number][1]):
                    return number, self.lines[number]
            at = len(self.lines)
            if time.monotonic() >= end or not self.read(min(1, max(0, end - time.monotonic()))):
                last = "\n".join(line for _, line in self.lines[-15:])
                raise tools.Failure(f"no line with `{pattern}` within {seconds} s:\n{last}", tools.NOT_OK)

    def ask(self, command, seconds=120):
        """What a command prints in the guest of a test image, and its exit code."""
        if self.connection is None:
            self.connection = socket.socket(socket.AF_UNIX)
            self.connection.connect(str(self.socket))
        mark = f"--{time.monotonic_ns()}--"
        self.connection.sendall(f"{{ {command}\n}} 2>&1; echo {mark}$?\n".encode())
        text, end = "", time.monotonic() + seconds
        while mark not in text or not text.endswith("\n"):
            if time.monotonic() > end:
                raise tools.Failure(f"`{command}` did not end within {seconds} s:\n{text[-1000:]}", tools.NOT_OK)
            self.read(0)
            ready, _, _ = select.select([self.connection], [], [], 0.2)
            if ready:
                content = self.connection.recv(65536)
                if not content:
                    raise tools.Failure(f"the guest ended during `{command}`", tools.NOT_OK)
                text += content.decode(errors="replace")
        printed, code = text.rsplit(mark, 1)
        return printed.strip("\n"), int(code)
