#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A slow file system, for tests: slow_disk.py FOLDER MOUNTPOINT [KB_S] [LATENCY_S].

Shows FOLDER at MOUNTPOINT; each write takes LATENCY_S (0.05) and its bytes at KB_S (1000) on top, one at a time. Runs in the
foreground until it is unmounted. Needs python3-fusepy.
"""
import os
import pathlib
import sys
import time

import fusepy


class SlowDisk(fusepy.Operations):
    def __init__(self, folder, kb_s, latency_s):
        self.folder, self.kb_s, self.latency_s = folder, kb_s, latency_s
        self.access = self.getxattr = self.listxattr = None  # as the kernel has it

    def at(self, path):
        return self.folder + path

    def getattr(self, path, fh=None):
        found = os.lstat(self.at(path))
        return {key: getattr(found, key) for key in ("st_mode", "st_nlink", "st_uid", "st_gid", "st_size", "st_blocks",
                                                     "st_atime", "st_mtime", "st_ctime")}

    def statfs(self, path):
        found = os.statvfs(self.at(path))
        return {key: getattr(found, key) for key in ("f_bsize", "f_frsize", "f_blocks", "f_bfree", "f_bavail", "f_files", "f_ffree",
                                                     "f_namemax")}

    def readdir(self, path, fh):
        return [".", ".."] + os.listdir(self.at(path))

    def mkdir(self, path, mode):
        return os.mkdir(self.at(path), mode)

    def rmdir(self, path):
        return os.rmdir(self.at(path))

    def unlink(self, path):
        return os.unlink(self.at(path))

    def rename(self, old, new):
        return os.rename(self.at(old), self.at(new))

    def truncate(self, path, length, fh=None):
        return os.truncate(self.at(path), length)

    def open(self, path, flags):
        return os.open(self.at(path), flags)

    def create(self, path, mode, fi=None):
        return os.open(self.at(path), os.O_RDWR | os.O_CREAT | os.O_EXCL, mode)

    def release(self, path, fh):
        return os.close(fh)

    def read(self, path, size, offset, fh):
        return os.pread(fh, size, offset)

    def write(self, path, data, offset, fh):
        time.sleep(self.latency_s + len(data) / (self.kb_s * 1e3))
        return os.pwrite(fh, data, offset)

    def fsync(self, path, datasync, fh):
        return os.fsync(fh)


if __name__ == "__main__":
    words = dict(enumerate(sys.argv))
    disk = SlowDisk(str(pathlib.Path(words[1]).resolve()), float(words.get(3, 1000)), float(words.get(4, 0.05)))
    fusepy.FUSE(disk, words[2], foreground=True, nothreads=True, big_writes=True)
