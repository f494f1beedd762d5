#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How hard the pages are to read.

  prose.py ROOT            # all pages together, and the ten longest sentences; exit 1 above a limit
  prose.py ROOT FILE...    # each of these pages, and all their sentences that are too long

Counted are sentences of paragraphs, list items and table cells, and any text without a full stop that is too long for a
sentence; not code, headings or addresses of links. Limits: 18 words a sentence on average, 2 % of the sentences above 35
words, and none of the words below, which readers of English as a second language stumble over.
"""
import pathlib
import re
import subprocess
import sys

MEAN, LONG, LONG_SHARE = 18.0, 35, 0.02
STUMBLE = {
    r"\btold\b": "reported, printed, logged, returned",
    r"\bbeside\b": "next to, in addition to, under load",
    r"\bwhoever\b|\bwho does so\b": "the caller, the user, the reader",
    r"\bat the begin\b": "at startup",
    r"\bsays? no\b": "fails, refuses, rejects",
    r"\ba twin\b": "a copy, the second run",
    r"\bwhat lacks\b|\bwhat is lacking\b": "what is missing",
}
ABBREVIATIONS = re.compile(r"\b(e\.g|i\.e|cf|vs|eq|Eq|Fig|Sec|No|approx|resp|et al|Dr|p|pp|ch)\.$")


def blocks(text):
    """Paragraphs, list items and table cells of a page, each one line, with what is no prose taken out."""
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    text = re.sub(r"^( *)(```|~~~).*?^ *\2[^\n]*$", "", text, flags=re.S | re.M)
    block = []
    for line in [*text.split("\n"), ""]:
        bare = line.strip()
        cells = bare.startswith("|")
        fresh = not bare or cells or bare.startswith("#") or re.match(r"([-*+]|\d+[.)]) ", bare)
        if block and fresh:
            yield " ".join(block)
            block = []
        if cells:
            yield from (c.strip() for c in bare.strip("|").split("|"))
        elif bare and not bare.startswith("#") and (block or not line.startswith("    ")):
            block.append(re.sub(r"^([-*+]|\d+[.)]) ", "", bare))


def sentences(text):
    for block in blocks(text):
        block = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", block)
        block = re.sub(r"`[^`]*`", "CODE", block)
        block = re.sub(r"https?://\S+", "LINK", block)
        said = ""
        for part in re.split(r"(?<=[.!?])[\"')*_]*\s+(?=[\"'(*_]*[A-Z0-9])", block):
            said = f"{said} {part}".strip()
            if not ABBREVIATIONS.search(said):
                yield said
                said = ""
        if said:
            yield said


def words(sentence):
    return sum(1 for w in sentence.split() if re.search(r"\w", w))


def read(root, names):
    """(words, page, sentence) of all pages, and their stumbling words."""
    found, stumbles = [], []
    for name in names:
        for s in sentences((root / name).read_text()):
            n = words(s)
            if n > LONG or n and re.search(r"[.!?][)\"'*_]*$", s):
                found.append((n, name, s))
            stumbles += [(name, m.group(), better, s) for pattern, better in STUMBLE.items() for m in re.finditer(pattern, s)]
    return found, stumbles


def figures(found):
    n = len(found)
    return n, sum(f[0] for f in found) / max(n, 1), sum(f[0] > LONG for f in found) / max(n, 1)


def main():
    root, names = pathlib.Path(sys.argv[1]), sys.argv[2:]
    chosen = bool(names)
    names = names or subprocess.run(["git", "-C", root, "ls-files", "*.md"], capture_output=True, text=True, check=True).stdout.split()
    found, stumbles = read(root, names)
    if chosen:
        for name in names:
            count, mean, long = figures([f for f in found if f[1] == name])
            print(f"{name}: {count} sentences, {mean:.1f} words, {100 * long:.1f} % long")
    for n, name, s in sorted(found, reverse=True)[: None if chosen else 10]:
        if n > LONG or not chosen:
            print(f"  {n} words, {name}: {s[:160]}")
    for name, word, better, s in stumbles:
        print(f"  `{word}` ({better}), {name}: {s[:120]}")
    count, mean, long = figures(found)
    print(f"{len(names)} pages, {count} sentences: {mean:.1f} words on average (at most {MEAN:.0f}), {100 * long:.1f} % above {LONG} words "
          f"(at most {100 * LONG_SHARE:.0f} %), {len(stumbles)} words to stumble over")
    return mean > MEAN or long > LONG_SHARE or bool(stumbles)


sys.exit(main())
