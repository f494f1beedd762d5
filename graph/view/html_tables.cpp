// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "graph/view/html_parts.hpp"

namespace takt::view {
namespace {

const std::vector<std::string> kQuantiles{"p50", "p99", "p999", "max"};

void quantile_cells(Table& table, const Json& distribution, const char* format) {
  for (const std::string& key : kQuantiles) table.cell(figure(at(distribution, key), format));
}

std::string cores_text(const Json& cpus) {
  std::string text;
  for (const Json& cpu : cpus)
    if (cpu.is_number_integer()) text += (text.empty() ? "" : " ") + cpu.dump();
  return text.empty() ? "–" : text;
}

std::string jobs_table(const Json& nodes) {
  Table table({{"node", false},
               {"criticality", false},
               {"Hz"},
               {"active s"},
               {"released"},
               {"completed"},
               {"missed"},
               {"skipped"},
               {"reused"},
               {"overruns"},
               {"stale"},
               {"new"},
               {"no result"},
               {"drift µs"}});
  for (const Json& node : nodes) {
    const auto released = number(at(node, "released")), completed = number(at(node, "completed"));
    const bool behind = number(at(node, "rate_hz")) && released && completed && *completed + 1 < *released;
    table.begin_row();
    table.cell(words(at(node, "name")));
    table.cell(words(at(node, "criticality")));
    table.cell(figure(at(node, "rate_hz"), "{:g}"));
    table.cell(figure(at(node, "active_s"), "{:.1f}"));
    table.cell(count_text(at(node, "released")));
    table.cell(count_text(at(node, "completed")), behind);
    for (const char* key : {"deadline_misses", "skipped", "reused", "budget_overruns"})
      table.cell(count_text(at(node, key)), number(at(node, key)).value_or(0) > 0);
    for (const char* key : {"stale_inputs", "new_inputs", "no_result"}) table.cell(count_text(at(node, key)));
    table.cell(figure(at(node, "drift_us"), "{:.1f}"));
  }
  return table.html();
}

std::string granted_table(const Json& nodes) {
  Table table({{"node", false},
               {"policy", false},
               {"read back", false},
               {"cores", false},
               {"runtime ms"},
               {"deadline ms"},
               {"preempted ms"},
               {"allocations"},
               {"page faults"}});
  for (const Json& node : nodes) {
    const Json& granted = at(node, "granted");
    const Json& verified = at(granted, "verified");
    table.begin_row();
    table.cell(words(at(node, "name")));
    table.cell(words(at(granted, "policy")));
    table.cell(verified.is_boolean() ? (verified.get<bool>() ? "yes" : "NO") : "–", verified == false);
    table.cell(cores_text(at(granted, "cpus")));
    for (const char* key : {"runtime_ms", "deadline_ms"}) table.cell(figure(at(granted, key), "{:.2f}"));
    table.cell(figure(at(node, "preempted_ms"), "{:.1f}"));
    for (const char* key : {"allocations", "page_faults"}) table.cell(count_text(at(node, key)));
  }
  return table.html();
}

std::string times_table(const Json& nodes) {
  std::vector<Table::Column> columns{{"node", false}, {"samples"}};
  constexpr std::array kGroups{"lateness µs", "execution ms", "response ms", "publish ms"};
  constexpr size_t kResponse = 2;  // of which there may be a bound
  for (size_t group = 0; group < kGroups.size(); ++group) {
    for (const std::string& key : kQuantiles) columns.push_back({key});
    if (group == kResponse) columns.push_back({"proven"});
  }
  Table table(std::move(columns));
  table.group("", 2);
  for (size_t group = 0; group < kGroups.size(); ++group) table.group(kGroups[group], group == kResponse ? 5 : 4);
  for (const Json& node : nodes) {
    table.begin_row();
    table.cell(words(at(node, "name")));
    table.cell(count_text(at(node, "samples")));
    quantile_cells(table, at(node, "lateness_us"), "{:.0f}");
    quantile_cells(table, at(node, "exec_ms"), "{:.2f}");
    quantile_cells(table, at(node, "response_ms"), "{:.2f}");
    table.cell(figure(at(at(node, "response_ms"), "proven_ms"), "{:.2f}"));
    quantile_cells(table, at(node, "publish_ms"), "{:.3f}");
  }
  return table.html();
}

const graph::ChainSpec* chain_of(const graph::GraphSpec& graph, const std::string& name) {
  const auto chain =
      std::find_if(graph.chains.begin(), graph.chains.end(), [&](const auto& c) { return c.name == name; });
  return chain == graph.chains.end() ? nullptr : &*chain;
}

}  // namespace

std::string nodes_section(const Json& report) {
  const Json& nodes = at(report, "nodes");
  if (!nodes.is_array()) return section("Nodes", not_recorded());
  return section("Nodes",
                 "<h3>Jobs</h3>\n" + jobs_table(nodes) +
                     note("Marked: jobs missed, skipped, reused or overrun, and nodes that fell behind. Drift: of the "
                          "last release from plan.") +
                     "<h3>Times</h3>\n" + times_table(nodes) +
                     note("Lateness: planned release to start. Execution: CPU time of a job. Response: planned release "
                          "to published output. Every job counts; p999 from 1000 samples on.") +
                     "<h3>Granted and used</h3>\n" + granted_table(nodes) +
                     note("Read back: what the kernel says of the thread agrees with what was asked. Preempted: time "
                          "from start to finish in which the job had no CPU, over all jobs."));
}

std::string edges_section(const Json& report) {
  const Json& edges = at(report, "edges");
  if (!edges.is_array()) return section("Edges", not_recorded());
  Table table({{"from", false},
               {"to", false},
               {"sent"},
               {"received"},
               {"dropped"},
               {"stale"},
               {"p50"},
               {"p99"},
               {"p999"},
               {"max"},
               {"proven"}});
  table.group("", 6);
  table.group("age at the reader's release, ms", 5);
  for (const Json& edge : edges) {
    table.begin_row();
    for (const char* key : {"from", "to"}) table.cell(words(at(edge, key)));
    for (const char* key : {"sent", "received", "dropped", "stale"}) table.cell(count_text(at(edge, key)));
    quantile_cells(table, at(edge, "age_ms"), "{:.1f}");
    table.cell(figure(at(at(edge, "age_ms"), "proven_ms"), "{:.1f}"));
  }
  return section("Edges", table.html());
}

std::string chains_section(const Json& report, const graph::GraphSpec& graph) {
  const Json& chains = at(report, "chains");
  if (!chains.is_array()) return section("Chains", not_recorded());
  if (chains.empty()) return section("Chains", note("the graph names none"));
  Table table(
      {{"chain", false}, {"way", false}, {"p50"}, {"p99"}, {"p999"}, {"max"}, {"proven"}, {"bound ms"}, {"", false}});
  table.group("", 2);
  table.group("age at the end, ms", 5);
  table.group("", 2);
  for (const Json& chain : chains) {
    const auto* spec = chain_of(graph, words(at(chain, "name")));
    const Json& within = at(chain, "within");
    table.begin_row();
    table.cell(words(at(chain, "name")));
    table.cell(spec != nullptr ? fmt::format("{} → {}", spec->from.text(), spec->to.text()) : "–");
    quantile_cells(table, at(chain, "age_ms"), "{:.1f}");
    table.cell(figure(at(at(chain, "age_ms"), "proven_ms"), "{:.1f}"));
    table.cell(figure(at(chain, "bound_ms"), "{:g}"));
    table.cell(!within.is_boolean() ? "no sample" : within.get<bool>() ? "within" : "EXCEEDED", within == false);
  }
  return section("Chains", table.html());
}

std::string memory_section(const Json& report) {
  const Json& memory = at(report, "memory");
  if (!memory.is_object()) return section("Memory", not_recorded());
  std::string body = fmt::format("<p>{} MB shared, {} MB resident</p>\n", figure(at(memory, "shm_mb"), "{:.1f}"),
                                 figure(at(memory, "rss_mb"), "{:.0f}"));
  const Json& pools = at(memory, "pools");
  if (!pools.is_array()) return section("Memory", body + note("pools: not recorded"));
  Table table(
      {{"pool", false}, {"bytes per chunk"}, {"chunks"}, {"MB"}, {"peak in use"}, {"in use at end"}, {"exhausted"}});
  for (const Json& pool : pools) {
    const auto bytes = number(at(pool, "bytes")), chunks = number(at(pool, "chunks"));
    table.begin_row();
    table.cell(words(at(pool, "port")));
    for (const char* key : {"bytes", "chunks"}) table.cell(count_text(at(pool, key)));
    table.cell(bytes && chunks ? fmt::format("{:.2f}", *bytes * *chunks / 1e6) : "–");
    for (const char* key : {"peak", "in_use_at_end"}) table.cell(count_text(at(pool, key)));
    table.cell(count_text(at(pool, "exhausted")), number(at(pool, "exhausted")).value_or(0) > 0);
  }
  return section("Memory", body + table.html());
}

}  // namespace takt::view
