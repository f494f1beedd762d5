# SPDX-License-Identifier: Apache-2.0
"""Sphinx reads the pages where they are in the tree. site.py calls it; by hand: sphinx-build -c packaging/site . OUT."""
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = subprocess.run(["git", "ls-files", "*.md", ":!.github"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
ROOMS = [  # caption in the contents, pages
    ("Documents", [p for p in PAGES if p.startswith("docs/") and p != "docs/README.md"]),
    ("Nodes", [p for p in PAGES if p.startswith("nodes/")]),
    ("Devices", [p for p in PAGES if p.startswith("hal/")]),
    ("Graph and runtime", [p for p in PAGES if p.startswith(("graph/", "rt/"))]),
    ("Examples", [p for p in PAGES if p.startswith("examples/")]),
]

project, author = "Takt", "the Takt authors"
extensions = ["myst_parser"]
root_doc = "README"
include_patterns = PAGES
myst_heading_anchors = 4
html_theme = "alabaster"
html_theme_options = {"description": "a real-time dataflow runtime for robots", "page_width": "1100px", "fixed_sidebar": True}
html_show_copyright = html_show_sourcelink = html_copy_source = False


def contents():
    """The pages in the order of the index, then the others, below the captions of ROOMS."""
    index = (ROOT / "docs/README.md").read_text()
    rest = [p for p in PAGES if p not in ("README.md", *(p for _, pages in ROOMS for p in pages))]
    for caption, pages in [*ROOMS, ("More", rest)]:
        place = {p: index.find(f"({p.removeprefix('docs/')})") for p in pages}
        names = "\n".join(p.removesuffix(".md") for p in sorted(pages, key=lambda p: (place[p] < 0, place[p], p)))
        yield f"```{{toctree}}\n:hidden:\n:titlesonly:\n:caption: {caption}\n\n{names}\n```\n"


def read(app, name, source):
    """A link to a folder leads to its page, or to the nearest one above; the first page carries the contents."""

    def page(link):
        target = (ROOT / name).parent / link.group(1)
        if not target.is_dir():
            return link.group(0)
        above = next(f for f in (target, *target.parents) if (f / "README.md").exists())
        return f"]({link.group(1)}/{'../' * (len(target.relative_to(above).parts))}README.md)"

    text = re.sub(r"\]\(([^)#: ]+)\)", page, source[0])
    if name == root_doc:
        text += "\n" + "\n".join(contents())
        if app.config.html_extra_path:
            text += '\n<p><a href="api/index.html">Public headers</a></p>\n'
    source[0] = text


def setup(app):
    app.connect("source-read", read)
