// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "graph/command/top/table.hpp"

namespace takt::top {
namespace {

constexpr size_t kBarCells = 8;
constexpr double kNear = 0.9;  ///< from that share of a limit on a figure is marked

Piece ms(double value, Style style = Style::plain) {
  return {std::abs(value) < 1000 ? fmt::format("{:.2f}", value) : fmt::format("{:.0f}", value), style};
}
Piece ms(std::optional<double> value) { return value ? ms(*value) : Piece{"-", Style::faint}; }

/// The largest one seen next to its limit: `!` marks what is above.
Piece judged(std::optional<double> most_ms, std::optional<double> limit_ms) {
  Piece piece = ms(most_ms);
  const bool above = most_ms && limit_ms && *most_ms > *limit_ms;
  const bool near = most_ms && limit_ms && *most_ms > kNear * *limit_ms;
  piece.text += above ? "!" : " ";
  if (most_ms) piece.style = above ? Style::bad : near ? Style::warning : Style::plain;
  return piece;
}

Piece share_bar(std::optional<double> part, std::optional<double> whole, const Look& look) {
  if (!part || !whole || *whole <= 0) return {"-", Style::faint};
  const double share = *part / *whole;
  return {bar(share, kBarCells, look), share > 1 ? Style::bad : share > kNear ? Style::warning : Style::good};
}

Piece count(uint64_t value) { return {fmt::format("{}", value), value == 0 ? Style::faint : Style::plain}; }
/// Of what should not happen.
Piece trouble(uint64_t value) { return {fmt::format("{}", value), value == 0 ? Style::faint : Style::bad}; }

Content content_of(const Table& table, const Fit& fit) {
  LaidOut laid = lay_out(table, fit.width, fit.columns, fit.look);
  return {{std::move(laid.header)}, std::move(laid.rows), laid.left, laid.right};
}

void add_words(std::vector<Line>& lines, std::string_view words, const Fit& fit, Style style = Style::faint) {
  for (std::string& line : wrapped(clean(words, fit.look), fit.width, 2)) lines.push_back({{std::move(line), style}});
}

std::string level_of(const NodeSeen& node) {
  return node.levels > 1 ? fmt::format("{}/{}", node.level, node.levels - 1) : "-";
}

}  // namespace

std::string bar(double share, size_t cells, const Look& look) {
  constexpr std::array<const char*, 8> kParts{"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  const double full = std::clamp(std::isfinite(share) ? share : 0.0, 0.0, 1.0) * static_cast<double>(cells);
  const auto whole = static_cast<size_t>(full);
  const auto eighths = static_cast<size_t>((full - static_cast<double>(whole)) * 8);
  std::string text = look.utf8 ? "▕" : "[";
  for (size_t i = 0; i < whole; ++i) text += look.utf8 ? "█" : "#";
  if (look.utf8 && whole < cells) text += kParts[eighths];
  if (share > 1) text += "!";
  const size_t used = width_of(text) - 1;
  text += std::string(used < cells + 1 ? cells + 1 - used : 0, ' ');
  return text + (look.utf8 ? "▏" : "]");
}

std::string_view name_of(Page page) {
  constexpr std::array<std::string_view, kPages> kNames{"nodes",     "chains", "timeline",  "devices",
                                                        "processes", "log",    "parameters"};
  return kNames[static_cast<size_t>(page)];
}

Content content(const Watched& run, Page page, const Fit& fit) {
  switch (page) {
    case Page::nodes: return nodes_page(run, fit);
    case Page::chains: return chains_page(run, fit);
    case Page::timeline: return timeline_page(run, fit);
    case Page::devices: return devices_page(run, fit);
    case Page::processes: return processes_page(run, fit);
    case Page::log: return log_page(run, fit);
    case Page::parameters: return parameters_page(run, fit);
  }
  return {};
}

Content nodes_page(const Watched& run, const Fit& fit) {
  Table table{{{"node"},
               {"Hz"},
               {"miss"},
               {"exec/budget", true},
               {"exec"},
               {"resp"},
               {"max "},
               {"proven"},
               {"deadline"},
               {"skip"},
               {"level"},
               {"budget"},
               {"over"},
               {"pause"},
               {"done"},
               {"criticality", true},
               {"process", true}},
              {}};
  for (const NodeSeen& node : run.nodes) {
    const bool late = node.deadline_misses > 0;
    table.rows.push_back({{clean((node.device ? "@" : "") + node.name, fit.look), late ? Style::bad : Style::strong},
                          {node.rate_hz ? fmt::format("{:g}", *node.rate_hz) : "on", Style::plain},
                          trouble(node.deadline_misses),
                          share_bar(node.exec_ms, node.budget_ms, fit.look),
                          ms(node.exec_ms),
                          ms(node.response_ms),
                          judged(node.response_max_ms, node.proven_ms),
                          ms(node.proven_ms),
                          ms(node.deadline_ms),
                          trouble(node.skipped),
                          {level_of(node), node.level > 0 ? Style::warning : Style::plain},
                          ms(node.budget_ms),
                          trouble(node.overruns),
                          count(node.paused),
                          count(node.completed),
                          {clean(node.criticality, fit.look), Style::plain},
                          {clean(node.process, fit.look), Style::faint}});
  }
  return content_of(table, fit);
}

Content chains_page(const Watched& run, const Fit& fit) {
  Table table{{{"chain"}, {"age"}, {"max "}, {"bound"}, {"proven"}, {"max/bound", true}, {"from", true}, {"to", true}},
              {}};
  for (const ChainSeen& chain : run.chains) {
    const double limit_ms = chain.proven_ms ? std::min(*chain.proven_ms, chain.bound_ms) : chain.bound_ms;
    table.rows.push_back({{clean(chain.name, fit.look), Style::strong},
                          ms(chain.age_ms),
                          judged(chain.age_max_ms, limit_ms),
                          ms(chain.bound_ms),
                          ms(chain.proven_ms),
                          share_bar(chain.age_max_ms, chain.bound_ms, fit.look),
                          {clean(chain.from, fit.look), Style::faint},
                          {clean(chain.to, fit.look), Style::faint}});
  }
  Content page = content_of(table, fit);
  if (run.chains.empty()) add_words(page.rows, "The graph names no chains.", fit);
  return page;
}

Content devices_page(const Watched& run, const Fit& fit) {
  Table table{{{"device"},
               {"state", true},
               {"lost"},
               {"received"},
               {"damaged"},
               {"missing"},
               {"resyncs"},
               {"unsent"},
               {"trouble", true}},
              {}};
  for (const DeviceSeen& device : run.devices)
    table.rows.push_back({{clean(device.name, fit.look), Style::strong},
                          {clean(device.state, fit.look), device.state == "ok" ? Style::good : Style::bad},
                          trouble(device.losses),
                          count(device.received),
                          trouble(device.damaged),
                          trouble(device.missing),
                          trouble(device.resyncs),
                          trouble(device.unsent),
                          {clean(device.trouble, fit.look), Style::warning}});
  Content page = content_of(table, fit);
  if (run.devices.empty()) add_words(page.rows, "The run has no devices.", fit);
  return page;
}

Content processes_page(const Watched& run, const Fit& fit) {
  Table table{{{"process"}, {"CPU"}, {"MB"}, {"restarts"}, {"state", true}, {"pid"}}, {}};
  for (const ProcessSeen& process : run.processes)
    table.rows.push_back({{clean(process.name, fit.look), Style::strong},
                          process.cpu ? Piece{fmt::format("{:.2f}", *process.cpu)} : Piece{"-", Style::faint},
                          {fmt::format("{:.1f}", process.own_mb)},
                          trouble(process.restarts),
                          {clean(process.state, fit.look), process.state == "running" ? Style::good : Style::warning},
                          {fmt::format("{}", process.pid), Style::faint}});
  Content page = content_of(table, fit);
  std::vector<Line> head;
  add_words(
      head,
      fmt::format("CPU {} cores, memory {:.0f} MB with what is shared, host stall {} ms since this command began",
                  run.use.cpu ? fmt::format("{:.2f}", *run.use.cpu) : "-", run.use.memory_mb, run.use.host_stall_ms),
      fit, Style::plain);
  page.head.insert(page.head.begin(), head.begin(), head.end());
  return page;
}

Content parameters_page(const Watched& run, const Fit& fit) {
  Content page;
  add_words(page.head, "Parameters that differ from the graph's file:", fit);
  for (const std::string& parameter : run.parameters) add_words(page.rows, parameter, fit, Style::plain);
  if (run.parameters.empty()) add_words(page.rows, "none", fit);
  return page;
}

Content help_page(const Fit& fit) {
  Content page;
  for (const std::string_view words : {
           "1 to 7, Tab, Shift-Tab: pages",
           "Up, Down, PageUp, PageDown, j, k, Space: rows; g, G, Home, End: first and last rows",
           "Left, Right, h, l: columns. The last line counts those out of sight: `< 1` on the left, `6 >` on the right",
           "q, Ctrl-C: end; Ctrl-Z: suspend; Ctrl-L: draw again; ?, Escape: leave this page",
           "",
           "Times are in ms. `@` marks a device, `on` a node that runs on the output of another one.",
           "`!` marks what is above its limit: an execution time above the budget, a response above its proof, an age "
           "above its bound or proof.",
           "exec, resp, age: of the last job. max: the largest of the run. miss: deadline misses. skip: releases "
           "without "
           "a job. over: budget overruns. pause: releases at which nothing asked for the node. level: 0 is the best "
           "quality.",
           "Timeline: the height of a sign is the share of the deadline that the response took. `!` is a job that "
           "ended "
           "after its deadline. Log: the newest event is the last.",
       })
    add_words(page.rows, words, fit, Style::plain);
  return page;
}

}  // namespace takt::top
