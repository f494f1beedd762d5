# SPDX-License-Identifier: Apache-2.0
"""Reading records: those of earlier formats, cut off and damaged ones, with each way to unpack zstd."""
import pathlib
import shutil
import struct
import tempfile
import unittest
from unittest import mock

import takt
from takt import unpacking

RECORDS = pathlib.Path(__file__).parents[1] / "samples"


class RecordTest(unittest.TestCase):
    def written(self, data):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name) / "run.mcap"
        path.write_bytes(data)
        return path

    def test_fields_and_stamps_by_port(self):
        record = takt.read_record(RECORDS / "format_1.mcap")
        self.assertEqual(record.missing, "")
        self.assertEqual(record.jobs, 45)
        self.assertEqual(sorted(record.ports), ["base.odometry", "front_laser.scan", "obstacle_stop.stop"])
        self.assertIn(b"obstacle_stop", record.attachments["graph.yaml"])
        odometry = record["base.odometry"]
        self.assertEqual((odometry.type, odometry.units["x_m"], len(odometry)), ("odometry", "m", 15))
        self.assertEqual(list(odometry.stamps_ns[:2]), [1000000000, 1066666666])
        self.assertEqual(list(odometry.sequences), list(range(1, 16)))
        messages = list(odometry)
        self.assertEqual(messages[3]["stamp_ns"], odometry.stamps_ns[3])
        self.assertEqual([message["x_m"] for message in messages], list(odometry["x_m"]))

    def test_arrays(self):
        scan = takt.read_record(RECORDS / "format_1.mcap")["front_laser.scan"]
        ranges = scan["range_m"]
        self.assertEqual(len(ranges), 15)
        self.assertEqual(len(ranges[0]), 181)
        self.assertAlmostEqual(ranges[0][0], 2.045624, places=5)

    def test_without_numpy_the_same(self):
        with_it = takt.read_record(RECORDS / "format_1.mcap")["base.odometry"]
        with mock.patch("takt.record.numpy", None):
            without = takt.read_record(RECORDS / "format_1.mcap")["base.odometry"]
            self.assertEqual(list(without["x_m"]), list(with_it["x_m"]))

    def test_unknown_names_have_the_valid_choices(self):
        record = takt.read_record(RECORDS / "format_1.mcap")
        with self.assertRaisesRegex(takt.RecordError, "base.odometry, front_laser.scan"):
            record["rear_laser.scan"]
        with self.assertRaisesRegex(takt.RecordError, "its fields: x_m, y_m"):
            record["base.odometry"]["z_m"]

    def test_a_killed_run_is_read_to_its_end(self):
        record = takt.read_record(RECORDS / "format_1_killed.mcap")
        self.assertEqual(record.missing, "the file has no end")
        self.assertEqual(len(record["front_laser.scan"]), 32)

    def test_a_file_cut_anywhere_says_so(self):
        data = (RECORDS / "format_1.mcap").read_bytes()
        for at in range(len(data) // 5, len(data), len(data) // 9):
            record = takt.read_record(self.written(data[:at]))
            messages = sum(map(len, record.ports.values()))
            self.assertTrue("cut off" in record.missing or messages == 45, f"cut at {at}: {messages} messages")
        self.assertIn("cut off", takt.read_record(self.written(data[:len(data) // 5])).missing)

    def test_a_damaged_chunk_says_so(self):
        data = bytearray((RECORDS / "format_1.mcap").read_bytes())
        data[data.index(b"zstd") + 500] ^= 0x10
        record = takt.read_record(self.written(data))
        self.assertIn("damaged", record.missing)

    def test_every_format_so_far(self):
        for path in RECORDS.glob("format_*.mcap"):
            record = takt.read_record(path)
            self.assertEqual(record.info.get("format", "1"), path.stem.split("_")[1])
            self.assertGreater(len(record["eyes.pair" if path.stem == "format_3" else "obstacle_stop.stop"]), 0)

    def test_pictures_as_jpeg(self):
        port = takt.read_record(RECORDS / "format_3.mcap")["eyes.pair"]
        try:
            message = next(iter(port))
        except takt.RecordError as problem:
            self.assertIn("install python3-pil or python3-opencv", str(problem))
            return
        self.assertEqual((message["width"], message["height"], message["channels"]), (70, 50, 1))
        self.assertEqual(len(message["left"]), 70 * 50)
        self.assertGreater(max(message["left"]) - min(message["left"]), 50)
        self.assertEqual(bytes(message["left"]), bytes(message["right"]))

    def test_what_is_not_read_is_counted(self):
        data = (RECORDS / "format_2.mcap").read_bytes()
        header_end = 8 + 9 + struct.unpack_from("<Q", data, 9)[0]
        text = lambda words: struct.pack("<I", len(words)) + words
        record = lambda op, fields: bytes([op]) + struct.pack("<Q", len(fields)) + fields
        foreign = (record(0x90, b"private") + record(4, struct.pack("<HH", 900, 0) + text(b"/scan") + text(b"cdr") + text(b""))
                   + record(5, struct.pack("<HIQQ", 900, 1, 2, 3) + b"data") + record(12, text(b"other") + text(b"")))
        read = takt.read_record(self.written(data[:header_end] + foreign + data[header_end:]))
        self.assertEqual(read.missing, "")
        self.assertEqual(read.left_out, ["1 messages of /scan, whose encoding is cdr, not takt",
                                         "1 records of kind 144, which the format (version 0) does not have"])
        plain = takt.read_record(RECORDS / "format_2.mcap")
        self.assertEqual(plain.left_out, [])
        self.assertEqual(list(read["base.odometry"].stamps_ns), list(plain["base.odometry"].stamps_ns))

    def test_lz4(self):
        try:
            unpack = unpacking.unpacker("lz4")
        except ImportError as problem:
            self.skipTest(str(problem))
        content = b"a stored block"
        frame = struct.pack("<IBBBI", 0x184D2204, 0x60, 0x40, 0x82, len(content) | 1 << 31) + content + bytes(4)
        self.assertEqual(bytes(unpack(frame, len(content))), content)
        for damaged, size in ((frame[:-6], len(content)), (frame, len(content) + 1), (b"none of it", 4)):
            with self.assertRaisesRegex(ValueError, "lz4 data is damaged"):
                unpack(damaged, size)

    def test_no_record(self):
        with self.assertRaisesRegex(takt.RecordError, "no MCAP file"):
            takt.read_record(RECORDS / "graph.yaml")

    def test_each_way_to_unpack(self):
        stored = pathlib.Path(RECORDS / "format_1.mcap").read_bytes()
        expected = len(takt.read_record(RECORDS / "format_1.mcap")["base.odometry"])
        self.assertIn(b"zstd", stored)
        ways = [unpacking._by_library]
        if shutil.which("zstd"):
            ways.append(unpacking._by_command)
        for way in ways:
            with mock.patch("takt.unpacking.unpacker", way):
                self.assertEqual(len(takt.read_record(RECORDS / "format_1.mcap")["base.odometry"]), expected)

    def test_without_any_zstd_it_says_what_to_install(self):
        with mock.patch("takt.unpacking._by_library", side_effect=OSError), mock.patch("shutil.which", return_value=None), \
                mock.patch.dict("sys.modules", zstandard=None):
            with self.assertRaisesRegex(ImportError, "python3-zstandard, libzstd1, zstd"):
                takt.read_record(RECORDS / "format_1.mcap")


if __name__ == "__main__":
    unittest.main()
