#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""added_files.py SOURCE [--build]: adds the node, the message and the driver of docs/guides.md to a copy of the tree.

Prints the files that each addition made or changed. Fails if one lies outside the new folder, or if the stock programs
do not register it. `--build` also compiles `takt` of the copy and looks for all of them in `takt nodes`; the message is
the type of a port there.
"""
import argparse
import hashlib
import pathlib
import subprocess
import sys
import tempfile

ADDITIONS = {  # folder: (its CMakeLists.txt, the call in ace_registry(), what to ask `takt nodes` and a word of its answer)
    "nodes/brightness": (
        "takt_room(brightness SOURCES brightness_node.cpp USES takt_rt REGISTERS brightness)",
        "register_brightness(registry.nodes)",
        "brightness",
        "factor on every channel",
    ),
    "nodes/sharpness": (  # a message, and the node that publishes it
        "takt_room(sharpness SOURCES sharpness_node.cpp USES takt_rt REGISTERS sharpness)",
        "register_sharpness(registry.nodes)",
        "sharpness",
        "out sharpness sharpness of the left image",
    ),
    "hal/laser/tube": (
        "takt_room(tube SOURCES register.cpp USES takt_laser REGISTERS tube)",
        "register_tube(registry.devices)",
        "laser_scanner",
        "a scanner in a tube",
    ),
}


def contents(root):
    """File to hash, without what a build makes."""
    files = [f for f in root.rglob("*") if f.is_file() and f.relative_to(root).parts[0] != "build"]
    return {str(f.relative_to(root)): hashlib.sha256(f.read_bytes()).digest() for f in files}


def run(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stdout[-4000:]}")
    return done.stdout


def copy(source, to):
    listed = run("git", "-C", source, "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    for name in filter(None, listed.split("\0")):
        if (source / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            (to / name).write_bytes((source / name).read_bytes())
            (to / name).chmod((source / name).stat().st_mode)


def add(folder, root, blocks):
    (root / folder).mkdir(parents=True)
    for file in (blocks / folder).iterdir():
        (root / folder / file.name).write_bytes(file.read_bytes())
    (root / folder / "CMakeLists.txt").write_text(f"# SPDX-License-Identifier: Apache-2.0\n{ADDITIONS[folder][0]}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("--build", action="store_true", help="compiles takt of the copy, too")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        root, blocks = pathlib.Path(scratch) / "takt", pathlib.Path(scratch) / "blocks"
        copy(options.source.resolve(), root)
        run(sys.executable, root / "tests/tools/code_blocks.py", blocks, root / "docs/guides.md")
        for folder in ADDITIONS:
            before = contents(root)
            add(folder, root, blocks)
            after = contents(root)
            changed = sorted(f for f in before.keys() | after.keys() if before.get(f) != after.get(f))
            print(f"{folder}:", *changed, sep="\n  ")
            outside = [f for f in changed if not f.startswith(folder + "/")]
            if outside or not changed:
                sys.exit(f"{folder}: files outside the folder: {outside}")
        build = root / "build"
        run("cmake", "-S", root, "-B", build, "-G", "Ninja")
        registry = (build / "graph/ace/ace_registry.cpp").read_text()
        for folder, (_, call, _, _) in ADDITIONS.items():
            if call not in registry:
                sys.exit(f"{folder}: ace_registry() has no {call}")
        if options.build:
            run("cmake", "--build", build, "--target", "takt")
            takt = build / "graph/command/takt"
            for folder, (_, _, asked, word) in ADDITIONS.items():
                if word not in " ".join(run(takt, "nodes", asked).split()):  # columns are as wide as they need to be
                    sys.exit(f"{folder}: `takt nodes {asked}` does not show it")


main()
