#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# start_page.sh TAKT SOURCE: docs/start.md does what it says, line by line, with the build that TAKT is of.
build=$(cd "$(dirname "$1")/../.." && pwd) || exit 1
exec python3 "$2/tests/endurance/outsider.py" --here --page docs/start.md --build "$build"
