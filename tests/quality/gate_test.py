#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The verdicts of gate.py and ratios.py on figures and rows that stand here; nothing is measured."""
import contextlib
import io
import json
import os
import tempfile
import unittest

import gate
import ratios
from ratios import FAILED, MET, UNCLEAR, WITHIN, Target, judge, null_of


def row(name, ratio, reference="OpenCV"):
    return {"name": name, "ratio": ratio, "reference": reference}


def at_most(value, pattern="*"):
    return Target("targets.txt:1", pattern, "<=", value)


def at_least(value, pattern="*"):
    return Target("targets.txt:2", pattern, ">=", value)


def quietly(call, *arguments, **named):
    """(result, what was printed)"""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        result = call(*arguments, **named)
    return result, out.getvalue()


class Figures(unittest.TestCase):
    """compare_figures with an evaluation that says what stands in 99_gate.json, and with one figure of it made wrong."""

    def setUp(self):
        self.gate = gate.read_gate()
        self.said = {evaluation["eval"]: {f["path"]: f["stored"] for f in evaluation["figures"]} for evaluation in self.gate["evaluations"]}

    def differ(self):
        def nested(command):
            document = {}
            for path, value in self.said[command].items():
                *steps, last = path.split("/")
                place = document
                for step in steps:
                    place = place.setdefault(step, {})
                place[last] = value
            return document, ""

        return quietly(gate.compare_figures, self.gate, nested)

    def test_as_stored(self):
        self.assertEqual(self.differ()[0], 0)

    def test_one_wrong_figure(self):
        for evaluation in self.gate["evaluations"]:
            for figure in evaluation["figures"]:
                right = figure["stored"]
                for wrong in (right + 1.01 * figure["tolerance"] + 1e-6, right - 1.01 * figure["tolerance"] - 1e-6):
                    figure["stored"] = wrong
                    self.assertEqual(self.differ()[0], 1, figure)
                figure["stored"] = right

    def test_no_such_figure(self):
        self.gate["evaluations"][0]["figures"][0]["path"] += "/none"
        self.assertIn("there is no such figure", self.differ()[1])

    def test_failed_evaluation(self):
        count = sum(len(evaluation["figures"]) for evaluation in self.gate["evaluations"])
        self.assertEqual(quietly(gate.compare_figures, self.gate, lambda command: (None, "exit 3"))[0], count)

    def test_store(self):
        command, path = self.gate["evaluations"][0]["eval"], self.gate["evaluations"][0]["figures"][0]["path"]
        self.said[command][path] = 77.123456
        self.assertEqual(self.differ()[0], 1)
        with tempfile.TemporaryDirectory() as folder:
            gate.write_gate(self.gate, os.path.join(folder, "gate.json"))
            stored = gate.read_gate(os.path.join(folder, "gate.json"))
        self.assertEqual(stored["evaluations"][0]["figures"][0]["stored"], 77.12)
        self.assertEqual(stored["evaluations"][1:], gate.read_gate()["evaluations"][1:])

    def test_bad_file(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "gate.json")
            with open(path, "w", encoding="utf-8") as file:
                json.dump({"evaluations": [{"eval": "stereo", "figures": [{"path": "a", "better": "lower", "stored": "0.9", "tolerance": 1}]}]}, file)
            with self.assertRaises(SystemExit) as refused, contextlib.redirect_stderr(io.StringIO()) as said:
                gate.read_gate(path)
        self.assertEqual(refused.exception.code, 2)
        self.assertIn("takt eval stereo: a:", said.getvalue())


