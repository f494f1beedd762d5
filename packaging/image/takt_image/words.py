# SPDX-License-Identifier: Apache-2.0
"""A command line that says its help as all other commands of Takt do."""
import argparse
import os
import pathlib
import stat
import sys
import textwrap

COLUMN, WIDTH = 30, 118


def refuse(path, why):
    raise argparse.ArgumentTypeError(f"{path} {why}")


def kind(path):
    """What is there; an error that names it where nothing is."""
    try:
        return os.stat(path).st_mode
    except OSError as error:
        refuse(path, f"cannot be read: {error.strerror}")


def input_file(text, most_bytes=16 << 30, begins=b"", what=""):
    """A path to read a file from: refused with the reason where it cannot be one, is larger, or does not begin as `what` does."""
    mode = kind(text)
    if stat.S_ISDIR(mode):
        refuse(text, "is a folder, a file is expected")
    if not stat.S_ISREG(mode):
        refuse(text, "is no file")
    if not os.access(text, os.R_OK):
        refuse(text, "cannot be read: Permission denied")
    size = os.stat(text).st_size
    if size == 0:
        refuse(text, "is empty")
    if size > most_bytes:
        refuse(text, f"has {size} bytes, more than the {most_bytes} that are read")
    with open(text, "rb") as file:
        if not file.read(len(begins)).startswith(begins):
            refuse(text, f"is no {what}")
    return pathlib.Path(text)


def text_file(text):
    return input_file(text, 16 << 20)


def package(text):
    return input_file(text, begins=b"!<arch>\ndebian-binary", what="Debian package")


def bundle(text):
    return input_file(text, begins=b"hsqs", what="update of `takt image build`")


def disk(text):
    """A disk with a partition table, as it lies in takt.img."""
    path = input_file(text)
    with open(path, "rb") as file:
        if file.read(520)[512:] != b"EFI PART":
            refuse(text, "is no disk of `takt image build`; one that is packed is unpacked first: zstd -d")
    return path


def input_folder(text):
    if not stat.S_ISDIR(kind(text)):
        refuse(text, "is no folder, a folder is expected")
    try:
        if not os.listdir(text):
            refuse(text, "is an empty folder")
    except OSError as error:
        refuse(text, f"cannot be read: {error.strerror}")
    return pathlib.Path(text)


def output_folder(text):
    """A folder that is there or can be made."""
    there = pathlib.Path(text).absolute()
    while not there.exists() and there != there.parent:
        there = there.parent
    if not there.is_dir():
        refuse(text, "is no folder, a folder is expected" if there == pathlib.Path(text).absolute() else f"cannot be made: {there} is no folder")
    if not os.access(there, os.W_OK | os.X_OK):
        refuse(text, "cannot be written: Permission denied")
    return pathlib.Path(text)


def row(name, meaning):
    lines = textwrap.wrap(meaning, WIDTH - COLUMN) or [""]
    first = f"  {name}".ljust(COLUMN) + lines[0] if len(name) + 3 <= COLUMN else f"  {name}\n{' ' * COLUMN}{lines[0]}"
    return "\n".join([first, *[" " * COLUMN + line for line in lines[1:]]])


class Parser(argparse.ArgumentParser):
    def format_help(self):
        commands = [action for action in self._actions if isinstance(action, argparse._SubParsersAction)]
        positionals = [action for action in self._actions if not action.option_strings and action not in commands]
        options = [action for action in self._actions if action.option_strings]
        usage = " ".join([self.prog, "[OPTIONS]", *[action.dest for action in positionals], *(["SUBCOMMAND"] if commands else [])])
        parts = [f"{self.description}\nUsage: {usage}"]
        if positionals:
            parts.append("Positionals:\n" + "\n".join(row(f"{action.dest} {action.metavar or 'TEXT'} REQUIRED", action.help) for action in positionals))
        parts.append("Options:\n" + "\n".join(self.option(action) for action in options))
        for action in commands:
            parts.append("Subcommands:\n" + "\n".join(row(choice.dest, choice.help) for choice in action._choices_actions))
        return "\n\n".join([*parts, *([self.epilog] if self.epilog else [])]) + "\n"

    @staticmethod
    def option(action):
        if action.dest == "help":
            return row("-h,--help", "Print this help message and exit")
        value = "" if action.nargs == 0 else " " + (action.metavar or ("{" + ",".join(action.choices) + "}" if action.choices else "TEXT"))
        repeated = " ..." if isinstance(action, argparse._AppendAction) else ""
        return row(",".join(action.option_strings) + value + repeated + (" REQUIRED" if action.required else ""), action.help)

    def error(self, message):
        print(f"{self.prog}: {message}\nRun with --help for more information.", file=sys.stderr)
        sys.exit(2)
