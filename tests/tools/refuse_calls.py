# SPDX-License-Identifier: Apache-2.0
"""Runs a command to which the kernel refuses system calls, as the filter of a container does (by libseccomp):

    refuse_calls.py EPERM|ENOSYS CALL[,CALL...] COMMAND...
"""
import ctypes
import errno
import os
import sys

seccomp = ctypes.CDLL("libseccomp.so.2")
seccomp.seccomp_init.restype = ctypes.c_void_p
number, calls, command = getattr(errno, sys.argv[1]), sys.argv[2].split(","), sys.argv[3:]
context = ctypes.c_void_p(seccomp.seccomp_init(0x7FFF0000))  # allow
for call in calls:
    if seccomp.seccomp_rule_add(context, 0x00050000 | number, seccomp.seccomp_syscall_resolve_name(call.encode()), 0) != 0:
        sys.exit(f"refuse_calls: no rule for {call}")
if seccomp.seccomp_load(context) != 0:
    sys.exit("refuse_calls: the filter was refused")
os.execvp(command[0], command)
