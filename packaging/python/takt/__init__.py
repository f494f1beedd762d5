# SPDX-License-Identifier: Apache-2.0
"""Takt from Python: read records, follow live ports, run a graph in a test.

    import takt
    scans = takt.read_record("run.mcap")["front_laser.scan"]
    print(scans.stamps_ns[0], scans["range_m"][0][:5])

    with takt.Run("graph.yaml", profile="sim") as run:
        run.set("cruise.speed", "0.3m/s")
        run.wait_for("obstacle_stop.stop", lambda m: m["reasons"] == 1, within_s=10)
    print(run.report["ok"])

Pure Python 3.11. Arrays are numpy's if numpy is installed, else `array.array`.
"""
from .live import Connection, Error, Message, running
from .record import Port, Record, RecordError, read_record, text
from .run import Run, RunFailed, read_report

__all__ = ["Connection", "Error", "Message", "Port", "Record", "RecordError", "Run", "RunFailed", "read_record",
           "read_report", "running", "text"]
