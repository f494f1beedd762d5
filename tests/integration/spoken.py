# SPDX-License-Identifier: Apache-2.0
"""spoken.py WAV SENTENCE...: whether the file holds what espeak-ng makes of these sentences and no others, with 0.3 s between two."""
import subprocess
import sys
import wave

with wave.open(sys.argv[1]) as file:
    assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 2, 22050), file.getparams()
    data = file.readframes(file.getnframes())
    assert len(data) == 2 * file.getnframes()
sounds = []
for words in sys.argv[2:]:
    sound = subprocess.run(["/usr/bin/espeak-ng", "-v", "en", "-s", "160", "--stdin", "--stdout"], input=words.encode() + b"\n",
                           capture_output=True, check=True).stdout
    sounds.append(sound[44:len(sound) - len(sound) % 2])
whole = (b"\0" * (2 * (22050 * 300 // 1000))).join(sounds)
print(f"{len(data) / 2 / 22050:.2f} s of speech; wanted {len(whole) / 2 / 22050:.2f} s")
assert data == whole, (len(data), len(whole))
