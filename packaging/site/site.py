#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a site of all pages and of the public headers, to be read without a network.

site.py ROOT OUT    writes OUT/index.html; exit 1 if a link, an anchor or a page is wrong, 3 if a program is missing

`./takt docs` calls it. Sphinx writes the pages (conf.py), Doxygen those of the headers, as they are once installed.
"""
import pathlib
import shutil
import subprocess
import sys

PACKAGES = {"sphinx-build": "python3-sphinx python3-myst-parser", "doxygen": "doxygen"}
DOXYFILE = """PROJECT_NAME = "Takt: public headers"
INPUT = {headers}
RECURSIVE = YES
STRIP_FROM_PATH = {headers}
OUTPUT_DIRECTORY = {out}
HTML_OUTPUT = api
GENERATE_LATEX = NO
EXTRACT_ALL = YES
JAVADOC_AUTOBRIEF = YES
HIDE_UNDOC_RELATIONS = YES
SHOW_INCLUDE_FILES = NO
MACRO_EXPANSION = YES
HAVE_DOT = NO
QUIET = YES
WARNINGS = NO
"""


def main():
    root, out = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    if missing := [package for program, package in PACKAGES.items() if not shutil.which(program)]:
        print(f"site: missing; run:  sudo apt-get install --no-install-recommends {' '.join(missing)}", file=sys.stderr)
        return 3
    here, headers, extra = root / "packaging/site", out / "headers", out / "extra"
    for old in (headers, extra):
        shutil.rmtree(old, ignore_errors=True)
    extra.mkdir(parents=True)
    subprocess.run(["cmake", f"-DTAKT_ROOT={root}", f"-DTAKT_INCLUDE={headers}", "-P", root / "cmake/public_headers.cmake"], check=True)
    subprocess.run(["doxygen", "-"], input=DOXYFILE.format(headers=headers, out=extra), text=True, check=True)
    sphinx = ["sphinx-build", "-q", "-W", "--keep-going", "-c", here, "-D", f"html_extra_path={extra}", "-d", out / "state", root, out / "html"]
    if subprocess.run(sphinx).returncode != 0:
        return 1
    shutil.copy(out / "html/README.html", out / "html/index.html")
    print(f"site: {out / 'html/index.html'}")
    return 0


sys.exit(main())
