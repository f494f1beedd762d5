// SPDX-License-Identifier: Apache-2.0
// The page of events. A text that is wider than the window goes on in the next line: nothing of it is left out.
#include <fmt/format.h>

#include "graph/command/top/pages.hpp"

namespace takt::top {
namespace {

constexpr size_t kWide = 60;    ///< from that width on texts stand in a column of their own
constexpr size_t kIndent = 21;  ///< of that column
constexpr size_t kNarrowIndent = 2;

Style style_of(const EventSeen& event) {
  if (event.kind == "fault" || event.kind == "outage" || event.level == "error") return Style::bad;
  if (event.kind == "mode" || event.kind == "frozen" || event.level == "warning") return Style::warning;
  if (event.level == "debug") return Style::faint;
  return event.kind == "mark" ? Style::strong : Style::plain;
}

}  // namespace

Content log_page(const Watched& run, const Fit& fit) {
  Content page;
  if (run.events_left_out > 0)
    page.head.push_back({{fmt::format("{} older left out", run.events_left_out), Style::faint}});
  for (const EventSeen& event : run.events) {
    const std::string text = clean(event.node.empty() ? event.text : event.node + ": " + event.text, fit.look);
    const std::string kind = clean(event.level.empty() ? event.kind : event.level, fit.look);
    const std::string words = fit.width >= kWide ? fmt::format("{:>8.1f} s {:<9} {}", event.at_s, kind, text)
                                                 : fmt::format("{:.1f} s {} {}", event.at_s, kind, text);
    for (std::string& line : wrapped(words, fit.width, fit.width >= kWide ? kIndent : kNarrowIndent))
      page.rows.push_back({{std::move(line), style_of(event)}});
  }
  if (run.events.empty()) page.rows.push_back({{"nothing so far", Style::faint}});
  return page;
}

}  // namespace takt::top
