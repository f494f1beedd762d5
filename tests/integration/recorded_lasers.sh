# SPDX-License-Identifier: Apache-2.0
# Captured bytes of a real scanner, as the index of the capture marks them.
source "$(dirname "$0")/lib.sh" "$@"

recordings sick/lms200
capture() { # NAME 'EXPRESSION OF r' OPTIONS...
  local name=$1 expression=$2
  shift 2
  expect 0 "" "$takt" eval lms200 --rx "$recordings/$name.rx.bin" --index "$recordings/$name.index.csv" "$@" --json
  python3 -c 'import json, sys; r = json.load(open(sys.argv[1])); print(r); sys.exit(not eval(sys.argv[2]))' \
    "$work/stdout" "r['not_as_marked'] == 0 and $expression" || fail "capture $name"
}
capture 2017_Aug_04_23-22-04 'r["accepted"] == 67 and r["beams_that_differ"] == 0 and r["beams_compared"] == 58 * 361' \
  --distances "$recordings/2017_Aug_04_23-22-04.distances.csv"
capture 2017_Aug_05_18-52-56 'r["accepted"] == 176 and r["beams_that_differ"] == 0 and r["scans"] == 165' \
  --distances "$recordings/2017_Aug_05_18-52-56.distances.csv"
capture 2017_Aug_05_19-09-36 \
  'r["accepted"] == r["rejected"] == 2 and r["found_inside_rejected"] == 1 and r["unlisted"] == 0'

finish
