# SPDX-License-Identifier: Apache-2.0
"""Whether the documents say what is there.

documents.py messages SOURCE          docs/faq.md is indexed by messages that the code can say
documents.py links SOURCE             what documents link to exists, and so does what the scripts of bench/scenarios use; bench/README.md
                                      names each of them
documents.py errata SOURCE            codes such as E-19 in documents and sources stand in docs/thesis_errata.md
documents.py figures SOURCE           our figures in docs/thesis.md stand in the READMEs that their row links to
documents.py commands SOURCE TAKT...  commands and options in documents are known to the programs TAKT (takt, takt-bench),
                                      files named in them exist, and a test runs every command of takt

A mistake is told with file and line; then the exit is 1. Each check first looks whether it sees a mistake that is made for it.
"""
import os
import pathlib
import re
import subprocess
import sys

kind, source = sys.argv[1], pathlib.Path(sys.argv[2])
documents = sorted(path for path in source.rglob("*.md") if not {"build", "out", "node_modules"} & set(path.relative_to(source).parts))
mistakes = []


def tell(path, line, what):
    mistakes.append(f"{path.relative_to(source)}:{line}: {what}")


# Messages.

# Headings of docs/faq.md that quote other programs.
OTHERS = (
    "systemd: takt@ace.service: Watchdog timeout",
    'A process hangs for up to 60 s at its start, then ends: "Timeout registering at RouDi"',
)
# What stands in capitals, identifiers, paths and numbers are the reader's own, and so is `...`; these words are not.
SAID_IN_CAPITALS = "NOT|OK|RUN|MET|ABOVE|LOST|SIMD|CPUs?|EDF|HOME"
OWN = re.compile(rf"\.\.\.|/[\w/.-]+|\b(?!(?:{SAID_IN_CAPITALS})\b)[A-Z][A-Z0-9]*(?:\.[A-Z]+)*\b|\w+_\w+|\bp?\d+(?:th)?\b")
SYSTEM = {os.strerror(number) for number in range(1, 134)}


def said(text):
    """What the string literals of a source file say, one a line; literals beside one another are one."""
    plain, end = [], None
    for match in re.finditer(r'"((?:[^"\\\n]|\\.)*)"', text):
        if end is not None and not text[end : match.start()].strip():
            plain[-1] += match.group(1)
        else:
            plain.append(match.group(1))
        end = match.end()
    return re.sub(r"[`\\]", "", "\n".join(plain))


def fixed_parts(heading):
    """What must stand in the code for that message: of two words or more where there are any."""
    parts = [part.strip() for own in OWN.split(heading.replace("`", "")) for part in re.split(r"[()\[\]:;,=\"]", own)]
    parts = [part for part in parts if part and part not in SYSTEM]
    return [part for part in parts if " " in part] or parts


def stands(part, code):
    """In one piece, or in two: a word of the code's own may be put in by a place holder."""
    words = part.split()
    return any(" ".join(words[:cut]) in code and " ".join(words[cut:]) in code for cut in range(len(words)))


def check_messages():
    folders = ("rt", "hal", "nodes", "graph", "tests")
    code = "\n".join(said(path.read_text()) for folder in folders for path in (source / folder).rglob("*.[ch]pp"))
    if all(stands(part, code) for part in fixed_parts("the group N of this process has been painted green")):
        mistakes.append("the check does not see a message that nobody says")
    faq = source / "docs" / "faq.md"
    for number, line in enumerate(faq.read_text().splitlines(), 1):
        if line.startswith("### ") and line[4:] not in OTHERS:
            for part in fixed_parts(line[4:]):
                if not stands(part, code):
                    tell(faq, number, f"nothing says `{part}`")


# Links.


LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
USED = re.compile(r"(?:\$root|\{root\}|\{source\})/([\w./-]+\w)")  # of the project, by a script


def check_links():
    if LINK.findall("[a](b/c.md#d) [e](https://f)") != ["b/c.md"]:
        mistakes.append("the check does not see links")
    if USED.findall('"$root/takt" f"{root}/graph/ace.yaml" $root;') != ["takt", "graph/ace.yaml"]:
        mistakes.append("the check does not see what scripts use")
    for path in documents:
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for target in LINK.findall(line):
                if not (path.parent / target).exists():
                    tell(path, number, f"links to {target}, which does not exist")
    readme = (source / "bench" / "README.md").read_text()
    for path in sorted((source / "bench" / "scenarios").glob("*.sh")):
        if f"`{path.name}" not in readme:
            mistakes.append(f"bench/README.md does not name {path.name}")
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for used in USED.findall(line):
                if not (source / used).exists() and not used.startswith("build/"):
                    tell(path, number, f"uses {used}, which does not exist")


# Figures.

NUMBER = re.compile(r"\d+(?:[.,]\d+)*")


def figures_nowhere(row, folder):
    """Numbers in the fourth of five columns that no linked document has."""
    cells = row.split(" | ")
    known = set().union(*(NUMBER.findall((folder / target).read_text()) for target in LINK.findall(cells[1])))
    return [number for number in NUMBER.findall(cells[3]) if number not in known]


def check_figures():
    thesis = source / "docs" / "thesis.md"
    if figures_nowhere("| a | [b](../README.md) | c | 15 Hz, 31.41592653 ms | e |", thesis.parent) != ["31.41592653"]:
        mistakes.append("the check does not see a figure that stands nowhere")
    for number, line in enumerate(thesis.read_text().splitlines(), 1):
        if line.count(" | ") == 4 and "](" in line:
            for figure in figures_nowhere(line, thesis.parent):
                tell(thesis, number, f"{figure} stands in none of the documents linked")


