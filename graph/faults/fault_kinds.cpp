// SPDX-License-Identifier: Apache-2.0
#include "graph/faults/fault_kinds.hpp"

#include <algorithm>
#include <string>

namespace takt::graph {
namespace {

using Keys = std::vector<std::string_view>;

std::vector<FaultKindInfo> make_kinds() {
  using enum FaultKind;
  constexpr auto kOutput = FaultTarget::output, kNode = FaultTarget::node, kProcess = FaultTarget::process,
                 kDevice = FaultTarget::device, kNothing = FaultTarget::none;
  const Keys none, window{"from", "to"}, chance{"from", "to", "probability"};
  const Keys repeated{"at", "every", "from", "to", "for"};
  // kind, name, target, required, optional, virtual time, one process, needs a record
  return {
      {drop, "drop", kOutput, none, chance, true, true, false},
      {delay, "delay", kOutput, {"by"}, chance, true, true, false},
      {duplicate, "duplicate", kOutput, none, chance, true, true, false},
      {corrupt, "corrupt", kOutput, none, chance, true, true, false},
      {truncate, "truncate", kOutput, none, chance, true, true, false},
      {freeze, "freeze", kOutput, none, window, true, true, false},
      {reorder, "reorder", kOutput, none, chance, true, true, false},
      {clock_step, "clock_step", kOutput, {"by"}, chance, true, true, false},
      {exhausted_pool, "exhausted_pool", kOutput, none, window, true, true, false},
      {slow_consumer, "slow_consumer", kNode, {"by"}, window, true, true, false},
      {hang, "hang", kNode, {"at", "for"}, none, true, true, false},
      {kill, "kill", kProcess, none, repeated, true, false, false},
      {kill_at_step, "kill_at_step", kOutput, {"step"}, {"reader", "at", "every", "from", "to"}, false, false, false},
      {stop_process, "stop_process", kProcess, {"at", "for"}, none, false, false, false},
      {cpu_hog, "cpu_hog", kNothing, none, {"from", "to", "threads", "policy"}, false, true, false},
      {memory_hog, "memory_hog", kNothing, {"megabytes"}, window, false, true, false},
      {slow_disk, "slow_disk", kNothing, {"bytes_per_s"}, window, false, true, true},
      {full_disk, "full_disk", kNothing, {"megabytes"}, window, true, true, true},
      {silent, "silent", kDevice, none, window, true, true, false},
      {unplugged, "unplugged", kDevice, none, window, true, true, false},
      {garbage, "garbage", kDevice, none, window, true, true, false},
      {frozen, "frozen", kDevice, none, window, true, true, false},
  };
}

}  // namespace

std::span<const FaultKindInfo> fault_kinds() {
  static const std::vector<FaultKindInfo> kinds = make_kinds();
  return kinds;
}

const FaultKindInfo& info(FaultKind kind) { return fault_kinds()[static_cast<size_t>(kind)]; }

const FaultKindInfo* find_fault_kind(std::string_view name) {
  const auto kinds = fault_kinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(), [&](const auto& kind) { return kind.name == name; });
  return found == kinds.end() ? nullptr : &*found;
}

bool strikes_messages(FaultKind kind) {
  return info(kind).target == FaultTarget::output && kind != FaultKind::kill_at_step;
}

bool strikes_processes(FaultKind kind) {
  return kind == FaultKind::kill || kind == FaultKind::kill_at_step || kind == FaultKind::stop_process;
}

}  // namespace takt::graph