class Verdict(unittest.TestCase):
    def test_at_most(self):
        for ratio, null, verdict in ((0.5, None, MET), (1.0, 3.0, MET), (1.01, None, FAILED), (1.01, 1.0, FAILED),
                                     (1.09, 1.1, WITHIN), (1.09, 1 / 1.1, WITHIN), (1.11, 1.1, FAILED),
                                     (1.11, 1 / 1.1, FAILED), (1.49, 1.5, WITHIN)):
            with self.subTest(ratio=ratio, null=null):
                self.assertEqual(judge(at_most(1.0), ratio, null), verdict)

    def test_at_least(self):
        for ratio, null, verdict in ((6.0, None, MET), (1.5, 0.2, MET), (1.49, None, FAILED), (1.4, 1.1, WITHIN),
                                     (1.4, 1 / 1.1, WITHIN), (1.3, 1.1, FAILED), (0.0, 1.1, FAILED)):
            with self.subTest(ratio=ratio, null=null):
                self.assertEqual(judge(at_least(1.5), ratio, null), verdict)

    def test_wide_null_pair_decides_nothing(self):
        for null in (2.0, 0.5):
            self.assertEqual(judge(at_most(1.0), 1.2, null), UNCLEAR)
            self.assertEqual(judge(at_most(1.0), 2.1, null), FAILED)
            self.assertEqual(judge(at_most(1.0), 0.9, null), MET)

    def test_second_run_decides(self):
        self.assertEqual(judge(at_most(1.0), 1.2, 2.0, last=True), WITHIN)
        self.assertEqual(judge(at_most(1.0), 1.6, 2.0, last=True), FAILED)
        self.assertEqual(judge(at_least(1.5), 0.9, 2.0, last=True), FAILED)


class NullPair(unittest.TestCase):
    def test_by_name(self):
        rows = [row("cloud/smooth/1", 0.5), row("cloud/smooth/1_null", 1.02), row("cloud/smooth/2_null", 1.5)]
        self.assertEqual(null_of(rows[0], rows), 1.02)

    def test_by_reference_and_variant(self):
        rows = [row("graph/a/takt/latency_128_fifo", 0.2, "futex_threads"),
                row("graph/a/futex_threads_null/latency_900_fifo", 1.3, "futex_threads"),
                row("graph/b/iceoryx_null/latency_128_fifo", 1.4, "iceoryx"),
                row("graph/a/futex_threads_null/latency_128_fifo", 1.1, "futex_threads")]
        self.assertEqual(null_of(rows[0], rows), 1.1)

    def test_none(self):
        rows = [row("objects/budget_12ms/4", 0.9, "budget"), row("objects/cch/100_null", 1.1, "budget"),
                row("objects/budget_12ms/4_null", None, "budget")]
        self.assertIsNone(null_of(rows[0], rows))


