# SPDX-License-Identifier: Apache-2.0
# Ground as a user measures it, on labelled images.
source "$(dirname "$0")/lib.sh" "$@"

recordings ground
expect 0 "" "$takt" eval ground --images "$recordings/camvid" --labels "$recordings/camvid_annot" --drivable 3,4 --json
at_least precision_pct 97
at_least recall_pct 55

finish
