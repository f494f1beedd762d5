# SPDX-License-Identifier: Apache-2.0
"""The Debian packages of Takt that an image installs."""
import os
import pathlib
import subprocess

from . import tools

NEEDED = ("takt", "takt-ace")


def of_folder(folder, names):
    """One .deb for each name."""
    debs, missing = [], []
    for name in names:
        found = sorted(folder.glob(f"{name}_*.deb"))
        if len(found) == 1:
            debs.append(found[0])
        else:
            missing.append(f"{name} ({len(found)} files)")
    if missing:
        raise tools.Failure(f"{folder} should have one package each of {', '.join(names)}; not so: {', '.join(missing)}", tools.BAD_INPUT)
    return debs


def commit(checkout):
    return subprocess.run(["git", "-C", checkout, "rev-parse", "HEAD"], capture_output=True, text=True, check=False).stdout.strip()


def built(checkout):
    """Those of the commit that is checked out, built if they are not there yet."""
    folder = checkout / "build/packages"
    stamp = folder / "commit"
    head = commit(checkout)
    if not head:
        raise tools.Failure(f"{checkout} is no git checkout; build packages on another machine and name their folder with --packages", tools.BAD_INPUT)
    if not stamp.exists() or stamp.read_text() != head:
        with tools.step("packages of this commit"):
            tools.run(checkout / "packaging/debian/build", folder)
            stamp.write_text(head)
    return folder


def find(folder, home, more):
    """The .deb files of that folder, or of the checkout at `home`."""
    checkout = (home / "packaging/debian/build").exists()
    if folder is None:
        if not checkout:
            raise tools.Failure("name the folder that has the .deb files of Takt: --packages FOLDER", tools.BAD_INPUT)
        folder = built(home)
    return of_folder(pathlib.Path(folder), (*NEEDED, *more))


def version(deb):
    return tools.run("dpkg-deb", "--field", deb, "Version").strip()


def epoch(home):
    """The time that all files of an image get: that of the commit, so that two builds of it are the same."""
    if "SOURCE_DATE_EPOCH" in os.environ:
        return os.environ["SOURCE_DATE_EPOCH"]
    done = subprocess.run(["git", "-C", home, "log", "-1", "--format=%ct"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "0"
