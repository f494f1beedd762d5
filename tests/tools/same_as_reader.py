#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""same_as_reader.py RECORD < LINES: whether `takt log echo RECORD --items 1000000000` and the Python reader show the same.

Compares every message: port, type, sequence, stamp, level, and each field with each of its numbers. Prints how many numbers
of each port are equal. Exit 1 at the first that differs, at a message that only one of them has, and if there is none."""
import json
import math
import sys

import takt


def flat(value):
    return [number for row in value for number in (row if hasattr(row, "__len__") else [row])] if hasattr(value, "__len__") else [value]


def shown(number):
    """As JSON has it, which knows no infinity and no NaN."""
    number = number.item() if hasattr(number, "item") else number
    return None if isinstance(number, float) and not math.isfinite(number) else number


def same(what, echoed, read):
    if echoed != read: sys.exit(f"{what} is {echoed} in the lines and {read} to the reader")


def compare(where, echoed, read):
    """How many numbers are equal."""
    if isinstance(echoed, str):
        same(where, echoed, takt.text(read))
        return len(echoed)
    if isinstance(echoed, dict):
        same(f"{where}.size", echoed["size"], len(read))
        echoed = echoed["first"]
    numbers = [shown(number) for number in flat(read)]
    same(where, flat(echoed), numbers)
    return len(numbers)


def main(path):
    record, numbers = takt.read_record(path), {}
    ports = {name: iter(port) for name, port in record.ports.items()}
    for text in sys.stdin:
        line = json.loads(text)
        port, where = line["port"], f"{line['port']} {line['sequence']}"
        message = next(ports[port], None)
        if message is None: sys.exit(f"{where}: the reader has no such message")
        same(f"{where}: its type", line["type"], record[port].type)
        for key in ("sequence", "stamp_ns", "level"): same(f"{where}: its {key}", line[key], message[key])
        if "hash" in line: continue
        same(f"{where}: its fields", list(line["message"]), record[port].fields)
        numbers[port] = numbers.get(port, 0) + sum(compare(f"{where}: {field}", value, message[field]) for field, value in line["message"].items())
    for name, rest in ports.items():
        if next(rest, None) is not None: sys.exit(f"{name}: the reader has more messages than the lines")
    print(json.dumps(numbers))
    return 0 if numbers else 1


sys.exit(main(sys.argv[1]))
