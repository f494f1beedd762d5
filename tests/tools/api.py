#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The public declarations, compared with what the tree says of them.

    api.py ROOT [--write]

tests/api/stable.txt is the text of all stable headers: declarations without comments, function bodies and private
parts. rt/abi_declarations.hpp is a hash of all public headers, private parts included: these decide the layout of
objects that a plug-in shares with its host. Exit 1 if one of both differs; --write renews them.
"""
import difflib
import hashlib
import pathlib
import re
import sys

MARK = re.compile(r"^// Installed as <(takt/[a-z0-9_/]+\.hpp)>: ([a-z]+), (stable|experimental)\.", re.MULTILINE)
TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|[{};]|\s+|[A-Za-z_0-9]+|.', re.DOTALL)
SCOPE = re.compile(r"^(template <.*> ?)?(typedef )?(inline )?(class|struct|union|enum|namespace|extern \"C\")\b")


def tokens_of(text):
    text = re.sub(r"^#include .*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"\\\n", " ", text)
    for token in TOKEN.findall(text):
        if not token.startswith(("//", "/*")):
            yield " " if token.isspace() and "\n" not in token else "\n" if token.isspace() else token


def statements(text):
    """The declarations as a tree: each a text, and for a scope its content."""
    tokens = list(tokens_of(text))
    at = 0

    def skip_braces():
        nonlocal at
        depth, kept = 0, []
        while at < len(tokens):
            depth += (tokens[at] == "{") - (tokens[at] == "}")
            kept.append(tokens[at])
            at += 1
            if depth == 0:
                break
        return "".join(kept)

    def read():
        nonlocal at
        found, now = [], ""
        while at < len(tokens):
            token = tokens[at]
            if token == "}":
                at += 1
                break
            if token == "#" and not now.strip():  # a directive: its line
                line = ""
                while at < len(tokens) and tokens[at] != "\n":
                    line += tokens[at]
                    at += 1
                found.append((squeezed(line), None))
                now = ""
                continue
            if token == "{":
                head = squeezed(now)
                if SCOPE.match(head) and not (head.endswith(")") and "enum" not in head):
                    at += 1
                    inside = read()
                    found.append((head, inside))
                    now = ""
                elif ")" in head and head.count("(") == head.count(")") and "=" not in head.split("(")[0]:
                    skip_braces()
                    now = head.split(") :")[0] + (")" if ") :" in head else "") + " "
                    following = "".join(tokens[at : at + 2]).strip()
                    if not following.startswith((",", "{")):  # else a member's initialiser, not the body
                        found.append((squeezed(now), None))
                        now = ""
                else:
                    now += skip_braces()
                continue
            at += 1
            if token == ";":
                if squeezed(now):
                    found.append((squeezed(now), None))
                now = ""
            elif token == ":" and squeezed(now) in ("public", "private", "protected"):
                found.append((squeezed(now) + ":", None))
                now = ""
            else:
                now += token
        if squeezed(now):
            found.append((squeezed(now), None))
        return found

    return read()


def squeezed(text):
    return re.sub(r"\s+", " ", text).strip()


def lines(tree, private, depth=0):
    hidden = False
    for head, inside in tree:
        if head in ("public:", "protected:", "private:"):
            hidden = head == "private:" and not private
            if not hidden:
                yield "  " * depth + head
        elif hidden:
            continue
        elif inside is None:
            yield "  " * depth + head
        else:
            # A class begins with its private part.
            within = ([("private:", None)] if re.search(r"\bclass\b", head) and "enum" not in head else []) + inside
            yield "  " * depth + head + " {"
            yield from lines(within, private, depth + 1)
            yield "  " * depth + "}"


def public_headers(root):
    """(installed name, package, word, text), by name"""
    found = []
    for floor in ("rt", "hal", "graph", "nodes"):
        for header in (root / floor).rglob("*.hpp"):
            text = header.read_text()
            if mark := MARK.search(text):
                if header.name != "abi_declarations.hpp":
                    found.append((*mark.groups(), text))
    return sorted(found)


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--write"]):
        sys.exit(__doc__)
    root = pathlib.Path(sys.argv[1])
    headers = public_headers(root)
    if not headers:
        sys.exit(f"api: no public header below {root}")
    stable, layout = "", hashlib.sha256()
    for name, package, word, text in headers:
        tree = statements(text)
        layout.update("\n".join([name, *lines(tree, True)]).encode())
        if word == "stable":
            stable += f"<{name}> ({package})\n" + "".join(f"  {line}\n" for line in lines(tree, False)) + "\n"
    declarations = (
        "// SPDX-License-Identifier: Apache-2.0\n// Installed as <takt/abi_declarations.hpp>: core, stable.\n"
        "// Written by `tests/tools/api.py . --write`: a hash of all public headers.\n#pragma once\n"
        f'#define TAKT_ABI_DECLARATIONS "{layout.hexdigest()[:12]}"\n'
    )
    differs = False
    for path, wanted in (("tests/api/stable.txt", stable), ("rt/abi_declarations.hpp", declarations)):
        file = root / path
        had = file.read_text() if file.exists() else ""
        if had == wanted:
            continue
        if sys.argv[2:]:
            file.parent.mkdir(exist_ok=True)
            file.write_text(wanted)
            continue
        differs = True
        changes = list(difflib.unified_diff(had.splitlines(), wanted.splitlines(), path, "the headers", "", "", 2))
        print("\n".join(changes[:60]))
    if differs:
        sys.exit(
            "api: public declarations have changed. If that is meant, say so in CHANGELOG.md and renew both files:\n"
            "  python3 tests/tools/api.py . --write"
        )


if __name__ == "__main__":
    main()
