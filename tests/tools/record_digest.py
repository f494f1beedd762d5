#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""record_digest.py RECORD...: a line for each, with a hash of all that the Python reader sees in it."""
import hashlib
import pathlib
import sys

import takt

for path in sys.argv[1:]:
    record = takt.read_record(path)
    digest = hashlib.sha256(repr((record.jobs, record.events, sorted(record.info.items()))).encode())
    for name in ("plan.json", "graph.yaml"):
        digest.update(record.attachments[name])
    for name, port in sorted(record.ports.items()):
        if len(port) == 0:
            continue  # a writer may leave out a channel without messages
        digest.update(f"{name} {port.type} {port.units}".encode())
        for message in port:
            digest.update(repr([(key, list(value) if hasattr(value, "__len__") else value)
                                for key, value in message.items()]).encode())
    print(digest.hexdigest(), pathlib.Path(path).name, "; ".join([record.missing, *record.left_out]))
