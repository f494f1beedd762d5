# SPDX-License-Identifier: Apache-2.0
"""Sends an update to a machine over SSH and follows it until the new release has proven itself, or the old one is back."""
import pathlib
import subprocess
import time

from . import tools

PLACE = "/var/lib/takt/update/update.raucb"
RELEASE = ". /usr/libexec/takt/machine/common; echo \"$(release) $(slot) $(cat /proc/sys/kernel/random/boot_id)\"; cat $state/good_$(slot) 2>/dev/null || true; cat $state/refused 2>/dev/null || true"


class Robot:
    def __init__(self, host, ssh):
        self.words = [*ssh.split(), host]

    def ask(self, command, stdin=None, seconds=60):
        """(exit code, output); 255 where the host cannot be reached."""
        try:
            done = subprocess.run([*self.words, command], stdin=stdin or subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=seconds, check=False)
        except subprocess.TimeoutExpired:
            return 255, f"no answer within {seconds} s"
        except OSError as error:
            raise tools.Failure(f"{self.words[0]}: {error.strerror}") from None
        return done.returncode, done.stdout.decode(errors="replace").strip()


def install(robot, bundle, seconds=900):
    """Copies and installs; returns the boot id that was, once the machine has been told to boot the new release."""
    code, text = robot.ask(RELEASE)
    if code:
        raise tools.Failure(f"{robot.words[-1]}: {text or 'no machine made by takt image'}")
    release, slot, boot = text.splitlines()[0].split()
    tools.say(f"{robot.words[-1]} runs release {release} in slot {slot}")
    with tools.step("copied"), open(bundle, "rb") as content:
        code, text = robot.ask(f"mkdir -p {pathlib.PurePosixPath(PLACE).parent} && cat >{PLACE} && sync {PLACE}", content, seconds)
    if code:
        raise tools.Failure(f"the update could not be copied: {text}")
    with tools.step("installed"):
        code, text = robot.ask(f"rm -f /run/takt/no_update; rauc install {PLACE}; code=$?; rm -f {PLACE}; cat /run/takt/no_update 2>/dev/null; exit $code", None, seconds)
    if code:
        raise tools.Failure(f"the machine refuses it and goes on with release {release}:\n{text}", tools.NOT_OK)
    robot.ask("systemctl reboot")
    return release, boot


def follow(robot, before, seconds=1200):
    """Until a release is good after the restart. Fails if it is the one from before, with the reason that the machine kept."""
    release, boot = before
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(5)
        code, text = robot.ask(RELEASE, None, 20)
        lines = text.splitlines()
        if code or not lines or len(lines[0].split()) != 3 or lines[0].split()[2] == boot:
            continue
        now = lines[0].split()[0]
        reason = next((line for line in lines[1:] if line.startswith("release ") and ": " in line), None)
        if now == release and reason:
            raise tools.Failure(f"the machine is back at release {release}: {reason}", tools.NOT_OK)
        if len(lines) > 1 and lines[1] == now and now != release:
            print(f"release {now} is good")
            return
    raise tools.Failure(f"{robot.words[-1]} said nothing of a good release within {seconds} s", tools.NOT_OK)
