# SPDX-License-Identifier: Apache-2.0
"""The command line of `takt image`."""
import argparse
import datetime
import os
import pathlib
import shutil
import sys
import tempfile

from . import base, bundle, disk, flash, graph, packages, qemu, system, tools, update

EXAMPLES = """
Examples:
  takt image keys robot_keys                                      # once: who may update
  takt image build --graph graph/ace.yaml --machine vision_pc.yaml --keys robot_keys
  takt image run image/takt.img                                   # try it under QEMU
  sudo takt image write image/takt.img.xz /dev/sdX                # onto a disk
  takt image update root@robot image/takt.raucb                   # a robot that runs an earlier one

Exit 0: done, 1: the machine refuses or fails, 2: bad input, 3: a program or the system fails."""


def home():
    """The checkout or the installation that this belongs to."""
    return pathlib.Path(os.environ.get("TAKT_HOME") or "/usr/share/takt")


def takt():
    """The command that reads machine files."""
    found = os.environ.get("TAKT") or shutil.which("takt")
    if not found:
        raise tools.Failure("the command takt is not in PATH; set TAKT to it")
    return found


def build(options):
    began = datetime.datetime.now(datetime.timezone.utc)
    machine = system.Machine(takt(), options.machine)
    made_graph = graph.Graph(options.graph, home(), options.profile)
    keyring = list(machine.update_keys)
    key = certificate = None
    if options.keys:
        key, certificate = options.keys / "update.key", options.keys / "update.pem"
        for file in (key, certificate):
            if not file.is_file():
                raise tools.Failure(f"{file} is missing; `takt image keys {options.keys}` makes both", tools.BAD_INPUT)
        keyring.append(str(certificate))
    if not keyring:
        raise tools.Failure(f"nobody could update this image: name a folder with --keys, or `updates: {{keys: [...]}}` in {options.machine}", tools.BAD_INPUT)
    tools.need("dpkg-deb", "mmdebstrap", "zstd", "mksquashfs", "sfdisk", "mcopy", "mkfs.vfat", "grub-mkimage", *(["rauc"] if key else []))
    os.environ["SOURCE_DATE_EPOCH"] = packages.epoch(home())
    debs = packages.find(options.packages, home(), options.with_package) + options.deb
    release = system.Release(options.version or packages.version(debs[0]), "amd64")
    out = options.output
    out.mkdir(parents=True, exist_ok=True)
    root = base.build(debs, machine.packages, release.arch, options.mirror, options.fresh)
    with tempfile.TemporaryDirectory(dir=out, prefix="files-") as name:
        stage = pathlib.Path(name)
        system.stage_files(stage, made_graph, machine, release, keyring, options.files)
        listed, hashes = system.build(root, debs, stage, system.UNITS, out / "system.img")
    (out / "packages.txt").write_text(listed)
    (out / "files.sha256").write_text(hashes)
    disk.build(out / "system.img", machine.kernel_arguments, out / "takt.img", f"{machine.name}/{release.version}", options.slot)
    if key:
        bundle.build(out / "system.img", release, key, certificate, out / "takt.raucb")
    if not options.raw:
        with tools.step("packed"):
            tools.run("zstd", "--quiet", "--force", "-T0", "-6", out / "takt.img", "-o", out / "takt.img.zst")
    report(out, release, made_graph, machine, (datetime.datetime.now(datetime.timezone.utc) - began).total_seconds())
    return tools.OK


def report(out, release, made_graph, machine, seconds):
    print(f"release {release.version} of {release.compatible}: graph {made_graph.name} on {machine.name}, {seconds:.0f} s")
    for name in ("takt.img", "takt.img.zst", "takt.raucb", "system.img", "packages.txt", "files.sha256"):
        if (out / name).exists():
            print(f"  {out / name}: {tools.megabytes(out / name):.1f} MB")


