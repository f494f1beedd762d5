# SPDX-License-Identifier: Apache-2.0
"""takt.Run against a program that behaves as `takt run` does: it listens, answers, and reports when it is stopped."""
import os
import pathlib
import tempfile
import unittest
from unittest import mock

import takt

PROGRAM = r'''#!/usr/bin/env python3
import json, os, pathlib, socket, sys
report = pathlib.Path(sys.argv[sys.argv.index("--report") + 1])
listener = socket.socket(socket.AF_UNIX)
listener.bind(os.environ["XDG_RUNTIME_DIR"] + f"/takt/{os.getpid()}.sock")
listener.listen()
print("a word", file=sys.stderr)
tops = 0
while True:
    client, _ = listener.accept()
    with client, client.makefile("rwb") as file:
        line = file.readline()
        what = json.loads(line)["do"] if line else ""
        tops += what == "top"
        answers = [{"ok": True, "running_s": tops - 1, "nodes": [{"name": "front_laser", "device": {"state": "silent"}}]}]
        if what == "fault":
            answers = [{"devices": [{"device": "front_laser", "on": "none", "faults": ["silent"]}]}]
        if what == "echo":
            answers = [{"type": "stop_command", "sequence": n, "level": 0, "stamp_ns": n, "message": {"reasons": n}}
                       for n in (1, 2, 3)]
        for answer in answers if what else []:
            file.write(json.dumps(answer).encode() + b"\n")
        try:
            file.flush()
        except BrokenPipeError:
            pass
        if what in ("stop", "mode"):  # a mode that is reached ends this run by itself
            report.write_text(json.dumps({"ok": True, "words": sys.argv[1:]}))
            sys.exit(0)
'''


class RunTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "takt").mkdir(mode=0o700)
        self.program = self.folder / "program"
        self.program.write_text(PROGRAM)
        self.program.chmod(0o755)
        patch = mock.patch.dict(os.environ, XDG_RUNTIME_DIR=folder.name, TAKT=str(self.program))
        patch.start()
        self.addCleanup(patch.stop)

    def test_from_start_to_report(self):
        with takt.Run("graph.yaml", profile="doubles", arguments=["--isolate", "none"]) as run:
            self.assertGreater(run.top()["running_s"], 0)
            run.set("cruise.speed", "0.3m/s")
            message = run.wait_for("obstacle_stop.stop", lambda m: m["reasons"] == 2, within_s=5)
            self.assertEqual(message.sequence, 2)
            self.assertIsNone(run.report)
        self.assertEqual(run.exit_code, 0)
        self.assertEqual(run.stderr, "a word\n")
        self.assertTrue(run.report["ok"])
        words = run.report["words"]
        self.assertEqual(words[:2], ["run", "graph.yaml"])
        self.assertEqual(words[words.index("--profile") + 1], "doubles")
        self.assertEqual(words[-2:], ["--isolate", "none"])
        with self.assertRaisesRegex(takt.Error, "not going on"):
            run.set("cruise.speed", "0.3m/s")

    def test_reports_of_every_format_so_far_are_read_and_no_later_one(self):
        sample = pathlib.Path(__file__).resolve().parents[1] / "samples" / "report.json"
        self.assertEqual(takt.read_report(sample)["graph"], "guard")
        later = self.folder / "later.json"
        later.write_text('{"format": 2}')
        with self.assertRaisesRegex(takt.Error, "format 2.*up to 1"):
            takt.read_report(later)

    def test_what_does_not_come_true_is_told_with_the_last_message(self):
        with takt.Run("graph.yaml") as run:
            with self.assertRaisesRegex(AssertionError, r"obstacle_stop.stop .* 3 seen, the last: {'reasons': 3}"):
                run.wait_for("obstacle_stop.stop", lambda m: m["reasons"] == 9, within_s=5)
        self.assertEqual(run.exit_code, 0)

    def test_faults_and_states_of_devices(self):
        with takt.Run("graph.yaml") as run:
            self.assertEqual(run.faults(), {"front_laser": ["silent"]})
            run.fault("front_laser", "silent")
            run.fault("front_laser", "silent", on=False)
            run.wait_for_device("front_laser", "silent", within_s=5)
            with self.assertRaisesRegex(AssertionError, "front_laser is silent, not ok within 0 s"):
                run.wait_for_device("front_laser", within_s=0)
            with self.assertRaisesRegex(takt.Error, "no device base; devices: front_laser"):
                run.wait_for_device("base")
        self.assertEqual(run.exit_code, 0)

    def test_a_run_that_ends_by_itself(self):
        with takt.Run("graph.yaml") as run:
            with self.assertRaisesRegex(AssertionError, "did not end by itself within 0.1 s"):
                run.wait_for_end(within_s=0.1)
            run.mode("full")
            run.wait_for_end(within_s=30)
            self.assertTrue(run.report["ok"])
        self.assertEqual(run.exit_code, 0)

    def test_a_test_that_fails_ends_the_run(self):
        with self.assertRaises(ZeroDivisionError):
            with takt.Run("graph.yaml") as run:
                1 / 0
        self.assertEqual(run.exit_code, 0)

    def test_no_record_was_asked_for(self):
        with takt.Run("graph.yaml") as run:
            pass
        with self.assertRaisesRegex(takt.Error, "record=True"):
            run.record()


if __name__ == "__main__":
    unittest.main()
