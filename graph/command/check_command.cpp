// SPDX-License-Identifier: Apache-2.0
#include "graph/command/check_command.hpp"

#include <cstdio>

#include "graph/check/check.hpp"
#include "graph/command/prepare.hpp"

namespace takt::command {

int check_graph(const RunOptions& options, bool json) {
  Prepared prepared;
  if (const int code = prepare(options, prepared); code != kOk) return code;
  const graph::CheckResult result = graph::check(*prepared.graph, prepared.composition->plan);
  std::fputs(json ? (result.json.dump(2) + "\n").c_str() : result.text.c_str(), stdout);
  return result.admitted ? kOk : kNotOk;
}

int print_nodes(const std::string& type) {
  const NodeTypes types = graph::node_types();
  if (type.empty()) {
    std::fputs(graph::nodes_text(types).c_str(), stdout);
    return kOk;
  }
  if (const NodeType* found = types.find(type)) {
    std::fputs(graph::node_text(*found).c_str(), stdout);
    return kOk;
  }
  std::fprintf(stderr, "takt: error: node type \"%s\" is unknown; valid are:\n%s", type.c_str(),
               graph::nodes_text(types).c_str());
  return kBadInput;
}

}  // namespace takt::command
