// SPDX-License-Identifier: Apache-2.0
#include "graph/command/check_command.hpp"

#include <algorithm>
#include <cstdio>

#include "graph/check/check.hpp"
#include "graph/check/grantable.hpp"
#include "graph/compose/spares.hpp"
#include "graph/flight/places.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/support.hpp"
#include "hal/device_types.hpp"

namespace takt::command {

int check_graph(const Registry& registry, const RunOptions& options, bool json) {
  Prepared prepared(registry);
  if (const int code = prepare_check(options, prepared); code != kOk) {
    if (json) std::printf("%s\n", graph::check_failed(prepared.problems).json.dump(2).c_str());
    return code;
  }
  choose_cores(prepared.composition->plan.cores, prepared.graph->adjusted);
  graph::CheckResult result = graph::check(*prepared.graph, prepared.composition->plan, {this_machine(), true, true});
  if (prepared.composition->plan.policy == Policy::deadline) {
    const std::optional<DeadlineBandwidth> bandwidth = deadline_bandwidth();
    result.text += graph::grantable_text(bandwidth);
    result.json["grantable"] = graph::grantable_json(bandwidth);
  }
  if (prepared.graph->isolation == "subsystem") {
    std::vector<std::string> adjusted;
    const graph::Partition partition = graph::partition(*prepared.graph, adjusted);
    const std::vector<graph::SpareChoice> spares = graph::spares(*prepared.graph, partition, adjusted);
    for (const std::string& line : adjusted) std::fprintf(stderr, "takt: adjusted: %s\n", line.c_str());
    const auto room =
        graph::takeover_room(prepared.composition->plan, partition, this_machine().overheads.deadline_bandwidth);
    result.text += graph::spares_text(partition, spares, room);
    result.json["spares"] = graph::spares_json(partition, spares, room);
  }
  if (prepared.graph->record.recorded) {
    const graph::RecordSpec& ring = prepared.graph->record;
    const std::filesystem::path folder = options.output.parent_path().empty() ? "." : options.output.parent_path();
    result.text += flight::ring_text(ring, prepared.composition->plan, folder);
    result.json["ring"] = flight::ring_json(ring, prepared.composition->plan, folder);
  }
  std::fputs(json ? (result.json.dump(2) + "\n").c_str() : result.text.c_str(), stdout);
  if (result.verdict == graph::Verdict::invalid) return kBadInput;
  return result.admitted ? kOk : kNotOk;
}

int print_nodes(const Registry& registry, const std::string& type) {
  const hal::DeviceKind* const kind = registry.devices.find(type);
  const std::string all = graph::nodes_text(registry.nodes) + graph::devices_text(registry.devices);
  if (const NodeType* found = registry.nodes.find(type)) std::fputs(graph::node_text(*found).c_str(), stdout);
  else if (kind != nullptr) std::fputs(graph::device_text(*kind).c_str(), stdout);
  else if (type.empty()) std::fputs(all.c_str(), stdout);
  else {
    std::fprintf(stderr, "takt: error: node type or device kind \"%s\" is unknown; valid are:\n%s", type.c_str(),
                 all.c_str());
    return kBadInput;
  }
  return kOk;
}

}  // namespace takt::command
