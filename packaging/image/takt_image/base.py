# SPDX-License-Identifier: Apache-2.0
"""The Debian below Takt: kernel, systemd, RAUC, and what the packages of Takt depend on. It is the same for many images, so it is kept."""
import hashlib
import json
import os
import pathlib
import re
import tempfile

from . import tools

SUITE = "bookworm"
KERNEL = {"amd64": "linux-image-rt-amd64", "arm64": "linux-image-rt-arm64"}
PACKAGES = ("ca-certificates", "dbus", "dosfstools", "e2fsprogs", "fdisk", "grub-common", "initramfs-tools", "iproute2", "kmod", "procps", "rauc", "rauc-service",
            "systemd", "systemd-resolved", "systemd-sysv", "systemd-timesyncd", "tzdata", "udev", "zstd")
MODULES = "lib/modules/*/kernel/"
# What no robot's graph loads: documents, and drivers and libraries for screens, wireless networks and large servers. Paths as dpkg has them.
LEFT_OUT = [f"/usr/share/{name}/*" for name in ("doc", "info", "lintian", "locale", "man", "bash-completion", "icons", "mime", "X11")] + [
    "/usr/lib/*/libLLVM*", "/usr/lib/*/dri/*", "/usr/lib/*/libgallium*", "/usr/lib/*/gallium-pipe/*",
] + [f"/{MODULES}{name}/*" for name in (
    "drivers/gpu", "drivers/infiniband", "drivers/isdn", "drivers/net/wireless", "drivers/net/ethernet/mellanox", "drivers/net/ethernet/chelsio",
    "drivers/net/ethernet/qlogic", "drivers/net/ethernet/broadcom/bnx2x", "drivers/media/dvb-core", "drivers/media/dvb-frontends", "drivers/media/tuners",
    "drivers/media/usb/dvb-usb", "drivers/media/usb/dvb-usb-v2", "drivers/media/pci", "drivers/media/rc", "drivers/staging", "drivers/iio", "drivers/comedi",
    "drivers/mtd", "drivers/target", "drivers/scsi/qla2xxx", "drivers/scsi/lpfc", "drivers/scsi/bfa", "drivers/scsi/be2iscsi", "drivers/bluetooth", "drivers/nfc",
    "drivers/video", "drivers/accel", "fs/ocfs2", "fs/gfs2", "fs/ceph", "fs/xfs", "fs/btrfs", "fs/nfs", "fs/nfsd", "fs/smb", "fs/cifs", "fs/ubifs", "fs/reiserfs", "fs/jfs", "fs/f2fs",
    "sound", "net/bluetooth", "net/mac80211", "net/wireless", "net/sctp", "net/tipc", "net/ceph", "net/openvswitch")]
KEPT = "/usr/share/doc/*/copyright"  # of what is left out: whoever hands an image on owes them
INITRAMFS = pathlib.Path(__file__).resolve().parents[1] / "initramfs"


def dependencies(debs):
    """Names of packages that the given .deb files depend on, but for each other. Of alternatives the first."""
    own, wanted = set(), set()
    for deb in debs:
        own.add(tools.run("dpkg-deb", "--field", deb, "Package").strip())
        for field in ("Depends", "Pre-Depends"):
            for part in tools.run("dpkg-deb", "--field", deb, field).split(","):
                if name := re.match(r"\s*([a-z0-9][a-z0-9.+-]+)", part):
                    wanted.add(name[1])
    return sorted(wanted - own)


def sources(mirror):
    """For apt: of a mirror, else those of this machine if it is a Debian of the same release, else Debian's own."""
    if mirror:
        return "".join(f"deb {mirror.rstrip('/')}{folder} {suite} main\n" for folder, suite in (
            ("", SUITE), ("", f"{SUITE}-updates"), ("-security", f"{SUITE}-security")))
    release = pathlib.Path("/etc/os-release").read_text()
    folder = pathlib.Path("/etc/apt")
    found = sorted([*folder.glob("sources.list"), *folder.glob("sources.list.d/*.list"), *folder.glob("sources.list.d/*.sources")])
    text = {file: file.read_text() for file in found}
    if f"VERSION_CODENAME={SUITE}" in release:
        for file in found:  # of one form only: mmdebstrap takes one
            if f"{SUITE}-security" in text[file]:
                return text[file]
    return sources("http://deb.debian.org/debian")


def key(packages, arch, source_text):
    initramfs = [(str(file.relative_to(INITRAMFS)), file.read_text()) for file in sorted(INITRAMFS.rglob("*")) if file.is_file()]
    content = json.dumps([SUITE, arch, sorted(packages), LEFT_OUT, KEPT, initramfs, source_text])
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def build(debs, more, arch, mirror, fresh=False):
    """The tar of the base for these packages, made if it is not kept yet."""
    tools.need("mmdebstrap", "zstd")
    text = sources(mirror)
    packages = sorted({KERNEL[arch], *PACKAGES, *dependencies(debs), *more})
    tar = tools.cache_folder() / f"base-{arch}-{key(packages, arch, text)}.tar.zst"
    if tar.exists() and not fresh:
        tools.say(f"base: kept from an earlier build, {tools.megabytes(tar):.0f} MB")
        return tar
    with tools.step(f"base: {len(packages)} packages and what they need"), tempfile.TemporaryDirectory(dir=tar.parent, prefix="base-") as work:
        apt = pathlib.Path(work) / "sources"
        apt.write_text(text)
        part = pathlib.Path(work) / "base.tar.zst"
        tools.run(
            "mmdebstrap", "--mode=auto", "--variant=essential", f"--architectures={arch}", "--aptopt=Apt::Install-Recommends \"false\"",
            f"--include={','.join(packages)}", *[f"--dpkgopt=path-exclude={path}" for path in LEFT_OUT], f"--dpkgopt=path-include={KEPT}",
            "--essential-hook=mkdir -p \"$1/etc/initramfs-tools\"", f"--essential-hook=sync-in {INITRAMFS} /etc/initramfs-tools",
            "--customize-hook=rm -rf \"$1\"/var/cache/apt/* \"$1\"/var/lib/apt/lists/* \"$1\"/etc/apt/sources.list* \"$1\"/boot/System.map*",
            SUITE, part, apt, env={**os.environ, "TMPDIR": work, "SOURCE_DATE_EPOCH": os.environ.get("SOURCE_DATE_EPOCH", "0")})
        part.rename(tar)
    tools.say(f"base: {tools.megabytes(tar):.0f} MB")
    return tar