class Suite(unittest.TestCase):
    """judge_suite with the rows of one run after the other instead of a benchmark."""

    def judge(self, targets, *runs):
        left = list(runs)
        outcome, self.printed = quietly(ratios.judge_suite, "bench", "suite --rounds 3", targets,
                                        measure=lambda bench, command: (*left.pop(0), 1.0))
        self.assertEqual(left, [])
        return outcome

    def test_verdict_of_each_row(self):
        outcome = self.judge([at_most(1.0, "s/a*"), at_least(2.0, "s/b")],
                             *[([row("s/a1", 0.5), row("s/a2", 1.5), row("s/a2_null", 1.1), row("s/a3", None),
                                 row("s/b", 1.9), row("s/b_null", 0.9)], "")] * 3)
        self.assertEqual([(f["name"], f["verdict"]) for f in outcome["rows"]],
                         [("s/a1", MET), ("s/b", WITHIN), ("s/a2", FAILED)])
        self.assertEqual(outcome["errors"], [])
        self.assertIn("1.5 of OpenCV, <= 1, null 1.1: FAILED", self.printed)

    def test_missing_row(self):
        outcome = self.judge([at_most(1.0, "s/none"), at_most(1.0, "s/no_ratio")], ([row("s/no_ratio", None)], ""))
        self.assertEqual(len(outcome["errors"]), 2)

    def test_failed_suite(self):
        outcome = self.judge([at_most(1.0)], ([], "exit 3: no iceoryx"))
        self.assertEqual(outcome["errors"], ["exit 3: no iceoryx"])

    def test_three_runs_decide_about_what_is_unclear_alone(self):
        first = [row("s/a", 1.2), row("s/a_null", 1.8), row("s/b", 0.9)]
        second = [row("s/a", 0.8), row("s/a_null", 1.0), row("s/b", 1.9)]
        outcome = self.judge([at_most(1.0, "s/*")], (first, ""), (second, ""), (second, ""))
        self.assertEqual({f["name"]: f["verdict"] for f in outcome["rows"]}, {"s/a": MET, "s/b": MET})
        self.assertEqual(outcome["runs"], 3)
        self.assertIn("twice more, for s/a", self.printed)

    def test_the_median_of_three_decides_about_what_failed(self):
        def verdict(*ratios_of_a):
            runs = [([row("s/a", ratio), row("s/a_null", 1.0)], "") for ratio in ratios_of_a]
            return self.judge([at_most(1.0, "s/*")], *runs)["rows"][0]

        self.assertEqual(verdict(1.2, 0.9, 0.95)["verdict"], MET)
        self.assertEqual(verdict(1.2, 0.5, 1.1), {**verdict(1.2, 1.1, 0.5), "runs": [1.2, 0.5, 1.1]})
        self.assertEqual(verdict(1.2, 0.5, 1.1)["verdict"], FAILED)
        self.assertEqual(verdict(1.2, 0.5, 1.1)["ratio"], 1.1)
        self.assertIn("FAILED (median of 1.2 0.5 1.1)", self.printed)

    def test_every_run_must_have_the_row(self):
        outcome = self.judge([at_most(1.0, "s/*")], ([row("s/a", 1.2), row("s/a_null", 1.8)], ""), ([], ""), ([], ""))
        self.assertEqual(outcome["errors"], ["not every run has s/a"])

    def test_a_later_run_that_fails(self):
        outcome = self.judge([at_most(1.0, "s/*")], ([row("s/a", 1.2)], ""), ([], "exit 3: no iceoryx"))
        self.assertEqual(outcome["errors"], ["exit 3: no iceoryx"])


class Whole(unittest.TestCase):
    def test_suite_that_hangs(self):
        with tempfile.TemporaryDirectory() as folder:
            bench = os.path.join(folder, "bench")
            with open(bench, "w", encoding="utf-8") as file:
                file.write("#!/bin/sh\nsleep 600 &\nwait\n")
            os.chmod(bench, 0o755)
            rows, error, _ = ratios.run_suite(bench, "suite", limit_s=0.3)
        self.assertEqual((rows, error), ([], "it did not end within 0.3 s"))

    def judge_all(self, ratio, name="s/a"):
        """With a program in place of takt-bench: `suite --json FILE` writes one row, into a file beside it that it renames."""
        with tempfile.TemporaryDirectory() as folder:
            bench, report = os.path.join(folder, "bench"), os.path.join(folder, "report.json")
            with open(bench, "w", encoding="utf-8") as file:
                file.write(f"#!/bin/sh\necho '{json.dumps([row(name, ratio)])}' >\"$3.new\"\nmv \"$3.new\" \"$3\"\n")
            os.chmod(bench, 0o755)
            good, _ = quietly(ratios.judge_all, bench, [("suite", [at_most(1.0, "s/a")])], report)
            with open(report, encoding="utf-8") as file:
                return good, json.load(file)

    def test_outcome(self):
        self.assertTrue(self.judge_all(0.9)[0])
        good, report = self.judge_all(1.1)
        self.assertFalse(good)
        self.assertEqual(report["suites"][0]["rows"][0]["verdict"], FAILED)
        self.assertLessEqual({"title", "machine", "date", "commit"}, report.keys())
        self.assertFalse(self.judge_all(0.9, "s/b")[0])

    def test_shares(self):
        suites = list("abcdefg")
        parts = [ratios.share(suites, f"{k}/3") for k in (1, 2, 3)]
        self.assertEqual(sorted(sum(parts, [])), suites)
        for wrong in ("0/3", "4/3", "3", "a/b", "1/0", ""):
            self.assertIsNone(ratios.share(suites, wrong))


if __name__ == "__main__":
    unittest.main()
