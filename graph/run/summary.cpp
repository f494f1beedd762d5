// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "graph/faults/verdict.hpp"
#include "graph/run/report.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

std::string figure(const Json& value, const char* format) {
  return value.is_null() ? "-" : fmt::format(fmt::runtime(format), value.get<double>());
}

// The table fits a terminal of 80 columns; lines of events and of `adjusted` may be longer.
constexpr const char* kRow = "{:<16} {:>3} {:>4} {:>4} {:>4} {:>4} {:>5} {:>5} {:>6} {:>6} {:>5} {:>6}\n";

std::string node_line(const Json& node) {
  const auto number = [&](const char* key) { return std::to_string(node[key].get<uint64_t>()); };
  return fmt::format(fmt::runtime(kRow), node["name"].get<std::string>().substr(0, 16), figure(node["rate_hz"], "{:g}"),
                     number("released"), number("completed"), number("deadline_misses"), number("skipped"),
                     number("stale_inputs"), figure(node["exec_ms"]["p50"], "{:.2f}"),
                     figure(node["exec_ms"]["p99"], "{:.2f}"), figure(node["response_ms"]["p99"], "{:.2f}"),
                     figure(node["lateness_us"]["p50"], "{:.0f}"), figure(node["lateness_us"]["p99"], "{:.0f}"));
}

/// Which quality levels a node worked at; nothing if it never left the first.
std::string quality_line(const Json& node) {
  const auto changes = node["quality_changes"]["count"].get<uint64_t>();
  if (changes == 0) return "";
  std::string text = fmt::format("quality {}:", node["name"].get<std::string>());
  for (size_t l = 0; l < node["quality_levels"].size(); ++l)
    text += fmt::format("{} {} {}", l == 0 ? "" : ",", node["quality_levels"][l].get<std::string>(),
                        node["quality"][std::to_string(l)].get<uint64_t>());
  return text + fmt::format(" jobs; {} changes\n", changes);
}

/// Who used the CPUs, most first, in lines of a terminal's width; below half a hundredth of a core nobody is named.
std::string cores_text(const Json& nodes) {
  constexpr double kLeastCores = 0.005;
  constexpr size_t kWidth = 80;
  std::vector<std::pair<double, std::string>> used;
  for (const Json& node : nodes)
    if (const auto cores = node["cores"].get<double>(); cores >= kLeastCores)
      used.emplace_back(cores, node["name"].get<std::string>());
  std::sort(used.rbegin(), used.rend());
  std::string text, line;
  for (const auto& [cores, name] : used) {
    const std::string piece = fmt::format("{} {:.2f}", name, cores);
    if (!line.empty() && line.size() + piece.size() + 3 > kWidth) text += std::exchange(line, "") + ",\n";
    line += (line.empty() ? "  " : ", ") + piece;
  }
  return line.empty() ? "" : text + line + "\n";
}

/// What was asked of the kernel, and what it says it gave.
std::string policy_text(const Json& report) {
  if (report.contains("simulated"))
    return fmt::format("simulated: policy {}, cores {}, durations {}", report["simulated"]["policy"].get<std::string>(),
                       report["simulated"]["cores"].get<int>(), report["simulated"]["durations"].get<std::string>());
  const auto verified = std::count_if(report["nodes"].begin(), report["nodes"].end(),
                                      [](const Json& node) { return node["granted"]["verified"].get<bool>(); });
  const std::string early = report.contains("anticipate_us")
                                ? fmt::format("; woken up to {} us early", report["anticipate_us"].get<double>())
                                : "";
  return fmt::format("policy {} granted (asked {}), read back for {} of {} nodes{}",
                     report["policy_granted"].get<std::string>(), report["policy_asked"].get<std::string>(), verified,
                     report["nodes"].size(), early);
}

/// ", proven 12.3"; of what is only estimated, that; "" of neither.
std::string proven_text(const Json& age) {
  if (!age["proven_ms"].is_null()) return figure(age["proven_ms"], ", proven {:.1f}");
  return age.contains("estimated_ms") && !age["estimated_ms"].is_null()
             ? figure(age["estimated_ms"], ", estimated {:.1f}")
             : "";
}

