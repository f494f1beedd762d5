# SPDX-License-Identifier: Apache-2.0
# Shared by .ci/run and its steps, which start in the root of the project.
export CCACHE_MAXSIZE=4G
# What the change is compared with; without a commit before it, all is new.
base=$(git rev-parse --verify -q "${TAKT_CI_BASE:-HEAD~1}" || git hash-object -t tree /dev/null)
# What a commit's run needs of the Release build.
commit_targets=(takt takt-eval takt-tools takt-web takt-ros2 takt-bench takt_nodes_tests)

usage() {
  echo "ci: $1" >&2
  exit 2
}

# install COMMAND PACKAGES...: if there is no such command yet, or file.
install() {
  { command -v "$1" >/dev/null || [ -e "$1" ]; } && return
  apt-get install -y --no-install-recommends "${@:2}" >/dev/null 2>&1 ||
    { apt-get update >/dev/null && apt-get install -y --no-install-recommends "${@:2}" >/dev/null; }
}

# changed PATHS...: whether the change touches one of them; pages do not count.
changed() { ! git diff --quiet "$base" HEAD -- "$@" ':!*.md'; }

# what_failed STEP LOG: how each test that failed ended (ctest prints its output below its line), and the step's last lines.
what_failed() {
  printf '\n=== %s, what failed\n' "$1"
  awk '/ Test +#[0-9]+: /{if (n) print kept; n = /\*\*\*/; kept = $0; lines = 0; next}
    n { if (++lines <= 60) kept = kept "\n" $0; else { sub(/\n[^\n]*/, "", kept); kept = kept "\n" $0 } } END { if (n) print kept }' "$2" |
    cut -c1-300
  tail -n 15 "$2"
}

# Properties draw other numbers in each commit; a failure prints the seed, too.
seed_by_commit() {
  export TAKT_PROPERTY_SEED=$((16#$(git rev-parse --short=8 HEAD | cut -c1-8)))
  echo "TAKT_PROPERTY_SCALE=${TAKT_PROPERTY_SCALE:-1} TAKT_PROPERTY_SEED=$TAKT_PROPERTY_SEED"
}

# build PRESET TARGETS... : configured once, quiet unless it fails.
build() {
  local preset=$1
  shift
  [ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" ${configure_with:-} >/dev/null
  cmake --build --preset "$preset" --target "$@" >"build/$preset.log" 2>&1 || { tail -n 60 "build/$preset.log"; return 1; }
  echo "built $preset: $* ($SECONDS s)"
}

# Shares are seconds of a machine on which two compilations side by side, those below, take this long.
nominal_ms=3000
machine_ms=
measure_machine() { # once, as soon as there is a compiler
  [ -z "$machine_ms" ] && command -v g++ >/dev/null || return 0
  local start
  start=$(date +%s%N)
  for _ in 1 2; do
    printf '#include <regex>\nbool f(const char* a) { return std::regex_match(a, std::regex("a*")); }\n' |
      CCACHE_DISABLE=1 g++ -std=c++20 -O2 -x c++ -c - -o /dev/null &
  done
  wait
  machine_ms=$((($(date +%s%N) - start) / 1000000))
  echo "this machine: $(nproc) cores, two compilations side by side in $machine_ms ms (shares: $nominal_ms ms)"
}
measure_again() { # it may have become slower since
  local before=$machine_ms
  machine_ms=
  measure_machine
  [ "${machine_ms:-0}" -gt "${before:-0}" ] || machine_ms=$before
}
allowed_s() { echo $((${machine_ms:-0} > nominal_ms ? $1 * machine_ms / nominal_ms : $1)); }

# take_shard K N: the steps of shard K; the longest first, each to the shard that has least to do.
take_shard() {
  for s in $(names); do echo "$(header "$s" share) $s"; done | sort -k1,1nr -k2 |
    awk -v k="$1" -v n="$2" '{ least = 1; for (i = 2; i <= n; ++i) if (load[i] < load[least]) least = i; load[least] += $1; if (least == k) print $2 }' | sort
}
