// SPDX-License-Identifier: Apache-2.0
#include "graph/check/doctor_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "graph/check/machine_figures.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/parse.hpp"

namespace takt::graph {
namespace {

using machine::Finding;
using machine::Status;
using Json = nlohmann::ordered_json;

constexpr size_t kWidth = 80, kIndent = 10;
constexpr std::array kStatuses{Status::ok, Status::warn, Status::lacks, Status::unknown};

/// `text` broken between words into lines of kWidth; all but the first indented, all but the last ended by `join`.
std::string wrapped(const std::string& text, size_t used, size_t indent, const std::string& join = "") {
  std::string lines;
  size_t column = used;
  bool first = true;
  for (const std::string_view word : machine::words_of(text)) {
    if (!first && column + 1 + word.size() + join.size() > kWidth) {
      lines += join + "\n" + std::string(indent, ' ');
      column = indent;
    } else if (!first) {
      lines += ' ';
      ++column;
    }
    lines += word;
    column += word.size();
    first = false;
  }
  return lines + "\n";
}

std::string fix_text(const machine::Fix& fix) {
  const std::string margin(kIndent, ' '), inner(kIndent + 2, ' ');
  std::string text = margin + "fix, " + fix.where + ":\n";
  const bool command = fix.where.rfind("shell", 0) == 0;
  machine::for_each_line(fix.text, [&](std::string_view line) {
    text += inner + wrapped(std::string(line), inner.size(), inner.size() + 2, command ? " \\" : "");
  });
  return text;
}

std::string finding_text(const Finding& finding) {
  const std::string head = fmt::format("  {:<8}", machine::to_string(finding.status));
  const std::string margin(kIndent, ' ');
  std::string text = head + wrapped(finding.name + ": " + finding.found, kIndent, kIndent);
  text += margin + wrapped(finding.meaning, kIndent, kIndent);
  for (const machine::Fix& fix : finding.fixes) text += fix_text(fix);
  return text;
}

long count(const std::vector<Finding>& findings, Status status) {
  return std::count_if(findings.begin(), findings.end(), [&](const Finding& f) { return f.status == status; });
}

}  // namespace

std::string doctor_text(const machine::Identity& machine, const std::vector<Finding>& findings) {
  std::string text = wrapped(
      fmt::format("{}, {} core{}, Linux {}", machine.cpu, machine.cores, machine.cores == 1 ? "" : "s", machine.kernel),
      0, 2);
  std::string group;
  for (const Finding& finding : findings) {
    if (finding.group != group) text += "\n" + finding.group + "\n";
    group = finding.group;
    text += finding_text(finding);
  }
  text += fmt::format("\n{} checks:", findings.size());
  for (const Status status : kStatuses)
    text +=
        fmt::format("{} {} {}", status == Status::ok ? "" : ",", count(findings, status), machine::to_string(status));
  return text + "\n";
}

Json doctor_json(const machine::Identity& machine, const std::vector<Finding>& findings) {
  Json checks = Json::array(), counts;
  for (const Finding& finding : findings) {
    Json fixes = Json::array();
    for (const machine::Fix& fix : finding.fixes) fixes.push_back({{"where", fix.where}, {"text", fix.text}});
    checks.push_back({{"group", finding.group},
                      {"name", finding.name},
                      {"status", machine::to_string(finding.status)},
                      {"found", finding.found},
                      {"meaning", finding.meaning},
                      {"fixes", std::move(fixes)}});
  }
  for (const Status status : kStatuses) counts[std::string(machine::to_string(status))] = count(findings, status);
  return {{"machine", graph::identity_json(machine)}, {"checks", std::move(checks)}, {"counts", std::move(counts)}};
}

std::string lacks_text(Policy policy, bool over_iceoryx) {
  const machine::SystemFacts facts;
  std::string text;
  for (const Finding& finding : machine::lacking(machine::examine(facts, machine::try_machine()), policy, over_iceoryx))
    text += finding_text(finding);
  return text;
}

}  // namespace takt::graph
