#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""foreign_files.py FOLDER: small files as other programs write them, for tests/integration/foreign_files.sh."""
import pathlib
import struct
import sys
import zlib

folder = pathlib.Path(sys.argv[1])


def write(name, data):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


def ply(columns, rows, form="ascii", count=2):
    head = "".join(f"property {column}\n" for column in columns)
    return f"ply\nformat {form} 1.0\nelement vertex {count}\n{head}end_header\n".encode() + rows


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(width, height, values, bits=16):
    letter = "H" if bits == 16 else "B"
    rows = b"".join(b"\0" + struct.pack(f">{width}{letter}", *values[y * width:(y + 1) * width]) for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def clouds():
    xyz, plain = ["float x", "float y", "float z"], b"0 0 1\n0.1 0 1\n"
    write("big_endian.ply", ply(xyz, struct.pack(">6f", 0, 0, 1, 0.1, 0, 1), "binary_big_endian"))
    write("stream.ply", ply(xyz, b"0 0 1 0.1\n0 1"))
    write("bom.ply", b"\xef\xbb\xbf" + ply(xyz, plain))
    write("blank.ply", ply(xyz, plain).replace(b"ply\n", b"ply \n"))
    write("denormal.ply", ply(xyz, b"1e-46 0 1\n0.1 0 1\n"))
    write("diffuse.ply", ply(xyz + [f"uchar diffuse_{c}" for c in ("red", "green", "blue")], b"0 0 1 255.0 2 3\n0.1 0 1 1 2 3\n"))
    write("floats.ply", ply(xyz + [f"float {c}" for c in ("red", "green", "blue")], b"0 0 1 0.5 0.2 1\n0.1 0 1 1 0 0\n"))
    write("columns.ply", ply(xyz + ["float nx"], b"0 0 1 9\n0.1 0 1 9\n"))
    write("utm.ply", ply([f"double {c}" for c in "xyz"],
                         struct.pack("<6d", 512345.123, 5312345.678, 1.5, 512345.133, 5312345.678, 1.5), "binary_little_endian"))
    packed = b"".join(b"\x03" + struct.pack("<f", value) + b"\x40\x03" for value in (1, 2, 3))
    head = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary_compressed\n"
    write("compressed.pcd", head + struct.pack("<II", len(packed), 24) + packed)
    write("cut.pcd", head + struct.pack("<II", len(packed), 20) + packed)


def images():
    width, height = 64, 48
    ramp = [(x * 7 + y * 13) * 1020 // 1060 % 1021 for y in range(height) for x in range(width)]
    grey = png(width, height, [value // 4 for value in ramp], 8)
    calibration = "P0: 100 0 32 0 0 100 24 0 0 0 1 0\nP1: 100 0 32 -10 0 100 24 0 0 0 1 0\n"
    for side in ("image_l", "image_r"):
        for frame in (1, 2, 10):
            write(f"ten_bits/{side}/{frame}.pgm", f"P5\n{width} {height}\n1023\n".encode() + struct.pack(f">{len(ramp)}H", *ramp))
    write("ten_bits/image_l/notes.txt", "a note")
    write("ten_bits/calib.txt", calibration)
    write("sixteen.png", png(width, height, ramp))
    write("huge.pgm", b"P5\n60000 60000\n65535\n\0\0")
    for side in ("image_0", "image_1"):
        write(f"kitti/{side}/000000.png", grey)
        write(f"kitti/{side}/000001.png", grey)
    write("kitti/calib.txt", calibration)
    write("kitti/times.txt", "0.0\n0.2\n")
    write("kitti/velodyne/000000.bin", b"")
    for camera, x in (("cam0", 0.0), ("cam1", 0.12)):
        for stamp in (1403636579763555584, 1403636579963555584):
            write(f"euroc/mav0/{camera}/data/{stamp}.png", grey)
        write(f"euroc/mav0/{camera}/sensor.yaml",
              f"sensor_type: camera\nT_BS: {{cols: 4, rows: 4, data: [1, 0, 0, {x}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}\n"
              f"resolution: [{width}, {height}]\ncamera_model: pinhole\nintrinsics: [100, 100, 32, 24]\n"
              "distortion_model: radial-tangential\ndistortion_coefficients: [0.01, 0, 0, 0]\n")
    write("euroc/mav0/imu0/data.csv", "")


def calibrations():
    def matrix(key, rows, columns, data):
        return f"{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"

    def opencv(shift):
        camera = "100., 0., 32., 0., 100., 24., 0., 0., 1."
        return ("%YAML:1.0\n---\nimage_size: [ 64, 48 ]\n" + matrix("M1", 3, 3, camera) + matrix("D1", 1, 14, ", ".join(["0."] * 14))
                + matrix("M2", 3, 3, camera) + matrix("D2", 1, 14, ", ".join(["0."] * 14))
                + matrix("R", 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.") + matrix("T", 3, 1, f"{shift}, 0., 0."))

    write("rational.cal", opencv("-0.12"))
    write("millimetres.cal", opencv("-120."))
    write("cut.cal", opencv("-0.12")[:150])
    pinhole = ("  camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [0.01, 0, 0, 0]\n"
               "  intrinsics: [100, 100, 32, 24]\n  resolution: [64, 48]\n")
    write("kalibr.cal", f"cam0:\n{pinhole}cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, -0.12]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n"
                        f"  - [0, 0, 0, 1]\n{pinhole}")


def logs():
    def odometry(t):
        return f"ODOM {t} 0 0 0 0 0 {t} host {t}\n"

    def ranges(count=181, first="2"):
        return " ".join([str(count), first] + ["2.5"] * (count - 1))

    def scan(t, first="2"):
        return f"FLASER {ranges(first=first)} {t} 0 0 {t} 0 0 {t} host {t}\n"

    def robot(t):
        return (f"ROBOTLASER1 0 -1.570796 3.141593 0.0174533 30 0.01 0 {ranges()} 0 {t + 0.1} 0 0 {t} 0 0 0 0 1 1 1e6 "
                f"{t} host {t}\n")

    times = [0.2, 0.4, 0.6]
    drive = "".join(odometry(t) + scan(t) for t in times)
    write("cut.log", drive + scan(0.8)[:200])
    write("inf.log", drive + scan(0.8, "inf") + scan(1.0, "nan"))
    write("robotlaser.log", "".join(robot(t) for t in times + [0.8]))
    write("late.log", "".join(odometry(1000 + t) + scan(1000 + t) for t in times))
    write("other.log", "SYNC a 0 host 0\n" * 3 + drive)


for make in (clouds, images, calibrations, logs):
    make()
