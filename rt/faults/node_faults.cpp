// SPDX-License-Identifier: Apache-2.0
#include "rt/faults/node_faults.hpp"

#include <algorithm>

namespace takt::faults {

NodeFaults::NodeFaults(std::vector<NodeFault> faults, const Clock& clock, const std::atomic<int64_t>& epoch_ns,
                       std::vector<std::atomic<uint64_t>*> struck)
    : faults_(std::move(faults)), clock_(clock), epoch_ns_(epoch_ns), struck_(std::move(struck)) {}

bool NodeFaults::covers(size_t fault, int64_t now_ns) const {
  const int64_t epoch = epoch_ns_.load(std::memory_order_relaxed);
  if (epoch == 0 || !faults_[fault].covers(now_ns - epoch)) return false;
  return faults_[fault].kind != NodeFaultKind::hang || struck_[fault]->load(std::memory_order_relaxed) == 0;
}

bool NodeFaults::admits(int64_t release_ns) {
  bool admitted = true;
  for (size_t f = 0; f < faults_.size(); ++f) {
    if (faults_[f].kind != NodeFaultKind::absent || !covers(f, release_ns)) continue;
    struck_[f]->fetch_add(1, std::memory_order_relaxed);
    admitted = false;
  }
  return admitted;
}

int64_t NodeFaults::extra_ns() const {
  int64_t extra = 0;
  for (size_t f = 0; f < faults_.size(); ++f)
    if (faults_[f].kind != NodeFaultKind::absent && covers(f, clock_.now_ns()))
      extra += std::min(faults_[f].by_ns, kLongest_ns);
  return std::min(extra, kLongest_ns);
}

void NodeFaults::before_run(const Job&) {
  const int64_t now = clock_.now_ns();
  for (size_t f = 0; f < faults_.size(); ++f) {
    if (faults_[f].kind == NodeFaultKind::absent || !covers(f, now)) continue;
    struck_[f]->fetch_add(1, std::memory_order_relaxed);
    if (!clock_.is_virtual()) spend(faults_[f]);
  }
}

void NodeFaults::spend(const NodeFault& fault) const {
  // A hang is an endless loop, not a sleep: the worst that a job can do to its neighbours.
  const bool by_cpu = fault.kind == NodeFaultKind::slow;
  const int64_t from = by_cpu ? thread_cpu_ns() : clock_.now_ns();
  while ((by_cpu ? thread_cpu_ns() : clock_.now_ns()) - from < fault.by_ns) {
  }
}

}  // namespace takt::faults
