# SPDX-License-Identifier: Apache-2.0
"""code_blocks.py FOLDER DOCUMENT...: writes each C++ block of the documents to the file below FOLDER that its first line names."""
import pathlib
import re
import sys

folder, *documents = map(pathlib.Path, sys.argv[1:])
for document in documents:
    blocks = re.findall(r"^```cpp\n// (\S+)\n(.*?)^```$", document.read_text(), re.MULTILINE | re.DOTALL)
    if not blocks:
        sys.exit(f"{document} shows no C++ any more")
    for name, code in blocks:
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.exists() or file.read_text() != code:
            file.write_text(code)
