// SPDX-License-Identifier: Apache-2.0
#include "graph/rewind/recorded_options.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "graph/cli/outcome.hpp"
#include "graph/log/log_content.hpp"

namespace takt::rewind {

using command::kBadInput;
using command::kDeviceOrSystem;
using command::refuse;
using log::fact;
using log::Json;

Json attached_json(const record::LogFile& file, const char* name) {
  const auto text = file.attached(name);
  Json json = text ? Json::parse(*text, nullptr, false) : Json();
  if (json.is_discarded() || !json.is_object()) throw Refused{fmt::format("the record holds no readable {}", name)};
  return json;
}

command::RunOptions recorded_options(const record::LogFile& file, const ReplayOptions& options) {
  const mcap::Metadata& facts = file.facts();
  command::RunOptions run;
  run.graph = options.graph.empty() ? std::filesystem::path(fact(facts, "graph")) : options.graph;
  if (!std::filesystem::exists(run.graph))
    throw Refused{fmt::format("the graph {} of the record is not there; name it: takt replay {} GRAPH",
                              run.graph.string(), options.log.string())};
  if (options.graph.empty()) run.load.schedule = fact(facts, "schedule");
  run.load.params = options.params.empty() ? std::filesystem::path(fact(facts, "params")) : options.params;
  if (!run.load.params.empty() && !std::filesystem::exists(run.load.params))
    throw Refused{fmt::format("the parameter file {} of the record is not there; name it: --params FILE",
                              run.load.params.string())};
  run.load.profile = fact(facts, "profile");
  run.load.mode = fact(facts, "mode");
  run.load.machine = fact(facts, "part");
  run.load.policy = fact(facts, "policy_option");
  std::istringstream settings(fact(facts, "set"));
  for (std::string line; std::getline(settings, line);) run.load.set.push_back(line);
  run.load.set.insert(run.load.set.end(), options.set.begin(), options.set.end());
  run.clock = fact(facts, "clock");
  run.output = options.output;
  run.seed = std::strtoull(fact(facts, "seed").c_str(), nullptr, 10);
  run.load.plugin_files = options.plugin_files;
  run.load.conditions = options.conditions;
  return run;
}

void remember_as_recorded(graph::GraphSpec& graph, const record::LogFile& file) {
  graph.record.snapshot_ns = std::strtoll(fact(file.facts(), "snapshots_ns").c_str(), nullptr, 10);
  graph.record.recorded = graph.record.snapshot_ns > 0;
}

int judged(const ReplayOptions& options, const std::function<int()>& command) {
  try {
    return command();
  } catch (const Refused& refused) {
    return refuse(refused.why, kBadInput);
  } catch (const std::runtime_error& problem) {  // processes
    return refuse(problem.what(), kDeviceOrSystem);
  } catch (const Json::exception& problem) {
    return refuse(fmt::format("{}: what it says of its graph cannot be read: {}", options.log.string(), problem.what()),
                  kBadInput);
  }
}

}  // namespace takt::rewind