std::string record_line(const Json& record, uint64_t lost) {
  std::string text =
      fmt::format("record {}: {} messages, {} jobs, {:.1f} MB, ", record["file"].get<std::string>(),
                  record["messages"].get<uint64_t>(), record["jobs"].get<uint64_t>(), record["mb"].get<double>());
  if (lost == 0) return text + "nothing lost\n";
  const Json& why = record["lost"];
  text += fmt::format(
      "LOST {}: {} overwritten (its thread was away for {:.0f} ms at most), {} found the queue full, {} not written, "
      "{} jobs incomplete, {} threads unheard",
      lost, why["overwritten"].get<uint64_t>(), record["longest_pause_ms"].get<double>(),
      why["no_room"].get<uint64_t>(), why["not_written"].get<uint64_t>(), why["jobs"].get<uint64_t>(),
      why["threads"].get<uint64_t>());
  const auto refused = record["refused"].get<std::string>();
  return text + (refused.empty() ? "" : " (" + refused + ")") + "\n";
}

std::string not_ok_text(const Json& report) {
  const bool not_as_proven = report["proofs"]["verdict"] == "unexplained";
  return not_as_proven ? "NOT OK: something is not as proven, see the first lines\n"
                       : "NOT OK: a high-criticality deadline was missed or a node fell behind\n";
}

}  // namespace

std::string summary_text(const Json& report) {
  const auto word = [&](const char* key) { return report[key].get<std::string>(); };
  std::string text = fmt::format(
      "\n{}{} on {}, {:.1f} s ({} profile, {} clock, {} transport{})\n{}\n", unexplained_text(report["proofs"]),
      word("graph"), word("schedule"), report["duration_s"].get<double>(), word("profile"), word("clock"),
      word("transport"), report["processes"].empty() ? "" : fmt::format(", {} processes", report["processes"].size()),
      policy_text(report));
  text += fmt::format(fmt::runtime(kRow), "", "", "", "", "", "", "", "exec", "ms", "resp", "late", "us");
  text += fmt::format(fmt::runtime(kRow), "node", "Hz", "rel", "done", "miss", "skip", "stale", "p50", "p99", "p99",
                      "p50", "p99");
  for (const Json& node : report["nodes"]) text += node_line(node);
  for (const Json& chain : report["chains"])
    text += fmt::format("chain {}: age p50 {} ms, max {} ms{}, bound {} ms: {}\n", chain["name"].get<std::string>(),
                        figure(chain["age_ms"]["p50"], "{:.1f}"), figure(chain["age_ms"]["max"], "{:.1f}"),
                        proven_text(chain["age_ms"]), figure(chain["bound_ms"], "{:.0f}"),
                        chain["within"].is_null()     ? "no sample"
                        : chain["within"].get<bool>() ? "within"
                                                      : "EXCEEDED");
  for (const Json& node : report["nodes"]) text += quality_line(node);
  const Json& by = report["cpu"]["by"];
  text += fmt::format("CPU {:.2f} cores: nodes {:.2f}, devices {:.2f}, simulator {:.2f}, runtime {:.2f}\n",
                      report["cpu"]["utilisation"].get<double>(), by["nodes"].get<double>(),
                      by["devices"].get<double>(), by["simulator"].get<double>(), by["runtime"].get<double>());
  text += cores_text(report["nodes"]);
  text += fmt::format("memory {:.0f} MB shared, {:.0f} MB resident; host stall {} ms\n",
                      report["memory"]["shm_mb"].get<double>(), report["memory"]["rss_mb"].get<double>(),
                      report["host_stall_ms"].get<int64_t>());
  if (report.contains("record")) text += record_line(report["record"], report["recorder_lost"].get<uint64_t>());
  if (const auto lines = report.value("unsaid_lines", uint64_t{0}); lines > 0)
    text += fmt::format("stderr: {} lines could not be written\n", lines);
  text += events_text(report);
  text += proofs_text(report["proofs"]);
  for (const Json& line : report["adjusted"]) text += "adjusted: " + line.get<std::string>() + "\n";
  text += report["ok"].get<bool>() ? "ok\n" : not_ok_text(report);
  if (report.contains("scenario")) text += graph::scenario_text(report["scenario"]);
  if (report.contains("expectations")) {
    text += graph::findings_text(report["expectations"]["conditions"]);
    text += report["expectations"]["met"].get<bool>() ? "as expected\n" : "NOT AS EXPECTED\n";
  }
  return text;
}

}  // namespace takt::command