def run(options):
    """Under QEMU, until it ends or Ctrl-C; what its serial line says goes to stdout."""
    def echo(line):
        print(line, flush=True)
    with qemu.Guest(options.image, uefi=options.uefi, memory=options.memory, kept=options.keep, kvm={"kvm": True, "tcg": False}.get(options.accel), echo=echo) as guest:
        tools.say(f"{'KVM' if guest.kvm else 'TCG, an emulated processor: deadlines will be missed'}; Ctrl-C ends it")
        try:
            if options.until:
                number, (seconds, _) = guest.wait_for(options.until, options.seconds)
                tools.say(f"`{options.until}` after {seconds:.1f} s, line {number + 1}")
                return tools.OK
            while guest.read(1):
                pass
        except KeyboardInterrupt:
            pass
    return tools.OK


def write(options):
    flash.write(options.image, options.device, options.yes)
    return tools.OK


def send(options):
    robot = update.Robot(options.host, options.ssh)
    update.follow(robot, update.install(robot, options.bundle))
    return tools.OK


def keys(options):
    key, certificate = bundle.make_keys(options.folder)
    print(f"{key}: stays with you; {certificate}: goes into images")
    return tools.OK


def parser():
    file, folder = pathlib.Path, pathlib.Path
    all_ = argparse.ArgumentParser(prog="takt image", description="Builds a machine that boots into a graph; tries, writes and updates it.", epilog=EXAMPLES,
                                   formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = all_.add_subparsers(dest="command", required=True, metavar="COMMAND")
    made = commands.add_parser("build", help="makes a disk and an update from a graph and a machine file")
    made.add_argument("--graph", type=file, required=True, help="the graph that the machine runs")
    made.add_argument("--machine", type=file, required=True, help="the machine file (docs/machine.md)")
    made.add_argument("--keys", type=folder, help="update.key and update.pem, as `takt image keys` makes them: signs the update")
    made.add_argument("--profile", help="the profile of the graph; without it the graph's own")
    made.add_argument("--output", type=folder, default=folder("image"), help="where the files go (image)")
    made.add_argument("--packages", type=folder, help="the .deb files of Takt; a checkout builds its own")
    made.add_argument("--with-package", action="append", default=[], metavar="NAME", help="another package of Takt, such as takt-web")
    made.add_argument("--deb", type=file, action="append", default=[], help="another .deb file, such as your own robot's")
    made.add_argument("--files", type=folder, help="copied over the root")
    made.add_argument("--version", help="of the release; that of the packages")
    made.add_argument("--slot", type=int, metavar="MIB", help="size of a slot; a third more than this release needs")
    made.add_argument("--mirror", help="a mirror of Debian")
    made.add_argument("--fresh", action="store_true", help="makes the base again, with today's packages of Debian")
    made.add_argument("--raw", action="store_true", help="leaves out takt.img.zst")
    made.set_defaults(call=build)
    ran = commands.add_parser("run", help="boots a disk under QEMU, on a copy")
    ran.add_argument("image", type=file)
    ran.add_argument("--uefi", action="store_true", help="UEFI instead of BIOS")
    ran.add_argument("--memory", type=int, default=1024, metavar="MIB")
    ran.add_argument("--keep", type=file, help="a file that keeps what the machine writes, for a next run")
    ran.add_argument("--accel", choices=("auto", "kvm", "tcg"), default="auto")
    ran.add_argument("--until", metavar="PATTERN", help="ends with exit 0 at the first line that has it")
    ran.add_argument("--seconds", type=float, default=600, help="for --until (600)")
    ran.set_defaults(call=run)
    wrote = commands.add_parser("write", help="writes a disk onto a disk of this computer and reads it back")
    wrote.add_argument("image", type=file)
    wrote.add_argument("device")
    wrote.add_argument("--yes", action="store_true", help="does not ask")
    wrote.set_defaults(call=write)
    sent = commands.add_parser("update", help="installs an update over SSH and waits for its self-test")
    sent.add_argument("host")
    sent.add_argument("bundle", type=file)
    sent.add_argument("--ssh", default="ssh", help="the program and its options")
    sent.set_defaults(call=send)
    keyed = commands.add_parser("keys", help="makes a key and a certificate for updates")
    keyed.add_argument("folder", type=folder)
    keyed.set_defaults(call=keys)
    return all_


def main(words):
    options = parser().parse_args(words)
    try:
        return options.call(options)
    except tools.Failure as failure:
        print(f"takt image: {failure}", file=sys.stderr)
        return failure.code
    except KeyboardInterrupt:
        return tools.NOT_OK
