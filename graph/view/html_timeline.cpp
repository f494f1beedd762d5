// SPDX-License-Identifier: Apache-2.0
// Jobs of one second: above, what ran on each core; below, for each node its jobs between release and deadline.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "graph/view/diagram.hpp"
#include "graph/view/html_parts.hpp"
#include "graph/view/markup.hpp"
#include "graph/view/text_width.hpp"

namespace takt::view {
namespace {

constexpr double kPxPerMs = 1.25, kTop = 24, kLane = 20, kLaneGap = 6, kNodeRow = 26;
constexpr double kLeastPx = 1.5;     // a shorter job would not be seen
constexpr double kClockMs = 0.001;   // a job may seem to begin this much before the last one ended
constexpr double kLongestMs = 2000;  // what is recorded is one second and the jobs that began in it
constexpr double kLatestMs = 1e12;   // no time of a run is beyond: 30 years

struct Bar {
  std::string node;
  std::optional<int> cpu;
  std::optional<double> release_ms;
  double start_ms = 0, finish_ms = 0;
  size_t colour = 0;
};

class Timeline {
 public:
  Timeline(const Json& jobs, const graph::GraphSpec& graph) : graph_(graph) {
    for (const auto& device : graph.devices) row_of(device.id);
    for (const auto& node : graph.nodes) row_of(node.id);
    for (const Json& job : jobs) add(job);
    std::stable_sort(bars_.begin(), bars_.end(), [](const Bar& a, const Bar& b) { return a.start_ms < b.start_ms; });
    set_window();
    // Rows of what did no job in this second would only take space.
    std::erase_if(rows_, [&](const std::string& name) {
      return std::none_of(bars_.begin(), bars_.end(), [&](const Bar& bar) { return bar.node == name; });
    });
    for (const std::string& name : rows_) label_px_ = std::max(label_px_, text_width_px(name, 12) + 14);
  }

  bool empty() const { return bars_.empty(); }
  size_t not_drawn() const { return not_drawn_; }

  std::string draw() {
    const std::string cores = draw_cores(), nodes = draw_nodes();
    const double width = x(last_ms_) + 24;
    return fmt::format(
        "<div class=\"scroll\"><svg class=\"plot\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
        "{1:.0f}\" "
        "role=\"img\">\n{2}{3}{4}</svg></div>\n",
        width, y_ + 8, draw_axis(), cores, nodes);
  }

 private:
  size_t row_of(const std::string& name) {
    const auto found = std::find(rows_.begin(), rows_.end(), name);
    if (found == rows_.end()) rows_.push_back(name), colours_.emplace(name, colours_.size());
    return colours_.at(name);
  }

  void add(const Json& job) {
    const auto start = number(at(job, "start_ms")), finish = number(at(job, "finish_ms")), cpu = number(at(job, "cpu"));
    Bar bar;
    bar.node = words(at(job, "node"));
    if (bar.node.empty() || !start || !finish || *finish < *start || -*start > kLatestMs || *finish > kLatestMs) {
      ++not_drawn_;
      return;
    }
    bar.start_ms = *start;
    bar.finish_ms = *finish;
    if (const auto release = number(at(job, "release_ms")); release && *release <= *start && -*release <= kLatestMs)
      bar.release_ms = release;
    if (cpu && *cpu >= 0 && *cpu < 4096) bar.cpu = static_cast<int>(*cpu);
    bar.colour = row_of(bar.node);
    bars_.push_back(std::move(bar));
  }

  void set_window() {
    if (bars_.empty()) return;
    first_ms_ = last_ms_ = bars_.front().start_ms;
    for (const Bar& bar : bars_) {
      first_ms_ = std::min(first_ms_, bar.release_ms.value_or(bar.start_ms));
      last_ms_ = std::max(last_ms_, bar.finish_ms);
    }
    first_ms_ = std::floor(std::max(first_ms_, bars_.front().start_ms - kLongestMs) / 10) * 10;
    last_ms_ = std::min(last_ms_, first_ms_ + 2 * kLongestMs);
    not_drawn_ += std::erase_if(bars_, [&](const Bar& bar) { return bar.start_ms > last_ms_; });
    for (Bar& bar : bars_) bar.release_ms = bar.release_ms >= first_ms_ ? bar.release_ms : std::nullopt;
  }

  double x(double ms) const { return label_px_ + (ms - first_ms_) * kPxPerMs; }

  std::string draw_axis() const {
    std::string text;
    for (double ms = first_ms_; ms <= last_ms_; ms += 100)
      text += fmt::format(
          "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\"/><text x=\"{0:.1f}\" y=\"14\" "
          "text-anchor=\"middle\">{3:g} ms</text>\n",
          x(ms), kTop - 4, y_, ms - first_ms_);
    return text;
  }

