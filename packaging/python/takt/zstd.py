# SPDX-License-Identifier: Apache-2.0
"""One way to unpack zstd: the module `zstandard`, else libzstd, else the command `zstd`."""
import ctypes
import ctypes.util
import shutil
import subprocess


def _by_library(name):
    library = ctypes.CDLL(name)
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]

    def unpack(data, size):
        out = ctypes.create_string_buffer(max(size, 1))
        # An error is a number near the largest one, so it is no size either.
        if library.ZSTD_decompress(out, size, data, len(data)) != size:
            raise ValueError("the zstd data is damaged")
        return out.raw[:size]

    return unpack


def _by_command(command):
    def unpack(data, size):
        done = subprocess.run([command, "-dc"], input=data, capture_output=True, check=False)
        if done.returncode != 0 or len(done.stdout) != size:
            raise ValueError("the zstd data is damaged")
        return done.stdout

    return unpack


def unpacker():
    """A function of (data, unpacked size) that returns bytes. Raises ImportError if nothing here can unpack zstd."""
    try:
        import zstandard
        def unpack(data, size):
            try:
                return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
            except zstandard.ZstdError as problem:
                raise ValueError("the zstd data is damaged") from problem
        return unpack
    except ImportError:
        pass
    try:
        return _by_library(ctypes.util.find_library("zstd") or "libzstd.so.1")
    except OSError:
        pass
    command = shutil.which("zstd")
    if command:
        return _by_command(command)
    raise ImportError("zstd cannot be unpacked here; install one of: python3-zstandard, libzstd1, zstd")
