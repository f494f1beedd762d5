#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints what a record holds, and how near the nearest obstacle was: table.py RECORD"""
import sys

import takt

record = takt.read_record(sys.argv[1])
if record.missing:
    print(f"not whole: {record.missing}")

print(f"{'port':20} {'type':14} {'messages':>8} {'first s':>8} {'last s':>8}")
begin_ns = min(port.stamps_ns[0] for port in record.ports.values() if len(port))
for name, port in sorted(record.ports.items()):
    times = [(stamp_ns - begin_ns) / 1e9 for stamp_ns in port.stamps_ns] or [float("nan")]
    print(f"{name:20} {port.type:14} {len(port):8} {times[0]:8.3f} {times[-1]:8.3f}")

scans = record["front_laser.scan"]
unit = scans.units["range_m"]
print(f"\n{'scan':>4} {'nearest ' + unit:>10}")
for sequence, ranges in list(zip(scans.sequences, scans["range_m"]))[::5]:
    print(f"{sequence:4} {min(r for r in ranges if r > 0):10.3f}")  # 0: no echo
