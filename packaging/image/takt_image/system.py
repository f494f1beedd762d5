# SPDX-License-Identifier: Apache-2.0
"""The system of a slot: the base with Takt and the settings of one machine in it, as one compressed file system."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

from . import tools

HERE = pathlib.Path(__file__).resolve().parents[1]
UNITS = ("takt-first-boot.service", "systemd-networkd.service", "systemd-resolved.service", "systemd-timesyncd.service")
# Of what a release leaves in /var: earlier ones refuse it. Whoever raises it adds files/usr/share/takt/image/migrate/OLD, a
# piece of shell that brings /var/lib/takt from there one version further (README.md).
DATA_VERSION = 1
SSHD = """# Keys only, as root, no password anywhere.
HostKey /var/lib/takt/machine/ssh_host_ed25519_key
AuthorizedKeysFile /etc/ssh/authorized_keys
PermitRootLogin prohibit-password
PasswordAuthentication no
KbdInteractiveAuthentication no
"""


class Machine:
    """A machine file as `takt machine show` reads it."""

    def __init__(self, takt, file):
        done = subprocess.run([takt, "machine", "show", str(file), "--json"], capture_output=True, text=True, check=False)
        if done.returncode:
            raise tools.Failure(done.stderr.rstrip(), done.returncode)
        self.file = pathlib.Path(file)
        shown = json.loads(done.stdout)
        self.name, self.kernel_arguments = shown["machine"], shown["kernel_arguments"]
        self.update_keys, self.ssh_keys = shown["update_keys"], shown["ssh_keys"]
        self.packages = shown["packages"] + (["openssh-server"] if self.ssh_keys else [])


class Release:
    """Which release of which image this is."""

    def __init__(self, version, arch):
        self.version, self.arch = version, arch
        self.compatible = f"takt-{arch}"


def stage_files(folder, graph, machine, release, keyring, overlay):
    """Fills a folder with what is copied over the root."""
    shutil.copytree(HERE / "files", folder, dirs_exist_ok=True)
    def write(path, text):
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    config = folder / "etc/rauc/system.conf"
    config.write_text(config.read_text().replace("@COMPATIBLE@", release.compatible))
    write("etc/rauc/keyring.pem", "".join(pathlib.Path(file).read_text() for file in keyring))
    write("etc/hostname", machine.name + "\n")
    write("etc/hosts", f"127.0.0.1 localhost\n127.0.1.1 {machine.name}\n::1 localhost\n")
    write("etc/takt/machine/graph", graph.name + "\n")
    # With its keys where it names them, which need not be below it.
    text = machine.file.read_text()
    write("etc/takt/machine/machine.yaml", text)
    for file in [*machine.update_keys, *machine.ssh_keys]:
        place = os.path.relpath(file, machine.file.resolve().parent)
        if place.startswith(".."):
            raise tools.Failure(f"{machine.file}: the key {file} is outside of its folder; an image takes only what lies below it", tools.BAD_INPUT)
        write(f"etc/takt/machine/{place}", pathlib.Path(file).read_text())
    if machine.ssh_keys:
        write("etc/ssh/authorized_keys", "".join(pathlib.Path(file).read_text() for file in machine.ssh_keys))
        write("etc/ssh/sshd_config.d/60-takt.conf", SSHD)
    write("usr/share/takt/image/data_version", f"{DATA_VERSION}\n")
    write("usr/share/takt/image/release", f"IMAGE_ID={release.compatible}\nIMAGE_VERSION={release.version}\n")
    graph.copy_to(folder)
    if overlay:
        shutil.copytree(overlay, folder, dirs_exist_ok=True, symlinks=True)


def namespaces():
    """The words in front of a command that give it mounts and processes of its own, and make an ordinary user root there."""
    words = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]
    return words if os.geteuid() == 0 else [*words, "--map-auto", "--map-root-user"]


def build(base, debs, stage, units, result):
    """The file system of a slot, `result`; returns the list of its packages and the hashes of its files."""
    tools.need("unshare", "mksquashfs", "zstd")
    with tools.step("system: Takt in the base, compressed"), tempfile.TemporaryDirectory(dir=result.parent, prefix="system-") as name:
        work = pathlib.Path(name)
        os.symlink(base, work / "base.tar.zst")
        (work / "debs").mkdir()
        for deb in debs:
            shutil.copy(deb, work / "debs")
        os.symlink(stage, work / "files")
        (work / "units").write_text("".join(f"{unit}\n" for unit in units))
        tools.run(*namespaces(), HERE / "install", work, env={**os.environ, "SOURCE_DATE_EPOCH": os.environ.get("SOURCE_DATE_EPOCH", "0")})
        (work / "system.img").rename(result)
        return (work / "packages").read_text(), (work / "hashes").read_text()