# Codes of docs/thesis_errata.md.

CODE = re.compile(r"(?<![\w-])(?:[EA]-\d\d|[CRD]-\d+(?:\.\d+)?)(?![\w-])")


def check_errata():
    if CODE.findall("(E-19, R-7.5 and D-1), A-13; CODE-13, E-1900") != ["E-19", "R-7.5", "D-1", "A-13"]:
        mistakes.append("the check does not see codes")
    page = source / "docs" / "thesis_errata.md"
    known = {line.split(" | ")[0].removeprefix("| ") for line in page.read_text().splitlines()}
    sources = [path for folder in ("rt", "hal", "nodes", "graph", "tests", "bench") for path in (source / folder).rglob("*.[ch]pp")]
    for path in documents + sources:
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for code in set(CODE.findall(line)) - known:
                tell(path, number, f"{code} does not stand in docs/thesis_errata.md")


# Commands.

FILE = re.compile(r"(?:graph|tests|schedules|bench|nodes|hal|docs)/[\w./-]+\.\w+")
NO_COMMANDS = ("takt end", "takt gap", "takt served")  # metadata of a record
PLACEHOLDER = re.compile(r"[A-Z_]+(?:[.:].*)?$")


class Program:
    """A program's commands and options, as its --help tells them."""

    def __init__(self, words):
        text = subprocess.run(words + ["--help"], capture_output=True, text=True, check=True).stdout
        options, _, commands = text.partition("\nSubcommands:\n")
        self.options = set(re.findall(r"^ +(?:-\w,)?(--[\w-]+)", options, flags=re.M))
        self.suites = set(re.findall(r"^ {30,}(\w+): ", options, flags=re.M))
        names = re.findall(r"^  (\w+)(?:, \w+)*  ", commands, flags=re.M)
        self.commands = {name: Program(words + [name]) for name in names}

    def leaves(self, path=()):
        return [leaf for name, command in self.commands.items() for leaf in command.leaves((*path, name))] or [path]

    def all_options(self):
        return self.options.union(*(command.all_options() for command in self.commands.values()))


def wrong_in(command, takt, bench):
    """What is wrong in a command as a document shows it, such as `./takt log info|diff FILE [--json]`."""
    words = re.sub(r"[\[\]]|\.\.\.", " ", command.replace("\\|", "|")).split()[1:]
    if words[0] in ("test", "docs"):  # of the launcher
        return []
    programs = [takt]
    if words[0] == "bench":
        suites = words[1].split("|") if words[1:] else []
        return [f"bench has no suite {name}" for name in suites if name not in bench.suites and not PLACEHOLDER.match(name)]
    while words and any(program.commands for program in programs):
        names, words = words[0].split("|"), words[1:]
        if PLACEHOLDER.match(names[0]):
            continue
        unknown = [name for name in names if not any(name in program.commands for program in programs)]
        if unknown:
            return [f"there is no command {name}" for name in unknown]
        programs = [program.commands[name] for program in programs for name in names if name in program.commands]
    wrong = []
    for word in words:
        if word in ("&&", ">", "<"):
            break
        option = re.match(r"--[\w-]+", word)
        if option and not any(option.group(0) in program.options for program in programs):
            wrong.append(f"there is no option {option.group(0)}")
        if FILE.fullmatch(word) and not (source / word).exists():
            wrong.append(f"there is no file {word}")
    return wrong


def shown_commands(text):
    """Commands with their lines: code spans, and lines of code blocks up to a remark in another column."""
    for number, line in enumerate(text.splitlines(), 1):
        block = re.match(r" {4}((?:\./)?takt [a-z].*)", line)
        spans = [re.split(r" {3,}| #", block.group(1))[0]] if block else re.findall(r"`((?:\./)?takt [a-z][^`]*)`", line)
        yield from ((number, span) for span in spans if span not in NO_COMMANDS)


def check_commands():
    takt, bench = Program([sys.argv[3]]), Program([sys.argv[4]])
    for made in ("takt fly", "takt run --upwards", "takt run graph/none.yaml", "takt log info|fly FILE", "takt bench flight"):
        if not wrong_in(made, takt, bench):
            mistakes.append(f"the check does not see what is wrong in `{made}`")
    options = takt.all_options() | bench.options
    for path in documents:
        if path.name == "CHANGELOG.md":  # tells of commands as they were
            continue
        for number, command in shown_commands(path.read_text()):
            for what in wrong_in(command, takt, bench):
                tell(path, number, f"`{command}`: {what}")
    reference = source / "docs" / "commands.md"
    for number, line in enumerate(reference.read_text().splitlines(), 1):
        for option in re.findall(r"`(--[a-z][\w-]*)", line):
            if option not in options:
                tell(reference, number, f"there is no option {option}")
    scripts = "\n".join(path.read_text() for path in (source / "tests" / "integration").glob("*.sh"))
    for leaf in takt.leaves():
        if not re.search(r'\$takt"? ' + " ".join(leaf) + r"\b", scripts):
            mistakes.append(f"no script in tests/integration runs `takt {' '.join(leaf)}`")


{"messages": check_messages, "links": check_links, "figures": check_figures, "errata": check_errata, "commands": check_commands}[kind]()
print("\n".join(mistakes) or f"{kind}: nothing wrong")
sys.exit(1 if mistakes else 0)
