// SPDX-License-Identifier: Apache-2.0
#include "graph/command/explain_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "graph/cli/outcome.hpp"
#include "graph/explain/file_format.hpp"
#include "graph/explain/miss_svg.hpp"
#include "graph/explain/sentence.hpp"

namespace takt::command {
namespace {

using explain::Json;

int refuse_node(const ExplainOptions& options, const std::vector<std::string>& names) {
  return refuse(
      fmt::format("{}: no node {}; valid are: {}", options.file.string(), options.node, fmt::join(names, ", ")),
      kBadInput);
}

void tell_none(const ExplainOptions& options) {
  std::puts(options.node.empty() ? "no job missed" : ("no job of " + options.node + " missed").c_str());
}

/// What the trace does not know.
void tell_gaps(const trace::Trace& trace) {
  const trace::Losses& lost = trace.losses;
  if (lost.events + lost.switches + lost.forgotten + lost.threads > 0)
    std::printf(
        "note: the trace lost %llu events of jobs, %llu switches, gave up %llu old records, and had no room for "
        "%llu threads\n",
        static_cast<unsigned long long>(lost.events), static_cast<unsigned long long>(lost.switches),
        static_cast<unsigned long long>(lost.forgotten), static_cast<unsigned long long>(lost.threads));
  if (!trace.source_note.empty()) std::printf("note: %s\n", trace.source_note.c_str());
}

int explain_trace(const ExplainOptions& options, const trace::Trace& trace) {
  std::vector<std::string> names;
  for (const trace::TaskFacts& task : trace.tasks) names.push_back(task.name);
  if (!options.node.empty() && std::find(names.begin(), names.end(), options.node) == names.end())
    return refuse_node(options, names);
  const trace::Evidence evidence(trace);
  const trace::JobSpan* worst = nullptr;
  int64_t worst_ns = 0;
  for (const trace::JobSpan& job : trace.jobs) {
    if (!job.late || (!options.node.empty() && names[job.task] != options.node)) continue;
    const trace::Blame blame = trace::blame(evidence, job);
    std::puts(explain::sentence(trace, job, blame).c_str());
    if (worst != nullptr && blame.miss_ns <= worst_ns) continue;
    worst = &job;
    worst_ns = blame.miss_ns;
  }
  if (worst == nullptr) tell_none(options);
  tell_gaps(trace);
  if (options.svg.empty() || worst == nullptr) return kOk;
  return write_output(options.svg, explain::miss_svg(evidence, *worst), "--svg");
}

int explain_report(const ExplainOptions& options, const Json& report) {
  std::vector<std::string> names;
  bool missed = false;
  for (const Json& node : report["nodes"])
    if (node.is_object() && node.contains("name") && node["name"].is_string()) names.push_back(node["name"]);
  if (!options.node.empty() && std::find(names.begin(), names.end(), options.node) == names.end())
    return refuse_node(options, names);
  if (!options.svg.empty())
    return refuse(
        fmt::format("{}: a report holds no single jobs to draw; give --svg the file of `takt run --trace FILE`",
                    options.file.string()),
        kBadInput);
  for (const Json& node : report["nodes"]) {
    if (!node.is_object() || (!options.node.empty() && (!node.contains("name") || node["name"] != options.node)))
      continue;
    const std::string text = explain::report_sentence(node);
    if (text.empty()) continue;
    missed = true;
    std::puts(text.c_str());
  }
  if (!missed) tell_none(options);
  else std::puts("note: `takt run --trace FILE` records single jobs; explain that file for their causes");
  return kOk;
}

}  // namespace

int explain_misses(const ExplainOptions& options) {
  std::ifstream in(options.file, std::ios::binary);
  if (!in || std::filesystem::is_directory(options.file))
    return refuse(fmt::format("{}: cannot be read; name a file that `takt run --trace FILE` or `--report FILE` wrote",
                              options.file.string()),
                  kBadInput);
  const Json file = Json::parse(in, nullptr, false);
  const bool is_trace = file.is_object() && file.contains("otherData");
  if (const auto later = is_trace ? explain::later_format(file["otherData"], explain::kTraceFormat)
                                  : explain::later_format(file, explain::kReportFormat))
    return refuse(fmt::format("{} {}", options.file.string(), *later), kBadInput);
  if (file.is_object() && file.contains("nodes") && file["nodes"].is_array()) return explain_report(options, file);
  const auto trace = explain::read_trace(file);
  if (trace) return explain_trace(options, trace->trace);
  return refuse(fmt::format("{}: {}; name a file that `takt run --trace FILE` or `--report FILE` wrote",
                            options.file.string(), trace.error()),
                kBadInput);
}

}  // namespace takt::command
