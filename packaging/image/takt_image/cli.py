# SPDX-License-Identifier: Apache-2.0
"""The command line of `takt image`."""
import datetime
import os
import pathlib
import shutil
import sys
import tempfile

from . import base, bundle, disk, flash, graph, packages, qemu, system, tools, update, words

EXAMPLES = """Example: takt image build --graph graph/ace.yaml --machine vision_pc.yaml --keys robot_keys
Exit 0: done, 1: the machine refuses or fails, 2: bad input, 3: a program or the system fails."""


def home():
    """The checkout or the installation that this belongs to."""
    return pathlib.Path(os.environ.get("TAKT_HOME") or "/usr/share/takt")


def takt():
    """The command that reads machine files."""
    beside = pathlib.Path(sys.argv[0]).parent / "takt"
    found = os.environ.get("TAKT") or (str(beside) if beside.is_file() else shutil.which("takt"))
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
    debs = packages.find(options.packages, home(), options.with_package) if options.packages else None
    tools.need("dpkg-deb", "mmdebstrap", "zstd", "mksquashfs", "sfdisk", "mcopy", "mkfs.vfat", "grub-mkimage", *(["rauc"] if key else []))
    os.environ["SOURCE_DATE_EPOCH"] = packages.epoch(home())
    debs = (debs or packages.find(None, home(), options.with_package)) + options.deb
    release = system.Release(options.version or packages.version(debs[0]), "amd64")
    out = options.output.resolve()
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
    top = words.Parser(prog="takt image", description="builds, tries, writes and updates machines that boot into a graph", epilog=EXAMPLES)
    commands = top.add_subparsers(dest="command", required=True)

    def command(name, purpose, call, example):
        made = commands.add_parser(name, help=purpose, description=purpose, epilog=f"Example: {example}")
        made.set_defaults(call=call)
        return made.add_argument

    add = command("build", "makes a disk and an update from a graph and a machine file", build,
                  "takt image build --graph graph/ace.yaml --machine vision_pc.yaml --keys robot_keys")
    add("--graph", type=words.text_file, required=True, metavar="FILE", help="the graph that the machine runs")
    add("--machine", type=words.text_file, required=True, metavar="FILE", help="the machine file (docs/machine.md)")
    add("--keys", type=words.input_folder, metavar="FOLDER", help="update.key and update.pem of `takt image keys`: the update is signed with them")
    add("--profile", metavar="NAME", help="the profile of the graph (default: the graph's own)")
    add("--output", type=words.output_folder, default=pathlib.Path("image"), metavar="NEW-FOLDER", help="where the files go (default: image)")
    add("--packages", type=words.input_folder, metavar="FOLDER", help="the .deb files of Takt (default: a checkout builds its own)")
    add("--with-package", action="append", default=[], metavar="NAME", help="another package of Takt, such as takt-web")
    add("--deb", type=words.package, action="append", default=[], metavar="FILE", help="another .deb file, such as that of your own robot")
    add("--files", type=words.input_folder, metavar="FOLDER", help="is copied over the root")
    add("--version", metavar="WORD", help="of the release (default: that of the packages)")
    add("--slot", type=int, metavar="MIB", help="size of a slot (default: a third more than this release needs)")
    add("--mirror", metavar="URL", help="a mirror of Debian (default: that of this machine, if it is a Debian 12)")
    add("--fresh", action="store_true", help="makes the base again, with the packages that Debian has today")
    add("--raw", action="store_true", help="leaves out takt.img.zst")

    add = command("run", "boots a disk under QEMU, on a copy", run, "takt image run image/takt.img --until 'is good'")
    add("image", type=words.disk, metavar="FILE", help="takt.img")
    add("--uefi", action="store_true", help="UEFI instead of BIOS")
    add("--memory", type=int, default=1024, metavar="MIB", help="of the machine (default: 1024)")
    add("--keep", type=pathlib.Path, metavar="DISK", help="keeps what the machine writes, for a next run")
    add("--accel", choices=("auto", "kvm", "tcg"), default="auto", help="KVM, or TCG, which emulates a processor (default: KVM where the processor has it)")
    add("--until", metavar="PATTERN", help="ends with exit 0 at the first line of the console that has it")
    add("--seconds", type=float, default=600, metavar="FLOAT", help="exit 1 if --until has not come by then (default: 600)")

    add = command("write", "writes a disk onto one of this computer, and compares it", write, "sudo takt image write image/takt.img.zst /dev/sdX")
    add("image", type=words.input_file, metavar="FILE", help="takt.img, plain or as .zst or .xz")
    add("device", metavar="DEVICE", help="a whole disk that nothing uses")
    add("--yes", action="store_true", help="does not ask")

    add = command("update", "installs an update over SSH and waits for its self-test", send, "takt image update root@robot image/takt.raucb")
    add("host", metavar="HOST", help="a machine with `ssh: keys` in its machine file")
    add("bundle", type=words.bundle, metavar="FILE", help="takt.raucb")
    add("--ssh", default="ssh", metavar="COMMAND", help="the program and its options (default: ssh)")

    add = command("keys", "makes a key and a certificate for updates", keys, "takt image keys robot_keys")
    add("folder", type=words.output_folder, metavar="NEW-FOLDER", help="gets update.key, which stays with you, and update.pem, which goes into images")
    return top


def main(arguments):
    options = parser().parse_args(arguments)
    try:
        return options.call(options)
    except tools.Failure as failure:
        print(f"takt image: {failure}", file=sys.stderr)
        return failure.code
    except KeyboardInterrupt:
        return tools.NOT_OK
