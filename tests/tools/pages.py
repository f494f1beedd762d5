# SPDX-License-Identifier: Apache-2.0
"""Pages of which a program writes a part: what stands above the line MADE is written by hand, and stays."""
import difflib

MADE = "<!-- Below this line: written by tests/tools/{}. -->\n"


def cell(text):
    text = str(text).replace("|", "\\|")
    return text if "`" in text else text.replace("<", "&lt;")


def code(word):
    return f"`{word}`" if word else ""


def table(head, rows):
    """Lines of a table, without the columns that no row fills."""
    filled = [c for c in range(len(head)) if any(row[c] for row in rows)]
    for row in [head, ["---"] * len(head), *rows]:
        yield "| " + " | ".join(cell(row[c]) for c in filled) + " |"


def bring(path, script, lines, check):
    """Writes the page, or only compares: what is wrong with it then, else nothing."""
    stored, line = path.read_text(), MADE.format(script)
    head, found, _ = stored.partition(line)
    if not found:
        return f"{path}: this line is missing: {line}"
    made = head + line + "\n".join(lines) + "\n"
    if not check:
        path.write_text(made)
    elif made != stored:
        difference = list(difflib.unified_diff(stored.splitlines(), made.splitlines(), str(path), "made now", n=0, lineterm=""))
        return "\n".join([*difference[:20], f"{path} is not what tests/tools/{script} writes; fix: run it without --check"])
    return ""
