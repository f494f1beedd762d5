# SPDX-License-Identifier: Apache-2.0
"""Takes all bandwidth of SCHED_DEADLINE that is free, and whatever becomes free, until its standard input ends. Says
"taken" once there was nothing left, and at the end how much it had. Exit 77 where SCHED_DEADLINE is refused."""
import ctypes
import errno
import platform
import struct
import sys
import threading

PERIOD_NS = 100_000_000
libc = ctypes.CDLL(None, use_errno=True)
number = {"x86_64": 314, "aarch64": 274}[platform.machine()]
end, held = threading.Event(), []


def reserve(runtime_ns):
    """Of the calling thread: 0 or an errno."""
    attributes = struct.pack("=IIQiIQQQ", 48, 6, 0, 0, 0, runtime_ns, PERIOD_NS, PERIOD_NS)
    return 0 if libc.syscall(number, 0, attributes, 0) == 0 else ctypes.get_errno()


def hold(share, answer):
    error = reserve(int(share * PERIOD_NS))
    answer.append(error)
    answered.set()
    if error == 0:
        end.wait()


def take(share):
    answer = []
    answered.clear()
    threading.Thread(target=hold, args=(share, answer), daemon=True).start()
    answered.wait()
    if answer[0] == 0:
        held.append(share)
    elif answer[0] != errno.EBUSY:
        print("NOT RUN: SCHED_DEADLINE is refused", flush=True)
        raise SystemExit(77)
    return answer[0] == 0


answered = threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), end.set()), daemon=True).start()
told = False
while not end.is_set():
    for share in (0.9, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001):
        while not end.is_set() and take(share):
            pass
    if not told:
        print("taken", flush=True)
        told = True
    end.wait(0.002)
print(f"had {sum(held):.3f} cores", flush=True)
