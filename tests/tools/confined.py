# SPDX-License-Identifier: Apache-2.0
"""Runs a command under the restrictions of a systemd unit where no systemd runs, as root:

    confined.py UNIT FOLDER COMMAND...

user nobody with the unit's capabilities and limits, no new privileges, its system calls, address families and memory
rules (by libseccomp), a file system that is read-only but for the runtime and the state folder, an empty /tmp, no
homes. FOLDER is shown as /opt/takt. Not done: device and address filters of control groups."""
import ctypes
import os
import re
import resource
import subprocess
import sys

NOBODY = 65534
libc = ctypes.CDLL(None, use_errno=True)


def settings(unit):
    """By key the values in their order; an empty one forgets those before it."""
    found, section = {}, ""
    for line in open(unit):
        line = line.strip()
        if line.startswith("["):
            section = line
        elif section == "[Service]" and "=" in line and not line.startswith("#"):
            key, value = line.split("=", 1)
            found.setdefault(key, []).append(value)
    return found


def words(unit, key):
    return " ".join(unit.get(key, [])).split()


def mount(*arguments):
    subprocess.run(["mount", *arguments], check=True)


def shut(unit, folder):
    """The file system as the unit has it; in a mount namespace of this process."""
    if libc.unshare(0x00020000) != 0:
        raise OSError(ctypes.get_errno(), "unshare")
    mount("--make-rprivate", "/")
    name = unit["RuntimeDirectory"][0]
    for place in ("/opt", "/run", "/var/lib"):
        mount("-t", "tmpfs", "-o", "mode=0755", "tmpfs", place)
        if place == "/opt":  # while FOLDER is still in sight
            os.mkdir("/opt/takt")
            mount("--bind", folder, "/opt/takt")
    for place, mode in ((f"/run/{name}", unit["RuntimeDirectoryMode"]), (f"/var/lib/{name}", unit["StateDirectoryMode"])):
        os.mkdir(place)
        os.chmod(place, int(mode[0], 8))
        os.chown(place, NOBODY, NOBODY)
    if unit["ProtectProc"] == ["invisible"]:
        mount("-t", "proc", "-o", "hidepid=invisible", "proc", "/proc")
    if unit["ProtectHome"] == ["yes"]:
        for place in ("/home", "/root"):
            mount("-t", "tmpfs", "-o", "mode=0000", "tmpfs", place)
    if unit["PrivateTmp"] == ["yes"]:
        mount("-t", "tmpfs", "-o", "mode=1777", "tmpfs", "/tmp")
    if unit["ProtectSystem"] == ["strict"]:
        for place in (f"/run/{name}", f"/var/lib/{name}"):
            mount("--bind", place, place)
        keep = ("/proc", "/sys", "/dev", "/tmp", f"/run/{name}", f"/var/lib/{name}")
        for line in open("/proc/self/mountinfo").readlines():
            place = line.split()[4].replace("\\040", " ")
            if not any(place == k or place.startswith(k + "/") for k in keep):
                subprocess.run(["mount", "-o", "remount,bind,ro", place], stderr=subprocess.DEVNULL)


def named_calls(names):
    """Sets of systemd (@NAME) as the calls in them."""
    calls = set()
    for name in names:
        if not name.startswith("@"):
            calls.add(name)
            continue
        text = subprocess.run(["systemd-analyze", "syscall-filter", name], capture_output=True, text=True, check=True).stdout
        calls |= named_calls([line.strip() for line in text.splitlines()[1:] if re.match(r"\s+[@a-z]", line)])
    return calls


def allowed_calls(unit):
    calls = set()
    for value in unit["SystemCallFilter"]:
        if value.startswith("~"):
            calls -= named_calls(value[1:].split())
        else:
            calls |= named_calls(value.split())
    return calls | named_calls(["@default"])


class Argument(ctypes.Structure):
    _fields_ = [("arg", ctypes.c_uint), ("op", ctypes.c_int), ("a", ctypes.c_uint64), ("b", ctypes.c_uint64)]


