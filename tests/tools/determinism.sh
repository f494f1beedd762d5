#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A node may depend on its inputs, its parameters and what its Job tells it, or its jobs cannot be replayed:
# determinism.sh SOURCE looks through nodes/ for clocks, random numbers without a seed of the node, unordered containers, thread ids,
# addresses as keys and the environment. What must be there all the same says why in a comment on its line:
# "// replay: ...". Programs that measure quality (evaluate*) are no nodes. As a check of the check, a line of each kind is looked for
# first.
set -u
forbidden='(random_device|default_random_engine|\b(rand|srand|rand_r|drand48)\(|(system|steady|high_resolution)_clock|MonotonicClock|\b(time|clock|gettimeofday|clock_gettime)\(|thread_cpu_ns\(|unordered_(multi)?(map|set)|std::hash|this_thread::get_id|gettid\(|pthread_self\(|getpid\(|getenv\(|cv::(theRNG|randu|randn|getTickCount))'
bad=0
while read -r line; do
  grep -qE "$forbidden" <<<"$line" || { echo "the check does not see: $line"; bad=1; }
done <<'LINES'
std::mt19937 random(std::random_device{}());
const int x = rand() % 7;
const auto now = std::chrono::steady_clock::now();
clock_gettime(CLOCK_REALTIME, &now);
const int64_t used = thread_cpu_ns();
std::unordered_map<int, float> cells;
cv::randu(noise, 0, 255);
if (std::getenv("FAST")) return;
LINES
found=$(grep -rnE "$forbidden" "$1/nodes" --include='*.cpp' --include='*.hpp' | grep -v '/evaluate' | grep -v '// replay: ')
[ -z "$found" ] || { echo "not determined by inputs, parameters and Job:"; echo "$found"; bad=1; }
exit $bad
