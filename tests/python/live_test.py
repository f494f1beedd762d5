# SPDX-License-Identifier: Apache-2.0
"""Speaking to a run: a thread here answers as graph/attach does."""
import json
import os
import pathlib
import socket
import tempfile
import threading
import unittest
from unittest import mock

import takt


class LiveTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        patch = mock.patch.dict(os.environ, XDG_RUNTIME_DIR=folder.name)
        patch.start()
        self.addCleanup(patch.stop)
        self.folder = pathlib.Path(folder.name) / "takt"
        self.folder.mkdir(mode=0o700)
        self.listener = socket.socket(socket.AF_UNIX)
        self.addCleanup(self.listener.close)
        self.questions, self.answers = [], {}

    def listen(self):
        self.listener.bind(str(self.folder / f"{os.getpid()}.sock"))
        self.listener.listen()
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            with client, client.makefile("rwb") as file:
                line = file.readline()
                if not line:
                    continue
                question = json.loads(line)
                self.questions.append(question)
                for answer in self.answers[question["do"]]:
                    file.write(json.dumps(answer).encode() + b"\n")
                file.flush()

    def test_questions(self):
        self.answers = {"set": [{"ok": True}], "mode": [{"ok": True}], "fault": [{"ok": True}],
                        "get": [{"parameters": [{"value": 0.3}]}]}
        self.listen()
        self.assertEqual(takt.running(), [os.getpid()])
        run = takt.Connection()
        run.set("cruise.speed", "0.3m/s")
        run.set("cruise.forward", True)
        run.mode("safe_stop")
        self.assertEqual(run.get("cruise.speed"), 0.3)
        self.assertEqual(self.questions[0], {"do": "set", "param": "cruise.speed", "value": "0.3m/s", "keep": False})
        self.assertEqual(self.questions[1]["value"], "true")
        self.assertEqual(self.questions[2], {"do": "mode", "mode": "safe_stop"})
        run.fault("front_laser", "silent", on=False)
        self.assertEqual(self.questions[-1], {"do": "fault", "device": "front_laser", "fault": "silent", "on": False})

    def test_a_refusal_is_raised(self):
        self.answers = {"mode": [{"error": "its modes: full, safe_stop"}]}
        self.listen()
        with self.assertRaisesRegex(takt.Error, "its modes: full, safe_stop"):
            takt.Connection().mode("fast")

    def test_messages_are_followed_to_the_end_of_the_run(self):
        line = {"type": "laser_scan", "sequence": 7, "level": 0, "stamp_ns": 5, "bytes": 0,
                "message": {"max_range_m": 8.0, "range_m": {"size": 2, "first": [1.0, 2.0]}}}
        self.answers = {"echo": [line, line | {"sequence": 8}]}
        self.listen()
        messages = list(takt.Connection().follow("front_laser.scan"))
        self.assertEqual([message.sequence for message in messages], [7, 8])
        self.assertEqual(messages[0], {"max_range_m": 8.0, "range_m": [1.0, 2.0]})
        self.assertEqual(messages[0].stamp_ns, 5)

    def test_a_folder_open_to_others_is_passed_over(self):
        self.listen()
        self.folder.chmod(0o777)
        self.assertNotIn(os.getpid(), takt.running())

    def test_nothing_runs(self):
        with mock.patch("takt.live.running", return_value=[]), self.assertRaisesRegex(takt.Error, "takt run"):
            takt.Connection()

    def test_a_program_that_is_missing(self):
        with self.assertRaisesRegex(takt.RunFailed, "set TAKT"):
            with takt.Run("graph.yaml", command="/nowhere/takt"):
                self.fail("it started")

    def test_a_run_that_ends_at_once(self):
        with self.assertRaisesRegex(takt.RunFailed, "exit code 1"):
            with takt.Run("graph.yaml", command="/bin/false"):
                self.fail("it started")


if __name__ == "__main__":
    unittest.main()
