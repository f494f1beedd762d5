# SPDX-License-Identifier: Apache-2.0
"""The processes of a run, as the kernel tells of them."""
import os


def name(pid):
    """As the process calls itself; empty if there is none."""
    try:
        return open(f"/proc/{pid}/comm").read().strip()
    except OSError:
        return ""


def children(pid):
    """Process numbers of those that any of its threads has forked and that have not been asked for their end yet."""
    found = []
    try:
        for task in os.listdir(f"/proc/{pid}/task"):
            try:
                found += [int(child) for child in open(f"/proc/{pid}/task/{task}/children").read().split()]
            except OSError:  # a thread that has ended since
                pass
    except OSError:
        pass
    return found


def family(pid):
    """The process, its children and theirs."""
    return [pid] + [member for child in children(pid) for member in family(child)]


def alive(pid):
    """False, too, for one that has ended and was not asked for its end yet."""
    try:
        return open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False
