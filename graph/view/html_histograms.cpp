// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "graph/view/html_parts.hpp"
#include "graph/view/markup.hpp"

namespace takt::view {
namespace {

constexpr double kWidth = 360, kHeight = 150, kLeft = 34, kRight = 8, kTop = 8, kBottom = 30;

constexpr double kBarsPerDecade = 10;  // finer buckets are drawn together

struct Bucket {
  double low_us, high_us, count;
};

/// Buckets so fine that bars would be too thin are added up into bars of equal width.
std::vector<Bucket> coarser(const std::vector<Bucket>& buckets) {
  std::vector<Bucket> bars;
  for (const Bucket& bucket : buckets) {
    if (bucket.high_us <= 0) continue;
    const double bar = std::ceil(std::log10(bucket.high_us) * kBarsPerDecade - 1e-9);
    const Bucket wide{std::pow(10, (bar - 1) / kBarsPerDecade), std::pow(10, bar / kBarsPerDecade), bucket.count};
    if (!bars.empty() && bars.back().high_us == wide.high_us) bars.back().count += bucket.count;
    else bars.push_back(wide);
  }
  return bars;
}

/// Buckets of one node as they are drawn, in ascending order; what is no [number, number] is left out. Empty buckets
/// may be missing in the report, so how wide a bucket is follows from the nearest two edges.
std::vector<Bucket> buckets_of(const Json& node) {
  std::vector<Bucket> buckets;
  for (const Json& entry : at(node, "lateness_histogram_us")) {
    if (!entry.is_array() || entry.size() != 2) continue;
    const auto edge = number(entry[0]), count = number(entry[1]);
    if (edge && count && *count >= 0) buckets.push_back({0, *edge, *count});
  }
  std::sort(buckets.begin(), buckets.end(), [](const Bucket& a, const Bucket& b) { return a.high_us < b.high_us; });
  double finest = 1e300;
  for (size_t i = 1; i < buckets.size(); ++i)
    if (buckets[i - 1].high_us > 0 && buckets[i].high_us > buckets[i - 1].high_us)
      finest = std::min(finest, buckets[i].high_us / buckets[i - 1].high_us);
  if (finest >= 1e300 || finest < std::pow(10, 1 / kBarsPerDecade)) return coarser(buckets);
  for (size_t i = 0; i < buckets.size(); ++i)
    buckets[i].low_us = std::max(i > 0 ? buckets[i - 1].high_us : 0, buckets[i].high_us / finest);
  std::erase_if(buckets, [](const Bucket& bucket) { return bucket.count == 0; });
  return buckets;
}

/// Both axes logarithmic, in whole decades, the same for all nodes.
struct Axes {
  double low_decade = 0, high_decade = 1;  ///< of lateness, us
  double count_decades = 1;

  double x(double us) const {
    const double decade = std::clamp(us > 0 ? std::log10(us) : low_decade, low_decade, high_decade);
    return kLeft + (kWidth - kLeft - kRight) * (decade - low_decade) / (high_decade - low_decade);
  }
  /// A single job stands a little above the base line.
  double y(double count) const {
    const double share = (std::log10(std::max(1.0, count)) + 0.15) / (count_decades + 0.15);
    return kHeight - kBottom - (kHeight - kTop - kBottom) * share;
  }
};

Axes axes_of(const Json& nodes) {
  double low = 1e300, high = 0, most = 1;
  for (const Json& node : nodes)
    for (const Bucket& bucket : buckets_of(node)) {
      if (bucket.high_us > 0) low = std::min(low, bucket.low_us > 0 ? bucket.low_us : bucket.high_us / 2);
      high = std::max(high, bucket.high_us);
      most = std::max(most, bucket.count);
    }
  Axes axes;
  if (high <= 0) return axes;
  axes.low_decade = std::floor(std::log10(low));
  axes.high_decade = std::max(axes.low_decade + 1, std::ceil(std::log10(high)));
  axes.count_decades = std::max(1.0, std::ceil(std::log10(most)));
  return axes;
}

std::string time_label(double us) {
  if (us >= 1e6) return fmt::format("{:.3g} s", us / 1e6);
  if (us >= 1e3) return fmt::format("{:.3g} ms", us / 1e3);
  return fmt::format("{:.3g} µs", us);
}

std::string grid(const Axes& axes) {
  std::string text;
  const double base = kHeight - kBottom;
  for (double decade = axes.low_decade; decade <= axes.high_decade; ++decade) {
    const double x = axes.x(std::pow(10, decade));
    const char* anchor = decade == axes.high_decade ? "end" : decade == axes.low_decade ? "start" : "middle";
    text += fmt::format("<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", x, kTop, base);
    text += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"{}\">{}</text>", x, base + 14, anchor,
                        time_label(std::pow(10, decade)));
  }
  for (double decade = 0; decade <= axes.count_decades; ++decade) {
    const double y = axes.y(std::pow(10, decade));
    text += fmt::format("<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>", kLeft,
                        kWidth - kRight, y);
    text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:g}</text>", kLeft - 5, y + 4,
                        std::pow(10, decade));
  }
  return text + fmt::format("<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/>", kLeft,
                            kWidth - kRight, base);
}

