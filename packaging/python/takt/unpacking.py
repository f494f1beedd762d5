# SPDX-License-Identifier: Apache-2.0
"""Unpacks the chunks of a record: zstd and lz4, by a Python module, else by the C library, else by the command."""
import ctypes
import ctypes.util
import importlib
import shutil
import subprocess

_MODULES = {"zstd": "zstandard", "lz4": "lz4.frame"}
_LIBRARIES = {"zstd": "libzstd.so.1", "lz4": "liblz4.so.1"}
_PACKAGES = {"zstd": "python3-zstandard, libzstd1, zstd", "lz4": "python3-lz4, liblz4-1, lz4"}
_LZ4_VERSION = 100  # of its frame interface


def _sized(name, data, size):
    if len(data) != size:
        raise ValueError(f"the {name} data is damaged")
    return data


def _by_module(name):
    module = importlib.import_module(_MODULES[name])

    def unpack(data, size):
        try:
            done = (module.ZstdDecompressor().decompress(data, max_output_size=size) if name == "zstd"
                    else module.decompress(data))
        except (RuntimeError, getattr(module, "ZstdError", RuntimeError)) as problem:
            raise ValueError(f"the {name} data is damaged") from problem
        return _sized(name, done, size)

    return unpack


def _by_library(name):
    library = ctypes.CDLL(ctypes.util.find_library(name) or _LIBRARIES[name])
    call = library.ZSTD_decompress if name == "zstd" else library.LZ4F_decompress
    call.restype = ctypes.c_size_t

    def unpack_zstd(data, size):
        call.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
        out = ctypes.create_string_buffer(max(size, 1))
        # An error is a number near the largest one, so it is no size either.
        made = call(out, size, data, len(data))
        if made != size:
            raise ValueError("the zstd data is damaged")
        return out.raw[:size]

    def unpack_lz4(data, size):
        context = ctypes.c_void_p()
        library.LZ4F_createDecompressionContext(ctypes.byref(context), _LZ4_VERSION)
        out = ctypes.create_string_buffer(max(size, 1))
        made = used = 0
        try:
            while True:
                room, rest = ctypes.c_size_t(size - made), ctypes.c_size_t(len(data) - used)
                wanted = call(context, ctypes.byref(out, made), ctypes.byref(room), data[used:], ctypes.byref(rest), None)
                made, used = made + room.value, used + rest.value
                # An error is a number near the largest one: it makes nothing and takes nothing.
                if wanted == 0:
                    return _sized(name, out.raw[:made], size)
                if room.value == 0 and rest.value == 0:
                    raise ValueError("the lz4 data is damaged")
        finally:
            library.LZ4F_freeDecompressionContext(context)

    return unpack_zstd if name == "zstd" else unpack_lz4


def _by_command(name):
    command = shutil.which(name)
    if not command:
        raise OSError(f"there is no command {name}")

    def unpack(data, size):
        done = subprocess.run([command, "-dc"], input=data, capture_output=True, check=False)
        if done.returncode != 0:
            raise ValueError(f"the {name} data is damaged")
        return _sized(name, done.stdout, size)

    return unpack


def unpacker(name):
    """A function of (data, unpacked size) that returns bytes, for `zstd` or `lz4`.

        unpack = unpacker("zstd")
        records = unpack(stored, size)

    Raises ImportError if nothing here can unpack it.
    """
    for way in (_by_module, _by_library, _by_command):
        try:
            return way(name)
        except (ImportError, OSError, AttributeError):
            continue
    raise ImportError(f"{name} cannot be unpacked here; install one of: {_PACKAGES[name]}")
