# SPDX-License-Identifier: Apache-2.0
"""Reads the records of `takt run --record FILE`: MCAP, with the layout of each message type in the file."""
import array
import json
import struct
import zlib

from . import unpacking

try:
    import numpy
except ImportError:
    numpy = None

_MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _ATTACHMENT, _METADATA, _DATA_END = 1, 2, 3, 4, 5, 6, 9, 12, 15
_TAIL = 1 + 8 + 20 + 8  # footer record and magic
_NEWEST_FORMAT = 3
_HEAD = struct.Struct("<QqqqiBQ")
_HASH, _CODED = 0, 2  # what a message has of its fields: none, all with pictures as JPEG; 1: all
_SCALARS = {"u8": ("B", "u1"), "i16": ("h", "<i2"), "u16": ("H", "<u2"), "i32": ("i", "<i4"), "u32": ("I", "<u4"),
            "i64": ("q", "<i8"), "u64": ("Q", "<u8"), "f32": ("f", "<f4"), "f64": ("d", "<f8")}


class RecordError(ValueError):
    """The file is no record, is damaged, or lacks what was asked for."""


class _Reader:
    def __init__(self, data, what):
        self.data, self.at, self.what = memoryview(data), 0, what

    def bytes(self, count):
        if self.at + count > len(self.data):
            raise RecordError(f"{self.what} ends too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, letter):
        return struct.unpack("<" + letter, self.bytes(struct.calcsize("<" + letter)))[0]

    def text(self):
        return bytes(self.bytes(self.number("I"))).decode("utf-8", "replace")

    def map(self):
        inner, found = _Reader(self.bytes(self.number("I")), self.what), {}
        while inner.at < len(inner.data):
            key = inner.text()
            found[key] = inner.text()
        return found


def _pixels(jpeg, name):
    """Pixels of a JPEG as a record has them: grey, or blue, green, red."""
    try:
        import cv2
    except ImportError:
        cv2 = None
    if cv2 is not None and numpy is not None:
        image = cv2.imdecode(numpy.frombuffer(jpeg, dtype="u1"), cv2.IMREAD_UNCHANGED)
        if image is None:
            raise RecordError(f"a JPEG in a message of {name} is damaged")
        return image.tobytes()
    try:
        import io

        from PIL import Image
    except ImportError:
        raise RecordError(f"{name} has its pictures as JPEG: install python3-pil or python3-opencv") from None
    image = Image.open(io.BytesIO(jpeg))
    if image.mode == "L":
        return image.tobytes()
    return Image.merge("RGB", image.convert("RGB").split()[::-1]).tobytes()


def _plain(kept, name):
    """The fields of a message whose pictures are JPEG: bytes as they were and JPEGs, by turns."""
    reader, plain = _Reader(kept, f"a message of {name}"), []
    while reader.at < len(reader.data):
        plain.append(bytes(reader.bytes(reader.number("I"))))
        jpeg = bytes(reader.bytes(reader.number("I")))
        if jpeg:
            plain.append(_pixels(jpeg, name))
    return b"".join(plain)


def _vector(data, scalar, width):
    """Scalars that lie in `data`; rows of `width` if that is more than 1."""
    letter, dtype = _SCALARS[scalar]
    if numpy is not None:
        flat = numpy.frombuffer(data, dtype=dtype)
        return flat.reshape(-1, width) if width > 1 else flat
    flat = array.array(letter, bytes(data))
    return [flat[i:i + width] for i in range(0, len(flat), width)] if width > 1 else flat


def text(values):
    """The text that an array of bytes holds, as in fields of type text: text(port["text"][0])."""
    return bytes(values).decode("utf-8", "replace")


class Port:
    """The messages of one output, in their order.

        scans = record["front_laser.scan"]
        for message in scans:
            print(message["stamp_ns"], message["range_m"])

    `stamps_ns`, `published_ns`, `sequences` and `levels` are arrays with one entry for each message; times are those of
    the monotonic clock, in ns. `units` has the unit of each field. `port["FIELD"]` is one array for a scalar, a list of
    arrays for anything longer. `whole` is False if the record kept only hashes: then fields raise RecordError.
    """

    def __init__(self, name, type_name, layout, whole):
        self.name, self.type, self.whole = name, type_name, whole
        self._fields = layout
        self._heads, self._bodies = [], []
        self._columns = None

    def __len__(self):
        return len(self._heads)

    def __repr__(self):
        return f"<takt.Port {self.name}: {len(self)} messages of type {self.type}>"

    @property
    def fields(self):
        """Names of the fields, in the order of the type."""
        return [field["name"] for field in self._fields]

    @property
    def units(self):
        return {field["name"]: field["unit"] for field in self._fields}

    sequences = property(lambda self: self._head(0, "u64"))
    stamps_ns = property(lambda self: self._head(1, "i64"))
    published_ns = property(lambda self: self._head(2, "i64"))
    visible_at_ns = property(lambda self: self._head(3, "i64"))
    levels = property(lambda self: self._head(4, "i32"))

    def __getitem__(self, field):
        if field not in self.fields:
            raise RecordError(f"{self.name} has no field {field}; its fields: {', '.join(self.fields)}")
        if not self.whole:
            raise RecordError(f"{self.name} is recorded by hash only; record it with: --record-port {self.name}")
        if self._columns is None:
            messages = [self._unpack(body) for body in self._bodies]
            self._columns = {name: [message[name] for message in messages] for name in self.fields}
            for spec in self._fields:
                if spec.get("count") == 1:
                    self._columns[spec["name"]] = self._flat(self._columns[spec["name"]], spec["scalar"])
        return self._columns[field]

    def __iter__(self):
        """Each message as a dict of its header and fields."""
        keys = ("sequence", "stamp_ns", "published_ns", "visible_at_ns", "level")
        for head, body in zip(self._heads, self._bodies):
            yield dict(zip(keys, head)) | (self._unpack(body) if self.whole else {})

    def _head(self, index, scalar):
        return self._flat([head[index] for head in self._heads], scalar)

    @staticmethod
    def _flat(values, scalar):
        letter, dtype = _SCALARS[scalar]
        return numpy.array(values, dtype=dtype) if numpy is not None else array.array(letter, values)

    def _add(self, data):
        if len(data) < _HEAD.size:
            raise RecordError(f"a message of {self.name} ends too early")
        *head, fields, _ = _HEAD.unpack_from(data)
        self.whole = self.whole and fields != _HASH
        self._heads.append(head)
        self._bodies.append((data[_HEAD.size:], fields == _CODED))

    def _unpack(self, kept):
        body = _plain(kept[0], self.name) if kept[1] else kept[0]
        reader, message = _Reader(body, f"a message of {self.name}"), {}
        for field in self._fields:
            scalar, width = field["scalar"], field.get("array_of") or 1
            count = reader.number("I") * width if "array_of" in field else field["count"]
            data = reader.bytes(count * struct.calcsize("<" + _SCALARS[scalar][0]))
            value = _vector(data, scalar, width)
            message[field["name"]] = value[0] if field.get("count") == 1 else value
        if reader.at != len(body):
            raise RecordError(f"a message of {self.name} has {len(body) - reader.at} bytes that its layout does not")
        return message


class Record:
    """A record that was read. `ports`: {"NODE.PORT": Port}; `info`: what was run; `attachments`: {name: bytes}, among
    them graph.yaml and plan.json; `jobs` and `events`: how many are in it; `missing`: why the file is not whole (its
    process was killed), else "". All up to there was read. `left_out`: what is in the file and was not read, a sentence
    each: messages of other encodings, records that MCAP (version 0) does not have."""

    def __init__(self):
        self.ports, self.info, self.attachments = {}, {}, {}
        self.jobs = self.events = 0
        self.left_out = []
        self.missing = "the file has no end"
        self._schemas, self._channels, self._unpack = {}, {}, {}
        self._foreign, self._unknown = {}, {}

    def __getitem__(self, port):
        if port not in self.ports:
            raise RecordError(f"the record has no port {port}; its ports: {', '.join(sorted(self.ports))}")
        return self.ports[port]

    def _take(self, op, fields):
        if op == _SCHEMA:
            number, name, encoding = fields.number("H"), fields.text(), fields.text()
            self._schemas[number] = (name, encoding, fields.text())
        elif op == _CHANNEL:
            number, schema, topic, encoding = fields.number("H"), fields.number("H"), fields.text(), fields.text()
            self._open_channel(number, schema, topic, encoding, fields.map())
        elif op == _MESSAGE:
            channel = fields.number("H")
            fields.bytes(20)
            self._message(channel, fields.data[fields.at:])
        elif op == _CHUNK:
            self._chunk(fields)
        elif op == _ATTACHMENT:
            fields.bytes(16)
            name, _ = fields.text(), fields.text()
            self.attachments[name] = bytes(fields.bytes(fields.number("Q")))
        elif op == _METADATA:
            name = fields.text()
            found = fields.map()
            if name not in ("takt", "takt end"):
                return  # another program's
            if name == "takt" and int(found.get("format", "1")) > _NEWEST_FORMAT:
                raise RecordError(f"the record has format {found['format']}, and this reader knows up to "
                                  f"{_NEWEST_FORMAT}; use the takt of commit {found.get('commit', '?')}")
            self.info.update(found)
        elif op < _HEADER or op > _DATA_END:
            self._unknown[op] = self._unknown.get(op, 0) + 1

    def _open_channel(self, number, schema, topic, encoding, metadata):
        if number in self._channels:
            return
        name, _, data = self._schemas.get(schema, ("", "", ""))
        if name in ("takt.Job", "takt.Event"):
            self._channels[number] = name
            return
        if encoding != "takt":
            self._channels[number] = (topic, encoding)
            return
        if topic in self.ports:  # as a file has it that was merged of two
            self._channels[number] = self.ports[topic]
            return
        whole = metadata.get("fields") != "hash"
        self._channels[number] = self.ports[topic] = Port(topic, name.removeprefix("takt."),
                                                          json.loads(data)["fields"], whole)

    def _message(self, channel, data):
        to = self._channels.get(channel)
        if isinstance(to, Port):
            to._add(data)
        elif to == "takt.Job":
            self.jobs += 1
        elif to == "takt.Event":
            self.events += 1
        elif isinstance(to, tuple):
            self._foreign[to] = self._foreign.get(to, 0) + 1
        else:
            raise RecordError(f"a message is of channel {channel}, which the file does not have")

    def _chunk(self, fields):
        fields.bytes(16)
        size, crc, compression = fields.number("Q"), fields.number("I"), fields.text()
        stored = fields.bytes(fields.number("Q"))
        if compression not in ("", "lz4", "zstd"):
            raise RecordError(f"a chunk is compressed by {compression}; known: lz4, zstd, none")
        if compression:
            if compression not in self._unpack:
                self._unpack[compression] = unpacking.unpacker(compression)
            stored = self._unpack[compression](bytes(stored), size)
        if crc and zlib.crc32(stored) != crc:
            raise ValueError("a chunk is damaged: its CRC does not fit")
        self._records(_Reader(stored, "a chunk"))

    def _records(self, reader):
        while reader.at < len(reader.data):
            op = reader.number("B")
            self._take(op, _Reader(reader.bytes(reader.number("Q")), "a record"))
            if op == _DATA_END:
                self.missing = ""
                return

    def _summary(self, data):
        """Schemas and channels that stand at the end: a writer may put those without messages only there."""
        foot = _Reader(data[-_TAIL:], "the file")
        if not data.endswith(_MAGIC) or len(data) < _TAIL or foot.number("B") != _FOOTER or foot.number("Q") != 20:
            return
        start = foot.number("Q")
        reader = _Reader(data[start:-_TAIL] if start else b"", "the summary")
        while reader.at < len(reader.data):
            op = reader.number("B")
            fields = _Reader(reader.bytes(reader.number("Q")), "a record of the summary")
            if op in (_SCHEMA, _CHANNEL):
                self._take(op, fields)

    def _check(self, path):
        if self._foreign and not self.info:
            topic, encoding = next(iter(self._foreign))
            raise RecordError(f"{path}: {topic} has encoding {encoding}, not takt: this is an export; read the record "
                              "itself")
        if not self._schemas and not self.info:
            raise RecordError(f"{path} holds nothing of Takt")
        self.left_out = [f"{count} messages of {topic}, whose encoding is {encoding}, not takt"
                         for (topic, encoding), count in self._foreign.items()]
        self.left_out += [f"{count} records of kind {op}, which the format (version 0) does not have"
                          for op, count in self._unknown.items()]


def read_record(path):
    """Reads a record into memory.

        record = takt.read_record("run.mcap")
        for name, port in record.ports.items():
            print(name, port.type, len(port))

    Raises RecordError if the file is no record of Takt or has a newer format, ImportError if a chunk cannot be unpacked here. A file of
    a killed run is read up to its end or its first damaged chunk; `Record.missing` says so.
    """
    with open(path, "rb") as file:
        data = file.read()
    if not data.startswith(_MAGIC):
        raise RecordError(f"{path} is no MCAP file; takt run --record FILE writes one")
    record, reader = Record(), _Reader(data, "the file")
    reader.at = len(_MAGIC)
    try:
        record._summary(data)
    except RecordError:
        pass  # what it repeats is in the data section
    try:
        while record.missing and reader.at < len(data):
            start = reader.at
            op, size = reader.number("B"), reader.number("Q")
            if reader.at + size > len(data):
                record.missing = f"the file is cut off at byte {start}"
                break
            try:
                record._records(_Reader(data[start:reader.at + size], "a record"))
            except RecordError as problem:
                raise RecordError(f"{path}: {problem}") from None
            except ValueError as problem:
                record.missing = f"{problem}, at byte {start}"
                break
            reader.at += size
    except RecordError as problem:
        if str(problem) != "the file ends too early":
            raise
        record.missing = "the file is cut off"
    record._check(path)
    return record
