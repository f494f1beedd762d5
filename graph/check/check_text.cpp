// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check_text.hpp"

#include <fmt/format.h>

#include "graph/language/quantity.hpp"

namespace takt::graph {

std::string check_text(const CheckResult& result, const GraphSpec& graph) {
  std::string text =
      fmt::format("graph {}, schedule {}, policy {}, profile {}: {}, {}\n", graph.name, graph.schedule.name,
                  takt::to_string(graph.schedule.policy), graph.profile.empty() ? "-" : graph.profile,
                  to_string(result.verdict), result.admitted ? "admitted" : "not admitted");
  for (const auto& line : result.adjusted) text += "adjusted: " + line + "\n";
  text += fmt::format("\n{:<20} {:>9} {:>11} {:>7} {:>11} {:>5}\n", "node or device", "rate Hz", "budget", "of core",
                      "margin", "core");
  for (const auto& task : result.tasks)
    text += fmt::format("{:<20} {:>9.4g} {:>11} {:>6.1f}% {:>11} {:>5}\n", task.name, task.rate_hz,
                        task.budget_ns > 0 ? duration_text(task.budget_ns) : "-", 100 * task.utilisation,
                        duration_text(task.margin_ns), task.core < 0 ? "-" : std::to_string(task.core));
  for (const auto& core : result.cores)
    text += fmt::format("core {}: {:.1f}%\n", core.core, 100 * core.utilisation);
  text += fmt::format("all: {:.1f}% of {} core{}\n", 100 * result.utilisation, result.cores.size(),
                      result.cores.size() == 1 ? "" : "s");
  text += fmt::format("\n{:<32} {:<16} {:>7} {:>12} {:>12}\n", "pool", "message", "chunks", "bytes each", "bytes");
  for (const auto& pool : result.pools)
    text += fmt::format("{:<32} {:<16} {:>7} {:>12} {:>12}\n", pool.output, pool.type, pool.chunks, pool.chunk_bytes,
                        pool.bytes);
  text += fmt::format("all pools: {:.1f} MiB\n", static_cast<double>(result.pool_bytes) / (1 << 20));
  for (const auto& note : result.notes) text += "note: " + note + "\n";
  for (const auto& problem : result.problems) text += "problem: " + problem + "\n";
  return text;
}

nlohmann::ordered_json to_json(const CheckResult& result) {
  nlohmann::ordered_json json;
  json["verdict"] = to_string(result.verdict);
  json["admitted"] = result.admitted;
  json["problems"] = result.problems;
  json["notes"] = result.notes;
  json["adjusted"] = result.adjusted;
  json["utilisation"] = result.utilisation;
  json["cores"] = nlohmann::ordered_json::array();
  for (const auto& core : result.cores) json["cores"].push_back({{"core", core.core}, {"utilisation", core.utilisation}});
  json["nodes"] = nlohmann::ordered_json::array();
  for (const auto& task : result.tasks) {
    nlohmann::ordered_json node;
    node["name"] = task.name;
    node["rate_hz"] = task.rate_hz;
    node["budget_ms"] = static_cast<double>(task.budget_ns) * 1e-6;
    node["utilisation"] = task.utilisation;
    node["margin_ms"] = static_cast<double>(task.margin_ns) * 1e-6;
    node["core"] = task.core < 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(task.core);
    json["nodes"].push_back(std::move(node));
  }
  json["pools"] = nlohmann::ordered_json::array();
  for (const auto& pool : result.pools)
    json["pools"].push_back({{"output", pool.output}, {"type", pool.type}, {"chunks", pool.chunks},
                             {"chunk_bytes", pool.chunk_bytes}, {"bytes", pool.bytes}});
  json["pool_bytes"] = result.pool_bytes;
  return json;
}

}  // namespace takt::graph
