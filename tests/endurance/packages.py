#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Debian packages as somebody meets them who installs them.

    packages.py                  builds them (packaging/debian/build), asks lintian, installs all in a bare Debian 12 (debootstrap, chroot),
                                 runs the main graph as the user `takt`, builds and tests a project of its own, purges them
    packages.py --built FOLDER   with packages that were built before
    packages.py --twice          builds them a second time in another folder: both must be the same, bit for bit
    packages.py --root FOLDER    in that bare Debian, which is made if it is not there, and stays

Needs root, debootstrap, lintian, and the archive of Debian. Exit 1: something is not as it should be; 77: it cannot be tried here."""
import argparse
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

from outsider import Mounted, make_debian

ROOT = pathlib.Path(__file__).resolve().parents[2]
# What apt, dpkg, the loader and the machine itself write.
OTHERS = ("proc", "sys", "dev", "run", "tmp", "var/cache", "var/log", "var/lib/apt", "var/lib/dpkg", "etc/ld.so.cache", "packages", "etc/resolv.conf")
AS_TAKT = "runuser -u takt -- env HOME=/var/lib/takt"
STEPS = (
    ("takt --version", (0,)),
    ("man takt >/dev/null 2>&1 || test -e /usr/share/man/man1/takt.1.gz", (0,)),
    ("test -d /var/lib/takt || install -d -o takt -g takt /var/lib/takt", (0,)),
    (f"cd /var/lib/takt && {AS_TAKT} takt check /etc/takt/ace.yaml --policy cooperative", (0, 1)),
    (f"cd /var/lib/takt && {AS_TAKT} takt run /etc/takt/ace.yaml --policy cooperative --for 5s --output /var/lib/takt/ace", (0, 1)),
    (f"cd /var/lib/takt && {AS_TAKT} takt run /etc/takt/ace.yaml --clock virtual --for 2s --transport iceoryx --output /var/lib/takt/ace", (0,)),
    ("takt bench --help && takt eval --help && takt objects --help && takt web --help && takt image build --help", (0,)),
    ("python3 -c 'import takt; print(takt.__name__)'", (0,)),
    ("cd /tmp && takt new robot && cmake -S robot -B robot/build && cmake --build robot/build -j2 && ctest --test-dir robot/build", (0,)),
)


def say(good, what):
    print(("ok: " if good else "FAILED: ") + what, flush=True)
    return good


def hashes(folder):
    return {deb.name: hashlib.sha256(deb.read_bytes()).hexdigest() for deb in sorted(folder.glob("*.deb"))}


def build(folder):
    ended = subprocess.run([ROOT / "packaging/debian/build", folder])
    if ended.returncode: sys.exit(ended.returncode)


def lists(root):
    """Every file of the system but what others write, with what tells that it changed."""
    found = {}
    for folder, folders, files in os.walk(root):
        inside = os.path.relpath(folder, root)
        folders[:] = [name for name in folders if os.path.normpath(f"{inside}/{name}") not in OTHERS]
        for name in files + folders:
            path = os.path.normpath(f"{inside}/{name}")
            if path not in OTHERS: found[path] = os.lstat(f"{folder}/{name}").st_mode
    users = [(root / "etc" / name).read_text() for name in ("passwd", "group")]
    return found, users


def names_of_this_machine(root, packages):
    """Files of the packages in which a folder of this machine stands."""
    bad = []
    listed = subprocess.run(["chroot", root, "dpkg", "-L", *packages], capture_output=True, text=True).stdout.split("\n")
    for name in sorted(set(listed)):
        file = root / name.lstrip("/")
        if not name or not file.is_file() or file.is_symlink(): continue
        content = file.read_bytes()
        bad += [f"{name}: {word}" for word in (str(ROOT), "/tmp/tmp.") if word.encode() in content]
    return bad


def try_them(folder, root):
    good = True
    enter = ["chroot", root, "/usr/bin/env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/root", "DEBIAN_FRONTEND=noninteractive", "sh", "-c"]

    def step(command, codes=(0,)):
        ended = subprocess.run([*enter, command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        lines = ended.stdout.rstrip().splitlines()
        print("\n".join("  " + line for line in (lines[-4:] if ended.returncode in codes else lines[-40:])))
        return say(ended.returncode in codes, f"{command} (exit {ended.returncode})")

    shutil.rmtree(root / "packages", ignore_errors=True)
    shutil.copytree(folder, root / "packages")
    with Mounted(root):
        if not step("apt-get update"): return False
        before = lists(root)
        installed = subprocess.run([*enter, "dpkg-query -W -f '${Package}\\n'"], capture_output=True, text=True).stdout.split()
        if not step("apt-get install -y --no-install-recommends /packages/*.deb"): return False
        for command, codes in STEPS: good &= step(command, codes)
        packages = [name.split("_")[0] for name in hashes(folder)]
        bad = names_of_this_machine(root, packages)
        good &= say(not bad, "no file names a folder of this machine" + "".join(f"\n  {line}" for line in bad[:10]))
        good &= step("rm -rf /tmp/robot /root/.cache; apt-get install -y --reinstall --no-install-recommends /packages/*.deb")
        good &= step("apt-get purge -y " + " ".join(packages))
        there = subprocess.run([*enter, "dpkg-query -W -f '${Package}\\n'"], capture_output=True, text=True).stdout.split()
        good &= step("apt-get purge -y " + " ".join(sorted(set(there) - set(installed))) + " && apt-get autoremove -y --purge")
        after = lists(root)
    left = [path for path in sorted(after[0].keys() - before[0].keys()) if "takt" in path]
    others = len(after[0].keys() - before[0].keys()) - len(left)
    gone = sorted(before[0].keys() - after[0].keys())
    good &= say(not left and not gone, f"a purge leaves nothing ({others} files of other packages)" + "".join(f"\n  {path}" for path in (left + gone)[:20]))
    return good & say("takt" not in "".join(after[1]), "no user or group takt is left")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--built", type=pathlib.Path)
    parser.add_argument("--root", type=pathlib.Path)
    parser.add_argument("--twice", action="store_true")
    options = parser.parse_args()
    if os.geteuid() != 0 or not shutil.which("debootstrap") or not shutil.which("lintian"):
        print("NOT RUN: it needs root, debootstrap and lintian", file=sys.stderr)
        return 77
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        folder = options.built or work / "packages"
        if not options.built: build(folder)
        good = say(len(hashes(folder)) == 6, f"{len(hashes(folder))} packages")
        if options.twice:
            build(work / "again")
            good &= say(hashes(folder) == hashes(work / "again"), "two builds are the same")
        lint = subprocess.run(["lintian", "--fail-on=error", "--tag-display-limit=5", *map(str, sorted(folder.glob("*.deb")))], capture_output=True, text=True)
        print(lint.stdout)
        good &= say(lint.returncode == 0, "lintian finds no error")
        root = options.root or work / "root"
        make_debian(root)
        good &= try_them(folder.resolve(), root.resolve())
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
