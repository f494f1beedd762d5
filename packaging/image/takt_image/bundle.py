# SPDX-License-Identifier: Apache-2.0
"""Updates: a system signed by its owner, which RAUC installs into the slot that does not run."""
import pathlib
import tempfile

from . import tools

MANIFEST = """[update]
compatible={compatible}
version={version}

[bundle]
format=verity

[image.rootfs]
filename=system.img
"""


def make_keys(folder):
    """A key and its certificate, for whoever has none. Only the certificate goes into images."""
    tools.need("openssl")
    folder.mkdir(parents=True, exist_ok=True)
    key, certificate = folder / "update.key", folder / "update.pem"
    for file in (key, certificate):
        if file.exists():
            raise tools.Failure(f"{file} is there already: who has an image with it can only update it with its key", tools.BAD_INPUT)
    tools.run("openssl", "req", "-x509", "-newkey", "rsa:3072", "-nodes", "-days", "7300", "-subj", "/O=Takt/CN=updates", "-keyout", key, "-out", certificate)
    key.chmod(0o600)
    return key, certificate


def build(system, release, key, certificate, result):
    """The file `result`, which `rauc install` takes."""
    tools.need("rauc", "mksquashfs")
    with tools.step("bundle"), tempfile.TemporaryDirectory(dir=result.parent, prefix="bundle-") as name:
        folder = pathlib.Path(name) / "content"
        folder.mkdir()
        (folder / "manifest.raucm").write_text(MANIFEST.format(compatible=release.compatible, version=release.version))
        (folder / "system.img").hardlink_to(system)
        made = pathlib.Path(name) / "update.raucb"
        tools.run("rauc", f"--cert={certificate}", f"--key={key}", "bundle", folder, made)
        made.rename(result)
