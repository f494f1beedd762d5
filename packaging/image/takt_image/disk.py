# SPDX-License-Identifier: Apache-2.0
"""A disk that boots by BIOS and by UEFI, put together in a file: no root, no loop device, no mount.

    1  ESP         GRUB, its variables, the kernel's words of this machine
    2  system-a    a slot: kernel, initrd and root in one compressed file system
    3  system-b    the other slot, empty
    4  BIOS boot   GRUB's core
    5  takt-data   /var, made and grown at the first boot"""
import os
import pathlib
import struct
import tempfile
import uuid

from . import tools

MIB = 1 << 20
SECTOR = 512
GRUB = pathlib.Path("/usr/lib/grub")
HERE = pathlib.Path(__file__).resolve().parents[1]
TYPES = {"bios": "21686148-6449-6E6F-744E-656564454649", "ESP": "C12A7328-F81F-11D2-BA4B-00A0C93EC93B", "system": "4F68BCE3-E8CD-4DB1-96E7-FBCAF984B709",
         "data": "0FC63DAF-8483-4772-8E79-3D69D8477DE4"}
MODULES = "part_gpt fat squash4 gzio normal configfile search search_label linux echo test regexp loadenv serial terminal all_video sleep reboot".split()
PREFIXES = {"x86_64-efi": ("BOOTX64.EFI", []), "i386-pc": ("core.img", ["biosdisk"])}
ESP_MIB, SLOT_STEP_MIB, DATA_MIB = 62, 64, 64


class Layout:
    """Where each part is, in MiB: (name, start, size)."""

    def __init__(self, slot_mib):
        self.bios, self.esp = 1, 2
        self.slots = (self.esp + ESP_MIB, self.esp + ESP_MIB + slot_mib)
        self.slot_mib = slot_mib
        self.data = self.slots[1] + slot_mib
        self.end = self.data + DATA_MIB + 1  # GPT keeps its copy at the end


def slot_mib(system):
    """Room for this system and for one that is a third larger."""
    need = system.stat().st_size * 4 // 3
    return -(-need // (SLOT_STEP_MIB * MIB)) * SLOT_STEP_MIB


def identifier(seed, name):
    return str(uuid.uuid5(uuid.UUID("7c1d8c5e-6e0e-4f2f-9d3c-2f4b8a1c5d90"), f"{seed}/{name}"))


def partition(disk, layout, seed):
    # Numbered in this order: grub.cfg has the slots as gpt2 and gpt3.
    rows = (("ESP", layout.esp, ESP_MIB, "ESP"), ("system-a", layout.slots[0], layout.slot_mib, "system"),
            ("system-b", layout.slots[1], layout.slot_mib, "system"), ("bios", layout.bios, 1, "bios"), ("takt-data", layout.data, DATA_MIB, "data"))
    lines = [f"start={start * MIB // SECTOR}, size={size * MIB // SECTOR}, type={TYPES[kind]}, uuid={identifier(seed, name)}, name=\"{name}\""
             for name, start, size, kind in rows]
    script = f"label: gpt\nlabel-id: {identifier(seed, 'disk')}\n" + "\n".join(lines) + "\n"
    tools.run("sfdisk", "--quiet", disk, stdin=script.encode())


def put(disk, at, content):
    with open(disk, "r+b") as file:
        file.seek(at)
        file.write(content)


def make_grub(folder, platform):
    name, more = PREFIXES[platform]
    tools.run("grub-mkimage", "--format", platform, "--config", HERE / "grub/core.cfg", "--prefix", "/grub", "--output", folder / name, *MODULES, *more)
    return folder / name


def bios_code(core, lba):
    """boot.img for sector 0 and core.img, each told where core.img lies. GRUB's own grub-install writes the same words:
    the sector of core.img at 0x5c of boot.img, 0x66 its check for floppies, the rest of core.img at 0x1f4."""
    boot = bytearray((GRUB / "i386-pc/boot.img").read_bytes()[:440])
    boot[0x5c:0x64] = struct.pack("<Q", lba)
    boot[0x64] = 0xff
    boot[0x66:0x68] = b"\x90\x90"
    core = bytearray(core)
    core += b"\0" * (-len(core) % SECTOR)
    core[0x1f4:0x200] = struct.pack("<QHH", lba + 1, len(core) // SECTOR - 1, 0x820)
    if len(core) > MIB:
        raise tools.Failure(f"GRUB's core has {len(core)} bytes, more than its partition")
    return bytes(boot), bytes(core)


def make_esp(folder, kernel_arguments):
    """The file system of the ESP."""
    esp = folder / "esp.img"
    with open(esp, "wb") as file:
        file.truncate(ESP_MIB * MIB)
    tools.run("mkfs.vfat", "-n", "ESP", "-i", "54414B54", "--invariant", esp)
    efi = make_grub(folder, "x86_64-efi")
    (folder / "machine.cfg").write_text(f"set machine_arguments=\"{' '.join(kernel_arguments)}\"\n")
    tools.run("grub-editenv", folder / "grubenv", "create")
    tools.run("grub-editenv", folder / "grubenv", "set", "ORDER=A B", "A_OK=1", "A_TRY=0", "B_OK=0", "B_TRY=0")
    fixed = {**os.environ, "SOURCE_DATE_EPOCH": "315532800"}  # the first time that FAT has
    tools.run("mmd", "-i", esp, "::EFI", "::EFI/BOOT", "::grub", env=fixed)
    for source, place in ((efi, "EFI/BOOT/BOOTX64.EFI"), (HERE / "grub/grub.cfg", "grub/grub.cfg"), (folder / "machine.cfg", "grub/machine.cfg"),
                          (folder / "grubenv", "grub/grubenv"), (folder / "grubenv", "grub/grubenv.copy")):
        tools.run("mcopy", "-i", esp, source, f"::{place}", env=fixed)
    return esp


def build(system, kernel_arguments, disk, seed, slot=None):
    """Writes the file `disk` with `system` in slot A. `slot`: its size in MiB."""
    tools.need("sfdisk", "mkfs.vfat", "mcopy", "grub-mkimage", "grub-editenv",
               files=((GRUB / "i386-pc/boot.img", "grub-pc-bin"), (GRUB / "x86_64-efi/modinfo.sh", "grub-efi-amd64-bin")))
    slot = slot or slot_mib(system)
    if system.stat().st_size > slot * MIB:
        raise tools.Failure(f"the system has {tools.megabytes(system):.0f} MB, more than a slot of {slot} MiB; use --slot", tools.BAD_INPUT)
    layout = Layout(slot)
    with tools.step("disk"), tempfile.TemporaryDirectory(dir=disk.parent, prefix="disk-") as name:
        folder = pathlib.Path(name)
        part = folder / "disk.img"
        with open(part, "wb") as file:
            file.truncate(layout.end * MIB)
        partition(part, layout, seed)
        lba = layout.bios * MIB // SECTOR
        boot, core = bios_code(make_grub(folder, "i386-pc").read_bytes(), lba)
        put(part, 0, boot)
        put(part, lba * SECTOR, core)
        put(part, layout.esp * MIB, make_esp(folder, kernel_arguments).read_bytes())
        with open(part, "r+b") as file, open(system, "rb") as content:
            file.seek(layout.slots[0] * MIB)
            while block := content.read(MIB):
                file.write(block)
        part.rename(disk)