  std::string draw_bar(const Bar& bar, double y, double height, bool named) const {
    const double left = x(bar.start_ms),
                 width = std::max(kLeastPx, (std::min(bar.finish_ms, last_ms_) - bar.start_ms) * kPxPerMs);
    std::string text = fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" style=\"fill:{}\"><title>{}: start {:.2f} "
        "ms, "
        "finish {:.2f} ms{}</title></rect>\n",
        left, y, width, height, node_colour(bar.colour), escape(bar.node), bar.start_ms - first_ms_,
        bar.finish_ms - first_ms_, bar.cpu ? fmt::format(", core {}", *bar.cpu) : "");
    if (named && text_width_px(bar.node, 10) + 6 < width)
      text += fmt::format("<text class=\"on-bar\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", left + 3, y + height - 6,
                          escape(bar.node));
    return text;
  }

  /// Jobs that share a core at one time (one preempted the other) stand in lanes of their own.
  std::string draw_core(const std::string& name, const std::vector<const Bar*>& bars) {
    std::vector<double> busy_until_ms;
    std::string text;
    for (const Bar* bar : bars) {
      size_t lane = 0;
      while (lane < busy_until_ms.size() && busy_until_ms[lane] > bar->start_ms + kClockMs) ++lane;
      if (lane == busy_until_ms.size()) busy_until_ms.push_back(0);
      busy_until_ms[lane] = bar->finish_ms;
      text += draw_bar(*bar, y_ + static_cast<double>(lane) * kLane, kLane - 2, true);
    }
    const double height = kLane * static_cast<double>(busy_until_ms.size());
    text = fmt::format("<rect class=\"lane\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                       x(first_ms_), y_, (last_ms_ - first_ms_) * kPxPerMs, height) +
           fmt::format("<text class=\"name\" x=\"0\" y=\"{:.1f}\">{}</text>\n", y_ + 14, name) + text;
    y_ += height + kLaneGap;
    return text;
  }

  std::string draw_cores() {
    std::map<std::optional<int>, std::vector<const Bar*>> by_core;
    for (const Bar& bar : bars_) by_core[bar.cpu].push_back(&bar);
    std::string text;
    for (const auto& [cpu, bars] : by_core) text += draw_core(cpu ? fmt::format("core {}", *cpu) : "core ?", bars);
    y_ += 12;
    return text;
  }

  /// The marks that real-time texts use: an arrow up at each release, an arrow down at its deadline.
  std::string draw_marks(const Bar& bar, double base) const {
    if (!bar.release_ms) return "";
    std::string text = fmt::format(
        "<path class=\"release\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><path class=\"release\" stroke=\"none\" d=\"M{0:.1f} "
        "{2:.1f}l-3 5h6z\"/>",
        x(*bar.release_ms), base, base - 20);
    const auto deadline = deadline_ns(graph_, bar.node);
    if (!deadline) return text + "\n";
    const double at_ms = *bar.release_ms + static_cast<double>(*deadline) / 1e6;
    if (at_ms > last_ms_) return text + "\n";
    const bool late = bar.finish_ms > at_ms;
    return text + fmt::format(
                      "<path class=\"{3}\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><path class=\"{3}\" stroke=\"none\" "
                      "d=\"M{0:.1f} {1:.1f}l-3 -5h6z\"/>\n",
                      x(at_ms), base, base - 20, late ? "late deadline" : "deadline");
  }

  std::string draw_nodes() {
    std::string text;
    for (const std::string& name : rows_) {
      const double base = y_ + kNodeRow - 4;
      text += fmt::format(
          "<text class=\"name\" x=\"0\" y=\"{0:.1f}\">{1}</text><line class=\"axis\" x1=\"{2:.1f}\" "
          "x2=\"{3:.1f}\" y1=\"{4:.1f}\" y2=\"{4:.1f}\"/>\n",
          base - 3, escape(name), x(first_ms_), x(last_ms_), base);
      for (const Bar& bar : bars_)
        if (bar.node == name) text += draw_bar(bar, base - 13, 13, false) + draw_marks(bar, base);
      y_ += kNodeRow;
    }
    return text;
  }

  const graph::GraphSpec& graph_;
  std::vector<Bar> bars_;
  std::vector<std::string> rows_;
  std::map<std::string, size_t> colours_;
  double first_ms_ = 0, last_ms_ = 0, label_px_ = 60, y_ = kTop;
  size_t not_drawn_ = 0;  ///< jobs without times, or far from the others
};

}  // namespace

std::string timeline_section(const Json& report, const graph::GraphSpec& graph) {
  constexpr const char* kTitle = "Timeline";
  const Json& jobs = at(report, "timeline");
  if (!jobs.is_array()) return section(kTitle, not_recorded());
  Timeline timeline(jobs, graph);
  if (timeline.empty()) return section(kTitle, note(jobs.empty() ? "no job in this second" : "no job with its times"));
  std::string body = timeline.draw();
  body += note(
      "Above: jobs on each core, preempted and preempting ones in lanes of their own. Below, for each node: arrow up, "
      "planned release; arrow down, deadline (red: missed); bar, start to finish.");
  if (timeline.not_drawn() > 0)
    body += note(
        fmt::format("{} jobs have no times, or times far from the others, and are not drawn.", timeline.not_drawn()));
  return section(kTitle, body);
}

}  // namespace takt::view
