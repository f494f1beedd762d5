// SPDX-License-Identifier: Apache-2.0
#include "graph/explain/miss_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "graph/explain/sentence.hpp"
#include "graph/view/markup.hpp"
#include "graph/view/text_width.hpp"

namespace takt::explain {
namespace {

using trace::Cause;
using trace::Piece;

constexpr double kWidth = 1000, kRow = 30, kBar = 20, kTop = 66, kRight = 20;
constexpr double kLeastPx = 0.75;  // a shorter stretch would not be seen

const char* colour(Cause cause) {
  switch (cause) {
    case Cause::running: return "#4c78a8";
    case Cause::late: return "#c9b27c";
    case Cause::behind: return "#e0a526";
    case Cause::lane: return "#a5801c";
    case Cause::queue: return "#8a6d1a";
    case Cause::preempted: return "#e45756";
    case Cause::throttled: return "#9d5bb5";
    case Cause::asleep: return "#72b7b2";
    case Cause::stall: return "#54382f";
    default: return "#9a9a9a";
  }
}

class MissPicture {
 public:
  MissPicture(const trace::Evidence& evidence, const trace::JobSpan& job)
      : evidence_(evidence), trace_(evidence.trace()), job_(job), pieces_(trace::course(evidence, job)) {
    const int64_t end = std::max(job.published_ns, job.deadline_ns), begin = std::min(job.release_ns, job.start_ns);
    const int64_t margin = std::max<int64_t>((end - begin) / 12, 100'000);
    first_ns_ = begin - margin;
    last_ns_ = end + margin;
    label_px_ = std::max(view::text_width_px(node(), 12) + 24, 70.0);
  }

  std::string draw() {
    std::string body = draw_row(node(), pieces_, true);
    std::set<int> cpus;
    if (trace::knows_every_cpu(trace_.source))
      for (const trace::Slice& slice : trace_.slices) cpus.insert(slice.cpu);
    for (const int cpu : cpus)
      body += draw_row(fmt::format("CPU {}", cpu), evidence_.occupants(cpu, first_ns_, last_ns_), false);
    const std::string marks =
        draw_instant(job_.release_ns, "release", "#2a7d2a") + draw_instant(job_.deadline_ns, "deadline", "#c00000");
    const std::string key = draw_key();
    const double height = y_ + 8;
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
        "{1:.0f}\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        "<text x=\"8\" y=\"18\" font-size=\"13\">{2}</text>\n{3}{4}{5}{6}</svg>\n",
        kWidth, height, view::escape(title()), draw_axis(), body, marks, key);
  }

 private:
  const std::string& node() const { return trace_.tasks[job_.task].name; }

  std::string title() const {
    return fmt::format("{} job {}: published {:.2f} ms {} its deadline", node(), job_.job,
                       std::abs(static_cast<double>(job_.published_ns - job_.deadline_ns)) / 1e6,
                       job_.published_ns > job_.deadline_ns ? "after" : "before");
  }

  double x(int64_t ns) const {
    return label_px_ +
           (static_cast<double>(ns) - static_cast<double>(first_ns_)) / span_ns() * (kWidth - label_px_ - kRight);
  }

  /// In double: a file may hold any instants.
  double span_ns() const { return static_cast<double>(last_ns_) - static_cast<double>(first_ns_); }

  std::string draw_bar(const Piece& piece, bool of_job) {
    const double left = x(piece.from_ns), width = std::max(kLeastPx, x(piece.to_ns) - left);
    const bool own = piece.who == node();
    const std::string words = of_job ? cause_text(piece.cause, piece.who, piece.cpu, node()) : piece.who;
    const std::string fill = of_job ? colour(piece.cause) : own ? colour(Cause::running) : "#c9c9c9";
    if (of_job) used_.emplace(fill, words);
    std::string text = fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\" stroke=\"#fff\" "
        "stroke-width=\"0.3\"><title>{}, {:.3f} ms</title></rect>\n",
        left, y_, width, kBar, fill, view::escape(words), static_cast<double>(piece.to_ns - piece.from_ns) / 1e6);
    const std::string label =
        of_job ? fmt::format("{:.1f}", static_cast<double>(piece.to_ns - piece.from_ns) / 1e6) : piece.who;
    if (view::text_width_px(label, 11) + 6 < width)
      text += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"11\" fill=\"{}\">{}</text>\n", left + 3, y_ + 14,
                          of_job || own ? "#fff" : "#222", view::escape(label));
    return text;
  }

  std::string draw_row(const std::string& name, const std::vector<Piece>& pieces, bool of_job) {
    std::string text = fmt::format("<text x=\"8\" y=\"{:.1f}\">{}</text>\n", y_ + 14, view::escape(name));
    for (const Piece& piece : pieces) text += draw_bar(piece, of_job);
    y_ += kRow;
    return text;
  }

  std::string draw_instant(int64_t ns, const char* name, const char* ink) const {
    return fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2:.1f}\" stroke=\"{3}\" stroke-width=\"1.5\"/><text "
        "x=\"{0:.1f}\" y=\"{4}\" text-anchor=\"middle\" fill=\"{3}\" font-size=\"11\">{5}</text>\n",
        x(ns), kTop - 10, y_, ink, kTop - 14, name);
  }

  /// Times after the release, at steps of 1, 2 or 5 of a decade.
  std::string draw_axis() const {
    const double span_ms = span_ns() / 1e6;
    double step_ms = std::pow(10, std::floor(std::log10(span_ms / 8)));
    while (span_ms / step_ms > 16) step_ms *= 2;
    std::string text;
    for (double at = 0; at * 1e6 + static_cast<double>(job_.release_ns) < static_cast<double>(last_ns_); at += step_ms)
      text += fmt::format(
          "<text x=\"{:.1f}\" y=\"36\" text-anchor=\"middle\" font-size=\"10\" fill=\"#666\">{:g} ms</text>\n",
          x(job_.release_ns + std::llround(at * 1e6)), at);
    return text;
  }

  std::string draw_key() {
    std::string text;
    double at = 8;
    for (const auto& [fill, words] : used_) {
      const double width = view::text_width_px(words, 11) + 34;
      if (at + width > kWidth) at = 8, y_ += 18;
      text += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"10\" height=\"10\" fill=\"{}\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
          "font-size=\"11\">{}</text>\n",
          at, y_ + 2, fill, at + 14, y_ + 11, view::escape(words));
      at += width;
    }
    y_ += 20;
    return text;
  }

  const trace::Evidence& evidence_;
  const trace::Trace& trace_;
  const trace::JobSpan& job_;
  const std::vector<Piece> pieces_;
  int64_t first_ns_ = 0, last_ns_ = 0;
  double label_px_ = 0, y_ = kTop;
  std::set<std::pair<std::string, std::string>> used_;  ///< colour, words
};

}  // namespace

std::string miss_svg(const trace::Evidence& evidence, const trace::JobSpan& job) {
  return MissPicture(evidence, job).draw();
}

}  // namespace takt::explain