def filter_calls(unit):
    seccomp = ctypes.CDLL("libseccomp.so.2")
    seccomp.seccomp_init.restype = ctypes.c_void_p
    seccomp.seccomp_rule_add_array.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_int, ctypes.c_uint,
                                               ctypes.POINTER(Argument)]
    allow, refuse, no_such = 0x7FFF0000, 0x00050000 | 1, 0x00050000 | 38
    equal, masked = 4, 7
    number = lambda name: seccomp.seccomp_syscall_resolve_name(name.encode())

    def rule(context, action, name, *arguments):
        array = (Argument * max(len(arguments), 1))(*arguments)
        if number(name) >= 0 and seccomp.seccomp_rule_add_array(context, action, number(name), len(arguments), array) != 0:
            raise SystemExit(f"confined: no rule for {name}")

    calls = allowed_calls(unit)
    context = ctypes.c_void_p(seccomp.seccomp_init(refuse))
    families = {"AF_UNIX": 1, "AF_INET": 2, "AF_CAN": 29}
    special = {"socket", "mmap", "mprotect", "pkey_mprotect", "shmat", "unshare", "setns", "clone3"}
    for name in calls - special:
        rule(context, allow, name)
    for family in words(unit, "RestrictAddressFamilies"):
        rule(context, allow, "socket", Argument(0, equal, families[family], 0))
    if unit["MemoryDenyWriteExecute"] == ["yes"]:  # PROT_EXEC is 4, PROT_WRITE 2, SHM_EXEC 0o100000
        for wanted in (0, 2, 4):
            rule(context, allow, "mmap", Argument(2, masked, 6, wanted))
        rule(context, allow, "mprotect", Argument(2, masked, 4, 0))
        rule(context, allow, "pkey_mprotect", Argument(2, masked, 4, 0))
        rule(context, allow, "shmat", Argument(2, masked, 0o100000, 0))
    if unit["RestrictNamespaces"] == ["yes"]:
        rule(context, no_such, "clone3")  # as systemd does: the C library falls back to clone
    if seccomp.seccomp_load(context) != 0:
        raise SystemExit("confined: the filter of system calls was refused")


def main():
    if sys.argv[1] == "--filter":
        unit = settings(sys.argv[2])
        filter_calls(unit)
        os.execvp(sys.argv[3], sys.argv[3:])
    unit_file, folder, command = os.path.realpath(sys.argv[1]), sys.argv[2], sys.argv[3:]
    unit = settings(unit_file)
    itself = open(__file__).read()  # the folders of both may be out of sight in a moment
    unit_text = open(unit_file).read()
    shut(unit, folder)
    os.chdir("/var/lib/takt")
    if unit["LimitMEMLOCK"] == ["infinity"]:
        try:
            resource.setrlimit(resource.RLIMIT_MEMLOCK, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        except ValueError:  # a container without CAP_SYS_RESOURCE: the limit stays
            pass
    resource.setrlimit(resource.RLIMIT_RTPRIO, (int(unit["LimitRTPRIO"][0]),) * 2)
    os.umask(int(unit["UMask"][0], 8))
    ambient = ",".join("+" + c.removeprefix("CAP_").lower() for c in words(unit, "AmbientCapabilities"))
    bounding = ",".join("+" + c.removeprefix("CAP_").lower() for c in words(unit, "CapabilityBoundingSet"))
    for name, text in (("confined.py", itself), ("unit", unit_text)):
        with open("/tmp/" + name, "w") as copy:
            copy.write(text)
        os.chmod("/tmp/" + name, 0o444)
    environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_RUNTIME_DIR")}
    environment |= dict(setting.split("=", 1) for setting in unit.get("Environment", []))
    os.execvpe("setpriv", ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups",
                           f"--inh-caps=-all,{ambient}", f"--ambient-caps=-all,{ambient}", f"--bounding-set=-all,{bounding}",
                           "--no-new-privs", "/usr/bin/python3", "/tmp/confined.py", "--filter", "/tmp/unit", *command],
               environment)


main()
