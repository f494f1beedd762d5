#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A bad network between two machines, with an account of what it did to each DDS writer.

    ip netns exec relay tests/tools/relay.py left right --loss 5 --jitter 50 --for 20 >account.json
    tests/tools/relay.py --self-test

Bridges two interfaces, Ethernet frame by frame. Once --talking (2) machines have sent --begin (20) messages it is bad for --for seconds: it
drops --loss percent, delays by up to --jitter ms (which reorders), holds --reorder percent back for --held ms (100), so that later ones overtake them, doubles
--double percent, and lets nothing through from second A for B seconds (--partition A,B). Then it is a good cable until SIGTERM, and
prints its account as JSON. --seed repeats its choices for the same frames.

An account is of messages, as a reader of Cyclone DDS 0.10 sees them: RTPS says which writer a piece is of, and its number. A message
is lost if a piece of it never arrived, or if it was whole only after a newer one (best-effort readers take none that is older), or if
pieces of more than four messages were there at once (DefragUnreliableMaxSamples).
"""
import argparse
import heapq
import json
import random
import select
import signal
import socket
import struct
import sys
import time

DATA, DATA_FRAG, INFO_DST = 0x15, 0x16, 0x0E
PUBLICATIONS = bytes.fromhex("000003c2")  # what writers there are
TOPIC_NAME, ENDPOINT_GUID, RELIABILITY, SENTINEL = 0x0005, 0x005A, 0x001A, 0x0001
DEFRAGMENTED = 4  # messages whose pieces a best-effort reader of Cyclone keeps
OUTGOING = 4  # sll_pkttype of what this machine sends itself
LARGEST = 1 << 17


def udp_payload(frame):
    """Of an IPv4 frame with UDP, where it begins; None for others. Pieces of IP are none: the cable has a large MTU."""
    if frame[12:14] != b"\x08\x00" or frame[23] != 17:
        return None
    if struct.unpack_from("!H", frame, 20)[0] & 0x3FFF:
        raise ValueError("a piece of an IP packet: the MTU is too small")
    return 14 + 4 * (frame[14] & 15) + 8


def submessages(packet):
    """(kind, little, body, flags) of each."""
    at = 20
    while at + 4 <= len(packet):
        kind, flags = packet[at], packet[at + 1]
        little = flags & 1
        size = struct.unpack_from("<H" if little else ">H", packet, at + 2)[0] or len(packet) - at - 4
        yield kind, little, packet[at + 4:at + 4 + size], flags
        at += 4 + size


def pieces(packet):
    """(writer, number, first piece, pieces, pieces of all, payload) of each DATA and DATA_FRAG."""
    if packet[:4] != b"RTPS":
        return
    for kind, little, body, flags in submessages(packet):
        if kind not in (DATA, DATA_FRAG) or len(body) < 20:
            continue
        order = "<" if little else ">"
        high, low = struct.unpack_from(order + "iI", body, 12)
        writer, number = packet[8:20] + body[8:12], (high << 32) + low
        payload = body[4 + struct.unpack_from(order + "H", body, 2)[0]:]
        if kind == DATA:
            yield writer, number, 1, 1, 1, payload
        else:
            first, count, size, whole = struct.unpack_from(order + "IHHI", body, 20)
            yield writer, number, first, count, -(-whole // size), payload


def publication(payload):
    """(writer, topic, reliable) of what discovery says of a writer, or None."""
    order = "<" if payload[1] & 1 else ">"
    at, found = 4, {}
    while at + 4 <= len(payload):
        name, size = struct.unpack_from(order + "HH", payload, at)
        if name == SENTINEL:
            break
        found[name] = payload[at + 4:at + 4 + size]
        at += 4 + size
    if ENDPOINT_GUID not in found or TOPIC_NAME not in found:
        return None
    length = struct.unpack_from(order + "I", found[TOPIC_NAME])[0]
    kind = struct.unpack_from(order + "I", found.get(RELIABILITY, b"\1\0\0\0" if order == "<" else b"\0\0\0\1"))[0]
    return found[ENDPOINT_GUID][:16], found[TOPIC_NAME][4:3 + length].decode(), kind == 2


class Writer:
    """What was sent by a writer, and what a best-effort reader has of it."""

    def __init__(self):
        self.sent, self.taken, self.partial = set(), set(), {}
        self.newest = self.overtaken = self.crowded = 0

    def send(self, number):
        self.sent.add(number)

    def arrive(self, number, first, count, whole):
        if whole == 1:
            return self.complete(number)
        if number not in self.partial:
            if len(self.partial) >= DEFRAGMENTED:
                oldest = min(self.partial)
                self.crowded += 1
                if number < oldest:
                    return None
                del self.partial[oldest]
            self.partial[number] = set()
        here = self.partial[number]
        here.update(range(first, first + count))
        if len(here) == whole:
            del self.partial[number]
            self.complete(number)
        return None

    def complete(self, number):
        if number > self.newest:
            self.newest = number
            self.taken.add(number)
        elif number not in self.taken:
            self.overtaken += 1

    def account(self):
        inside = [number for number in self.sent if number <= self.newest]
        return {"sent": len(inside), "lost": len(inside) - len(self.taken), "overtaken": self.overtaken, "crowded": self.crowded}


class Account:
    def __init__(self, talking=2):
        self.writers, self.topics, self.talking = {}, {}, talking

    def sent(self, frame):
        for writer, number, first, count, whole, payload in self.pieces(frame):
            self.writers.setdefault(writer, Writer()).send(number)
            if writer[12:] == PUBLICATIONS and whole == 1:
                if known := publication(payload):
                    self.topics[known[0]] = known[1:]

    def arrived(self, frame):
        for writer, number, first, count, whole, payload in self.pieces(frame):
            self.writers.setdefault(writer, Writer()).arrive(number, first, count, whole)

    @staticmethod
    def pieces(frame):
        at = udp_payload(frame)
        return pieces(frame[at:]) if at else ()

    def settled(self, messages):
        """Whether best-effort writers of each machine that sends have sent so many."""
        machines = {writer[:12] for writer, state in self.writers.items() if self.best_effort(writer) and len(state.taken) >= messages}
        return len(machines) >= self.talking

    def best_effort(self, writer):
        return writer in self.topics and not self.topics[writer][1]

    def told(self):
        return {self.topics[writer][0]: state.account() for writer, state in self.writers.items() if self.best_effort(writer)}


class Badness:
    """What happens to a frame: the delays in ms with which it goes on; none: it is lost."""

    def __init__(self, options):
        self.options, self.chance = options, random.Random(options.seed)

    def of(self, since_begin_s):
        o = self.options
        if not 0 <= since_begin_s < o.seconds:
            return [0.0]
        if o.partition and o.partition[0] <= since_begin_s < o.partition[0] + o.partition[1]:
            return []
        if self.chance.random() * 100 < o.loss:
            return []
        delays = [o.delay + self.chance.random() * o.jitter]
        if self.chance.random() * 100 < o.reorder:
            delays[0] += o.held
        if self.chance.random() * 100 < o.double:
            delays.append(delays[0] + self.chance.random() * max(o.jitter, 1))
        return delays


def open_end(name):
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    end.setsockopt(socket.SOL_SOCKET, 33, 16 << 20)  # SO_RCVBUFFORCE
    end.bind((name, 0))
    return end


def without_checksum(frame):
    """A sender on the same computer left the sum to its network card, of which there is none."""
    at = udp_payload(frame)
    return frame if at is None else frame[:at - 2] + b"\0\0" + frame[at:]


class Relay:
    def __init__(self, options):
        self.options, self.badness, self.account = options, Badness(options), Account(options.talking)
        self.ends = [open_end(options.left), open_end(options.right)]
        self.waiting, self.order, self.begun = [], 0, None
        self.frames = self.dropped = 0
        self.ended = False

    def take(self, end, now):
        frame, address = end.recvfrom(LARGEST)
        if address[2] == OUTGOING:
            return
        other = self.ends[1 - self.ends.index(end)]
        self.account.sent(frame)
        self.frames += 1
        delays = self.badness.of(now - self.begun) if self.begun is not None else [0.0]
        self.dropped += not delays
        for delay in delays:
            self.order += 1
            heapq.heappush(self.waiting, (now + delay / 1e3, self.order, other, frame))

    def pass_on(self, now):
        while self.waiting and self.waiting[0][0] <= now:
            _, _, other, frame = heapq.heappop(self.waiting)
            other.send(without_checksum(frame))
            self.account.arrived(frame)

    def run(self):
        while not self.ended:
            now = time.monotonic()
            self.pass_on(now)
            patience = min(self.waiting[0][0] - now, 0.1) if self.waiting else 0.1
            for end in select.select(self.ends, [], [], max(patience, 0))[0]:
                self.take(end, time.monotonic())
            if self.begun is None and self.account.settled(self.options.begin):
                self.begun = time.monotonic()
                print("bad from now on", file=sys.stderr, flush=True)
        bad_s = min(time.monotonic() - self.begun, self.options.seconds) if self.begun else 0
        print(json.dumps({"bad_s": bad_s, "frames": self.frames, "dropped": self.dropped, "writers": self.account.told()}))


# ---- the self test: frames made by hand, and what must be counted

def frame_of(writer, number, first=1, count=1, whole=1):
    body = struct.pack("<HH", 0, 16) + bytes(4) + writer[12:] + struct.pack("<iI", 0, number)
    kind = DATA
    if whole > 1:
        kind = DATA_FRAG
        body += struct.pack("<IHHI", first, count, 100, 100 * whole)
    submessage = struct.pack("<BBH", kind, 1, len(body)) + body
    packet = b"RTPS\2\1\1\x10" + writer[:12] + struct.pack("<BBHq", 0x09, 1, 8, 0) + submessage
    head = bytes(12) + b"\x08\x00" + b"\x45" + bytes(8) + b"\x11" + bytes(10) + bytes(8)
    return head + packet


def self_test():
    writer = bytes(range(12)) + bytes.fromhex("00000103")
    other = bytes(range(1, 13)) + bytes.fromhex("00000203")

    def count(sent, arrived):
        account = Account()
        account.topics = {writer: ("a", False), other: ("b", False)}
        for frame in sent:
            account.sent(frame)
        for frame in arrived:
            account.arrived(frame)
        return account.told()

    whole = [frame_of(writer, n) for n in range(1, 6)]
    assert count(whole, whole)["a"] == {"sent": 5, "lost": 0, "overtaken": 0, "crowded": 0}
    assert count(whole, whole[:2] + whole[3:])["a"]["lost"] == 1
    assert count(whole, whole[:4])["a"] == {"sent": 4, "lost": 0, "overtaken": 0, "crowded": 0}, "what is newer than all is under way"
    assert count(whole, [whole[i] for i in (0, 2, 1, 3, 4)])["a"] == {"sent": 5, "lost": 1, "overtaken": 1, "crowded": 0}
    assert count(whole, whole + whole)["a"]["lost"] == 0, "doubled"
    pairs = [frame_of(writer, n, first, 2, 4) for n in range(1, 8) for first in (1, 3)]
    assert count(pairs, pairs)["a"] == {"sent": 7, "lost": 0, "overtaken": 0, "crowded": 0}
    assert count(pairs, pairs[:3] + pairs[4:])["a"]["lost"] == 1, "half of a message"
    assert count(pairs, [pairs[1], pairs[0], *pairs[2:]])["a"]["lost"] == 0, "pieces in another order"
    crowd = count(pairs, [*pairs[0:12:2], *pairs[1:12:2], *pairs[12:]])["a"]  # six begun, then the other halves
    assert crowd["crowded"] > 0 and crowd["lost"] == crowd["sent"] - 5, crowd
    both = count(whole + [frame_of(other, 1), frame_of(other, 2)], whole[:1] + whole[2:] + [frame_of(other, 2)])
    assert both["a"]["lost"] == 1 and both["b"]["lost"] == 1
    name = b"takt/pair/one/state\0"
    parameters = struct.pack("<HHI", TOPIC_NAME, 4 + len(name), len(name)) + name + struct.pack("<HH", ENDPOINT_GUID, 16) + writer
    parameters += struct.pack("<HHI", RELIABILITY, 4, 2) + struct.pack("<HH", SENTINEL, 0)
    assert publication(b"\0\3\0\0" + parameters) == (writer, "takt/pair/one/state", True)
    options = argparse.Namespace(seed=7, seconds=10, partition=(2, 3), loss=20, delay=0, jitter=50, reorder=0, held=100, double=10)
    badness = Badness(options)
    fates = [badness.of(1) for _ in range(10000)]
    assert 0.18 < sum(not fate for fate in fates) / 10000 < 0.22 and all(0 <= delay < 150 for fate in fates for delay in fate)
    assert badness.of(3) == [] and badness.of(10) == [0.0] == badness.of(-1)
    assert fates == [again.of(1) for again in [Badness(options)] for _ in range(10000)], "the same seed"
    try:
        udp_payload(whole[0][:20] + b"\x20\0" + whole[0][22:])
        raise SystemExit("a piece of IP passed")
    except ValueError:
        pass
    print("all passed")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("left"), parser.add_argument("right")
    for name in ("loss", "delay", "jitter", "reorder", "double"):
        parser.add_argument("--" + name, type=float, default=0)
    parser.add_argument("--held", type=float, default=100)
    parser.add_argument("--partition", type=lambda text: tuple(float(part) for part in text.split(",")))
    parser.add_argument("--for", type=float, default=20, dest="seconds")
    parser.add_argument("--begin", type=int, default=20)
    parser.add_argument("--talking", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    relay = Relay(parser.parse_args())
    signal.signal(signal.SIGTERM, lambda *_: setattr(relay, "ended", True))
    relay.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