std::string bars(const Axes& axes, const std::vector<Bucket>& buckets) {
  std::string text;
  for (const Bucket& bucket : buckets) {
    const double left = axes.x(bucket.low_us), y = axes.y(bucket.count);
    text += fmt::format(
        "<rect class=\"bar\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"><title>up to {}: {:.0f} "
        "jobs</title></rect>\n",
        left, y, std::max(1.0, axes.x(bucket.high_us) - left), kHeight - kBottom - y, time_label(bucket.high_us),
        bucket.count);
  }
  return text;
}

std::string quantile_lines(const Axes& axes, const Json& lateness) {
  std::string text;
  for (const char* key : {"p50", "p99"})
    if (const auto us = number(at(lateness, key)); us && *us > 0)
      text += fmt::format(
          "<line class=\"quantile\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"{3}><title>{4} "
          "{5}</title></line>\n",
          axes.x(*us), kTop, kHeight - kBottom, std::string_view(key) == "p99" ? " stroke-dasharray=\"3 3\"" : "", key,
          time_label(*us));
  return text;
}

std::string chart(const Axes& axes, const Json& node) {
  const std::vector<Bucket> buckets = buckets_of(node);
  const Json& lateness = at(node, "lateness_us");
  std::string text = fmt::format("<div class=\"chart\"><h3>{}</h3>\n", escape(words(at(node, "name"))));
  if (!at(node, "lateness_histogram_us").is_array()) return text + not_recorded() + "</div>\n";
  if (buckets.empty()) return text + note("no sample") + "</div>\n";
  text += fmt::format("<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\">\n{}\n{}{}</svg>\n", kWidth, kHeight,
                      grid(axes), bars(axes, buckets), quantile_lines(axes, lateness));
  return text +
         note(fmt::format("p50 {}, p99 {}, max {} µs", figure(at(lateness, "p50"), "{:.0f}"),
                          figure(at(lateness, "p99"), "{:.0f}"), figure(at(lateness, "max"), "{:.0f}"))) +
         "</div>\n";
}

}  // namespace

std::string histograms_section(const Json& report) {
  constexpr const char* kTitle = "Lateness";
  const Json& nodes = at(report, "nodes");
  const bool any = std::any_of(nodes.begin(), nodes.end(),
                               [](const Json& node) { return at(node, "lateness_histogram_us").is_array(); });
  if (!any) return section(kTitle, not_recorded());
  const Axes axes = axes_of(nodes);
  std::string body = note(
                         "Planned release to start, jobs per bucket; both axes logarithmic and the same for all nodes. "
                         "Lines: p50, p99 dashed.") +
                     "<div class=\"charts\">\n";
  for (const Json& node : nodes) body += chart(axes, node);
  return section(kTitle, body + "</div>\n");
}

}  // namespace takt::view
