// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "graph/view/html_parts.hpp"
#include "graph/view/markup.hpp"

namespace takt::view {
namespace {

std::string or_not_recorded(const std::string& text) { return text.empty() ? "not recorded" : text; }

/// What the kernel granted, and for how many nodes it was read back.
std::string policy_text(const Json& report) {
  const std::string granted = words(at(report, "policy_granted")), asked = words(at(report, "policy_asked"));
  if (granted.empty()) return "not recorded";
  if (words(at(report, "clock")) == "virtual")
    return fmt::format("{} simulated, durations {}", words(at(report, "simulated", "policy")),
                       or_not_recorded(words(at(report, "simulated", "durations"))));
  const Json& nodes = at(report, "nodes");
  const auto verified = std::count_if(nodes.begin(), nodes.end(),
                                      [](const Json& node) { return at(node, "granted", "verified") == true; });
  const Json& anticipate_us = at(report, "anticipate_us");
  const std::string early =
      anticipate_us.is_number() ? fmt::format("; woken up to {} us early", anticipate_us.get<double>()) : "";
  return fmt::format("{} granted (asked {}), {}: read back for {} of {} nodes{}", granted, or_not_recorded(asked),
                     static_cast<size_t>(verified) == nodes.size() && !nodes.empty() ? "verified" : "not verified",
                     verified, nodes.size(), early);
}

std::string machine_text(const Json& machine) {
  if (!machine.is_object()) return "not recorded";
  std::string text;
  for (const auto& [key, value] : machine.items())
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", key, value.is_string() ? words(value) : value.dump());
  return text;
}

std::string list_text(const Json& lines, const char* none) {
  if (!lines.is_array()) return "not recorded";
  if (lines.empty()) return none;
  std::string text = "<ul>";
  for (const Json& line : lines)
    text += "<li>" + escape(line.is_object() ? words(at(line, "what")) : words(line)) + "</li>";
  return text + "</ul>";
}

std::string modes_text(const Json& modes) {
  std::string text;
  for (const Json& mode : modes) {
    const double from_s = number(at(mode, "from_s")).value_or(0);
    text += (text.empty() ? "" : ", ") + words(mode.is_object() ? at(mode, "name") : mode);
    if (from_s > 0) text += fmt::format(" from {:.3f} s ({})", from_s, words(at(mode, "reason")));
  }
  return or_not_recorded(text);
}

std::string fact(const char* what, const std::string& html) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", what, html);
}

std::string with_unit(const Json& value, const char* format) {
  return number(value) ? figure(value, format) : "not recorded";
}

/// A line for each row of that cause.
std::string above_text(const Json& proofs, bool unexplained) {
  std::string text;
  if (const Json& rows = at(proofs, "above_proof"); rows.is_array())
    for (const Json& row : rows)
      if ((at(row, "cause") == "unexplained") == unexplained)
        text += fmt::format("<br>{} {} ms, proven {} ms, {} of {}: {}", escape(words(at(row, "what"))),
                            figure(at(row, "observed_ms"), "{:.3f}"), figure(at(row, "proven_ms"), "{:.3f}"),
                            count_text(at(row, "samples_above")), count_text(at(row, "of")),
                            escape(words(at(row, "cause"))));
  return text;
}

std::string verdict(const Json& report) {
  const Json& ok = at(report, "ok");
  if (!ok.is_boolean()) return "<p class=\"note\">ok or not: not recorded</p>\n";
  if (ok.get<bool>()) return "<p><span class=\"verdict\">ok</span></p>\n";
  const std::string above = above_text(at(report, "proofs"), true);
  return "<p><span class=\"verdict broken\">NOT OK</span> " +
         (above.empty() ? "a high-criticality deadline was missed or a node fell behind" : "not as proven:" + above) +
         "</p>\n";
}

std::string proofs_text(const Json& proofs) {
  const std::string verdict = words(at(proofs, "verdict"));
  if (verdict == "none") return "none: " + escape(words(at(proofs, "why")));
  return escape(or_not_recorded(verdict)) + above_text(proofs, false);
}

}  // namespace

std::string head_section(const Json& report, const graph::GraphSpec& graph) {
  const std::string name = words(at(report, "graph"));
  std::string text = fmt::format("<header>\n<h1>{} on {}</h1>\n", escape(name.empty() ? graph.name : name),
                                 escape(or_not_recorded(words(at(report, "schedule")))));
  text += verdict(report);
  text += "<dl>\n";
  text += fact("profile", escape(or_not_recorded(words(at(report, "profile")))));
  text += fact("mode", escape(modes_text(at(report, "modes"))));
  text += fact("policy", escape(policy_text(report)));
  text += fact("duration", with_unit(at(report, "duration_s"), "{:.1f} s"));
  text += fact("clock, transport", escape(or_not_recorded(words(at(report, "clock"))) + ", " +
                                          or_not_recorded(words(at(report, "transport")))));
  text += fact("machine", escape(machine_text(at(report, "machine"))));
  text += fact("host stall", with_unit(at(report, "host_stall_ms"), "{:.0f} ms taken by the host in the whole run"));
  text += fact("proofs", proofs_text(at(report, "proofs")));
  text += fact("recorder lost", with_unit(at(report, "recorder_lost"), "{:.0f} records"));
  text += fact("adjusted", list_text(at(report, "adjusted"), "nothing: it ran as the files say"));
  text += fact("faults", list_text(at(report, "faults"), "none"));
  text += fact("commit", escape(or_not_recorded(words(at(report, "commit")))));
  return text + "</dl>\n</header>\n";
}

}  // namespace takt::view
