#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Garbage at the DDS ports of a running part: fuzzed_rtps.py [SECONDS] [SEED] [--keys].

graph/two_machines.yaml in two network namespaces. Packets between the two parts are captured for a while; then for SECONDS (60)
random and mutated ones are sent to the ports of the part `robot`, from the address of the other machine. Exit 1 if a process other
than `link` ended, if `link` was away for more than 3 s, if a job was left out, or if one of high criticality was late. Where `link` was ended by the
library, that is printed. With --keys both parts have keys, and messages must go on as if nothing was there; without, a forged packet
may cut a connection. Exit 77 without root or ip.
"""
import ctypes
import json
import os
import pathlib
import random
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time

from spaces import Spaces

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
with_keys = "--keys" in sys.argv
arguments = [word for word in sys.argv[1:] if word != "--keys"]
seconds = float((arguments[:1] or ["60"])[0])
seed = int((arguments[1:] or ["1"])[0])
ADDRESSES = {"robot": "10.93.0.1", "vision": "10.93.0.2"}
CAPTURE_S, BATCH, PAUSE_S = 6, 10, 0.005  # 2,000 packets a second at most
BACK_S = 3
OF_LINK = ("traversability", "vision")  # devices of the process `link`, which have no jobs while that is away
RATE_HZ, KEPT = 15, 0.8  # of messages from the other machine; it ends a little earlier


def part(spaces, machine, work, run_s):
    keys = ["--keys", work / "keys" / machine] if with_keys else []
    return spaces.begin(machine, takt, "run", root / "graph/two_machines.yaml", "--machine", machine, "--for", f"{run_s}s", "--ring", "off", "--output",
                        work / machine, "--report", work / f"{machine}.json", *keys, stdout=subprocess.DEVNULL, stderr=open(work / f"{machine}.err", "w"))


def capture():
    """Payloads that went to the robot, by port; those to all are taken for it as well."""
    cable = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    cable.bind(("cable", 0))
    cable.settimeout(0.1)
    ports, end = {}, time.monotonic() + CAPTURE_S
    while time.monotonic() < end:
        try:
            frame = cable.recv(1 << 17)
        except TimeoutError:
            continue
        if frame[12:14] == b"\x08\x00" and frame[23] == 17 and frame[42:46] == b"RTPS":
            to = int.from_bytes(frame[36:38], "big")
            if frame[26:30] == socket.inet_aton(ADDRESSES["vision"]):
                ports.setdefault(to, []).append(frame[42:])
    return ports


def mutate(chance, packets):
    """One of these, with some bytes, lengths or pieces changed; now and then noise behind a header, or noise alone."""
    kind = chance.random()
    if kind < 0.05:
        return chance.randbytes(chance.randrange(1500))
    packet = bytearray(chance.choice(packets))
    if kind < 0.1:
        return bytes(packet[:20]) + chance.randbytes(chance.randrange(1400))
    for _ in range(chance.choice((1, 1, 1, 2, 4, 16))):
        at = chance.randrange(len(packet)) if chance.random() < 0.5 else min(chance.randrange(20, 120), len(packet) - 1)
        what = chance.random()
        if what < 0.35:
            packet[at] ^= 1 << chance.randrange(8)
        elif what < 0.6:
            packet[at] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
        elif what < 0.75:
            packet[at:at + 4] = chance.choice((0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, len(packet))).to_bytes(4, "little")
        elif what < 0.85:
            del packet[at:at + chance.randrange(1, 40)]
        elif what < 0.95:
            other = chance.choice(packets)
            packet[at:at] = other[20:20 + chance.randrange(1, 200)]
        else:
            del packet[at:]
        if len(packet) < 4:
            break
    return bytes(packet)


def fuzz(ports):
    chance, sender, sent = random.Random(seed), socket.socket(socket.AF_INET, socket.SOCK_DGRAM), 0
    all_packets = [packet for packets in ports.values() for packet in packets]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for _ in range(BATCH):
            port = chance.choice(list(ports))
            packets = ports[port] if chance.random() < 0.8 else all_packets
            try:
                sender.sendto(mutate(chance, packets), (ADDRESSES["robot"], port))
                sent += 1
            except OSError:
                pass  # too long, or nobody listens while `link` starts again
        time.sleep(PAUSE_S)
    return sent


def member(supervisor, name):
    """The process of that name of a run, whose first process is below `ip`."""
    found = subprocess.run(["pgrep", "-x", name, "-P", str(supervisor.pid)], stdout=subprocess.PIPE, text=True, check=False).stdout.split()
    return found[0] if found else None


def watch(supervisor, until):
    """How long there was no process `link`, each time, s."""
    away, seen, known = [], time.monotonic(), member(supervisor, "link")
    while not until.wait(0.02):
        now, here = time.monotonic(), member(supervisor, "link")
        if here and here != known:
            away.append(now - seen)
            known = here
        if here:
            seen = now
    return away if here else [*away, now - seen]


def judge(report, away, said):
    ended = [fault for fault in report["faults"] if "process" in fault["what"] and ("ended" in fault["what"] or "hung" in fault["what"])]
    for fault in ended:
        print(f"  {fault['at_s']:.1f} s: {fault['what']}")
    strange = [fault for fault in ended if "process link" not in fault["what"]]
    nodes = [node for node in report["nodes"] if (node["name"] not in OF_LINK and (node["released"] or 0) > node["completed"] + 1) or
             (node["criticality"] == "high" and node["deadline_misses"])]
    for node in report["nodes"]:
        if node["deadline_misses"] or node in nodes:
            print(f"  {node['name']} ({node['criticality']}): {node['completed']} of {node['released']} jobs, {node['deadline_misses']} late")
    for device in report["devices"]:
        if device["received"]:
            print(f"  {device['name']}: {device['received']} received, {device['damaged']} damaged, {device['missing']} missing")
    print(f"  {len(ended)} processes ended, {len(strange)} of them not `link`, which was away {len(away)} times, {max(away, default=0):.2f} s at most; "
          f"{len(nodes)} nodes with a job left out, or of high criticality and late; host stall {report['host_stall_ms']} ms")
    for line in subprocess.run(["dmesg"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False).stdout.splitlines()[-40:]:
        if "link[" in line:
            print("  kernel: " + line)
    came = next(device["received"] for device in report["devices"] if device["name"] == "traversability")
    cut = with_keys and came < KEPT * RATE_HZ * report["duration_s"]
    return bool(strange or nodes or cut or max(away, default=0) > BACK_S) or "Sanitizer" in said


def main(work):
    with Spaces(ADDRESSES) as spaces:
        if with_keys:
            subprocess.run([takt, "keys", root / "graph/two_machines.yaml", "--out", work / "keys"], stdout=subprocess.DEVNULL, check=True)
        parts = [part(spaces, machine, work, seconds + 15) for machine in ADDRESSES]
        time.sleep(0.5)  # what they say first, too
        caught, done = {}, threading.Event()
        thread = threading.Thread(target=attack, args=(spaces.names["vision"], caught, done))
        thread.start()
        away = watch(parts[0], done)
        thread.join()
        for one in parts:
            one.wait()
    said = (work / "robot.err").read_text()
    print(f"{caught.get('sent', 0)} packets to {len(caught.get('ports', {}))} ports in {seconds:.0f} s, seed {seed}, from "
          f"{sum(map(len, caught.get('ports', {}).values()))} captured ones")
    if not caught.get("sent"):
        print(said[-2000:])
        return 1
    return judge(json.loads((work / "robot.json").read_text()), away, said)


def attack(space, caught, done):
    """From the namespace of the other machine: sockets belong to that of the thread that opens them."""
    try:
        with open(f"/run/netns/{space}", encoding="ascii") as file:
            setns(file.fileno())
        caught["ports"] = capture()
        caught["sent"] = fuzz(caught["ports"]) if caught["ports"] else 0
    finally:
        done.set()


def setns(descriptor):
    """os.setns is of Python 3.12."""
    if ctypes.CDLL(None, use_errno=True).setns(descriptor, 0x40000000) != 0:
        raise OSError(ctypes.get_errno(), "setns")


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("ip"):
        print("NOT RUN: needs root and ip (iproute2)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="fuzzed") as folder:
        sys.exit(main(pathlib.Path(folder)))
