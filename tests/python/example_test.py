# SPDX-License-Identifier: Apache-2.0
"""The example prints what its README shows."""
import pathlib
import re
import subprocess
import sys
import unittest

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "records_in_python"


class ExampleTest(unittest.TestCase):
    def test_the_table(self):
        expected = re.search(r"^```text\n(.*?)^```$", (EXAMPLE / "README.md").read_text(), re.M | re.S)[1]
        done = subprocess.run([sys.executable, "table.py", "run.mcap"], cwd=EXAMPLE, capture_output=True, text=True,
                              check=True)
        self.assertEqual(done.stdout, expected)


if __name__ == "__main__":
    unittest.main()
