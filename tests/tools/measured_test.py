#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""docs/measured.md is made from its files alone, and what is wrong in one is named."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TOOLS = pathlib.Path(__file__).resolve().parent
ROOT = TOOLS.parents[1]
PAGE, FILES = "docs/measured.md", "tests/quality/measured"


class Measured(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.root = pathlib.Path(holder.name)
        (self.root / "docs").mkdir()
        shutil.copy(ROOT / PAGE, self.root / PAGE)
        shutil.copytree(ROOT / FILES, self.root / FILES)

    def run_script(self, *options):
        done = subprocess.run([sys.executable, TOOLS / "measured.py", self.root, *options], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def change(self, **cells):
        path = self.root / FILES / "10_running.json"
        section = json.loads(path.read_text())
        section["rows"][0].update(cells)
        path.write_text(json.dumps(section))

    def test_twice_the_same(self):
        stored = (self.root / PAGE).read_bytes()
        self.assertEqual(self.run_script("--check"), (0, "measured: as the files say\n"))
        for _ in range(2):
            self.assertEqual(self.run_script()[0], 0)
            self.assertEqual((self.root / PAGE).read_bytes(), stored)

    def test_one_wrong_figure(self):
        self.change(printed="31 of 26 policies read back")
        code, said = self.run_script("--check")
        self.assertEqual(code, 1)
        self.assertIn("+| the main job of a fresh clone | `./takt run` | 31 of 26", said)
        self.run_script()
        self.assertEqual(self.run_script("--check")[0], 0)

    def test_ratios(self):
        row = {"name": "rectify/colour", "ratio": 0.62, "reference": "OpenCV", "sense": "<=", "target": 1, "null": None, "verdict": "met"}
        section = {"title": "Ratios", "machine": "2 CPUs", "date": "2026-11-29", "commit": "0", "suites": [{"command": "rectify", "rows": [row]}]}
        (self.root / FILES / "98_ratios.json").write_text(json.dumps(section))
        self.assertEqual(self.run_script()[0], 0)
        self.assertIn("| `takt bench rectify` | rectify/colour | 0.62 | OpenCV | &lt;= 1 | - | met |", (self.root / PAGE).read_text())

    def test_wrong_rows(self):
        for cells, words in (({"met": "maybe"}, "met `maybe`; write yes |"), ({"data": "real"}, "data `real`; write none |"),
                             ({"met": "no"}, "met `no`: write into note"), ({"remark": "-"}, "keys remark: a row needs")):
            with self.subTest(cells=cells):
                self.setUp()
                self.change(**cells)
                code, said = self.run_script("--check")
                self.assertEqual(code, 1)
                self.assertIn("10_running.json: row 1: " + words, said)


if __name__ == "__main__":
    unittest.main()
