// SPDX-License-Identifier: Apache-2.0
// The page of the last seconds: a row for each node, a character for each stretch of time.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "graph/command/top/pages.hpp"

namespace takt::top {
namespace {

constexpr size_t kShortestName = 8;

struct Stretch {
  bool any = false;
  double share = 0;  ///< of the deadline that a response took, the largest one
};

/// `cells` stretches of equal length; `now_s` lies in the last one.
std::vector<Stretch> stretches(const NodeSeen& node, double now_s, size_t cells) {
  std::vector<Stretch> all(cells);
  const double length_s = kHistory_s / static_cast<double>(cells);
  // Stretches begin at multiples of their length, so that a job keeps its place among others while all move on.
  const double begin_s = std::ceil(now_s / length_s) * length_s - kHistory_s;
  const auto cell_of = [&](double at_s) {
    const double cell = std::floor((at_s - begin_s) / length_s);
    return static_cast<size_t>(std::clamp(cell, 0.0, static_cast<double>(cells - 1)));
  };
  for (const JobSeen& job : node.jobs) {
    if (job.finish_s < begin_s || job.start_s > now_s) continue;
    const double share = (job.finish_s - job.release_s) * 1e3 / node.deadline_ms;
    for (size_t c = cell_of(job.start_s); c <= cell_of(job.finish_s); ++c)
      all[c] = {true, std::max(all[c].share, share)};
  }
  return all;
}

std::string sign_of(const Stretch& stretch, const Look& look) {
  constexpr std::array<const char*, 8> kHeights{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::array<const char*, 4> kPlain{".", ":", "|", "#"};
  if (stretch.share > 1) return "!";
  if (!stretch.any) return " ";
  const double share = std::clamp(stretch.share, 0.0, 0.999);
  return look.utf8 ? kHeights[static_cast<size_t>(share * 8)] : kPlain[static_cast<size_t>(share * 4)];
}

/// Neighbours of one style are one piece.
Line row_of(const NodeSeen& node, const std::string& name, double now_s, size_t cells, const Look& look) {
  Line line{{name, Style::strong}, {node.jobs_unseen ? "~" : " ", Style::warning}};
  for (const Stretch& stretch : stretches(node, now_s, cells)) {
    const Style style = stretch.share > 1 ? Style::bad : Style::good;
    if (line.size() < 3 || line.back().style != style) line.push_back({"", style});
    line.back().text += sign_of(stretch, look);
  }
  return line;
}

/// "-10 s" at the left, "now" at the right, seconds between where there is room.
std::string axis(size_t cells) {
  std::string text(cells, ' ');
  const auto put = [&](size_t at, std::string_view words) {
    if (at + words.size() <= cells) text.replace(at, words.size(), words);
  };
  put(0, fmt::format("-{:.0f} s", kHistory_s));
  if (cells >= 24) put(cells / 2, fmt::format("-{:.0f} s", kHistory_s / 2));
  if (cells >= 3) put(cells - 3, "now");
  return text;
}

}  // namespace

Content timeline_page(const Watched& run, const Fit& fit) {
  size_t name_width = kShortestName;
  bool unseen = false;
  for (const NodeSeen& node : run.nodes) {
    name_width = std::max(name_width, width_of(clean(node.name, fit.look)) + (node.device ? 1 : 0));
    unseen = unseen || node.jobs_unseen;
  }
  name_width = std::min(name_width, std::max(kShortestName, fit.width / 4));
  const size_t cells = fit.width > name_width + 1 ? fit.width - name_width - 1 : 1;
  Content page;
  std::string words =
      fmt::format("One column is {:.0f} ms; `!` is a late job.", kHistory_s * 1e3 / static_cast<double>(cells));
  if (unseen) words += " Of a node with `~` some jobs are missing: it has more than the run keeps for a look.";
  for (std::string& line : wrapped(words, fit.width)) page.head.push_back({{std::move(line), Style::faint}});
  page.head.push_back({{std::string(name_width + 1, ' '), Style::plain}, {axis(cells), Style::faint}});
  for (const NodeSeen& node : run.nodes) {
    const std::string name = shortened(clean((node.device ? "@" : "") + node.name, fit.look), name_width, fit.look);
    page.rows.push_back(row_of(node, left_aligned(name, name_width), run.running_s, cells, fit.look));
  }
  return page;
}

}  // namespace takt::top
