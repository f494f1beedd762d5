// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "graph/view/graph_pictures.hpp"
#include "graph/view/layout.hpp"
#include "graph/view/markup.hpp"
#include "graph/view/text_width.hpp"

namespace takt::view {
namespace {

constexpr double kPageMargin = 24, kHeading = 62, kLine = 20;
constexpr double kLeastScale = 0.7;  // in a page narrower than this the picture scrolls, so that it stays legible

// Each rule names its colour outright, because not every SVG viewer knows variables. Those of the edges (t0..t9, by
// message type) are of middle lightness: they are legible on both backgrounds.
constexpr const char* kStyle = R"(
.takt-graph text { font-family: Helvetica, Arial, "DejaVu Sans", sans-serif; fill: #1c2733; }
.takt-graph .page { fill: #ffffff; }
.takt-graph .room rect { fill: #f3f5f8; stroke: #c9d1da; }
.takt-graph .room text, .takt-graph .soft { fill: #5b6876; }
.takt-graph .frame { fill: #ffffff; stroke: #8896a5; stroke-width: 1.2; }
.takt-graph .device .frame { fill: #e8f0f8; }
.takt-graph .rule { stroke: #d5dce4; }
.takt-graph .mark { fill: #c8541b; }
.takt-graph .unread { fill: #8b96a3; }
.takt-graph .join { fill: none; stroke: #8896a5; stroke-width: 1.2; }
.takt-graph .edge path { fill: none; stroke-width: 1.6; }
.takt-graph .edge polygon { stroke: none; }
.takt-graph .releases path { stroke-width: 3; }
.takt-graph .edge:hover path { stroke-width: 4; }
.takt-graph .t0 { stroke: #2f7ed8; fill: #2f7ed8; } .takt-graph .t1 { stroke: #d07414; fill: #d07414; }
.takt-graph .t2 { stroke: #2a9d5c; fill: #2a9d5c; } .takt-graph .t3 { stroke: #b5559f; fill: #b5559f; }
.takt-graph .t4 { stroke: #cf4a3c; fill: #cf4a3c; } .takt-graph .t5 { stroke: #7d67d3; fill: #7d67d3; }
.takt-graph .t6 { stroke: #94781f; fill: #94781f; } .takt-graph .t7 { stroke: #1593a1; fill: #1593a1; }
.takt-graph .t8 { stroke: #71839a; fill: #71839a; } .takt-graph .t9 { stroke: #a86642; fill: #a86642; }
@media screen and (prefers-color-scheme: dark) {
.takt-graph text { fill: #e3e8ee; }
.takt-graph .page { fill: #14181d; }
.takt-graph .room rect { fill: #1b2128; stroke: #37424e; }
.takt-graph .room text, .takt-graph .soft { fill: #9aa7b5; }
.takt-graph .frame { fill: #242c35; stroke: #66747f; }
.takt-graph .device .frame { fill: #1f3042; }
.takt-graph .rule { stroke: #3a4550; }
.takt-graph .mark { fill: #f08a4b; }
.takt-graph .unread { fill: #6f7c89; }
}
)";
constexpr int kColours = 10;

std::string text_at(double x, double y, double size, std::string_view text, std::string_view attributes = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\"{}{}>{}</text>\n", x, y, size,
                     attributes.empty() ? "" : " ", attributes, escape(text));
}

class Drawing {
 public:
  explicit Drawing(const Diagram& diagram) : diagram_(diagram), layout_(lay_out(diagram)) {
    std::set<std::string> types;
    for (const DiagramEdge& edge : diagram.edges) types.insert(diagram.type_of(edge));
    for (const std::string& type : types) colour_.emplace(type, static_cast<int>(colour_.size()) % kColours);
  }

  std::string draw() {
    const std::string below = notes(kHeading + layout_.height + 34);
    std::string body = heading();
    body += fmt::format("<g transform=\"translate(0 {})\">\n", kHeading);
    for (size_t room = 0; room < diagram_.rooms.size(); ++room) body += draw_room(room);
    for (size_t edge = 0; edge < diagram_.edges.size(); ++edge) body += draw_edge(edge);
    for (size_t box = 0; box < diagram_.boxes.size(); ++box) body += draw_box(box);
    body += "</g>\n" + below;
    const double width = std::max(layout_.width, text_right_) + 2 * kPageMargin,
                 height = text_bottom_ + 2 * kPageMargin;
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"takt-graph\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
        "viewBox=\"0 0 {0:.0f} {1:.0f}\" role=\"img\" style=\"min-width:{6:.0f}px\">\n<title>graph "
        "{2}</title>\n<style>{3}</style>\n"
        "<rect class=\"page\" width=\"100%\" height=\"100%\"/>\n<g transform=\"translate({4} "
        "{4})\">\n{5}</g>\n</svg>\n",
        width, height, escape(diagram_.name), kStyle, kPageMargin, body, kLeastScale * width);
  }

 private:
  std::string line(double x, double y, double size, std::string_view text, std::string_view attributes = "") {
    text_right_ = std::max(text_right_, x + text_width_px(text, size, true));
    text_bottom_ = std::max(text_bottom_, y);
    return text_at(x, y, size, text, attributes);
  }

  std::string heading() {
    return line(0, 18, 20, diagram_.name, "font-weight=\"bold\"") +
           line(0, 38, kTextPx, diagram_.subtitle, "class=\"soft\"");
  }

  std::string draw_room(size_t room) const {
    const Rect& r = layout_.rooms[room];
    if (r.width <= 0) return "";
    return fmt::format(
               "<g class=\"room\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" rx=\"8\"/>\n", r.x,
               r.y, r.width, r.height) +
           text_at(r.x + kRoomPadding, r.y + 20, kTitlePx - 1, diagram_.rooms[room], "font-weight=\"bold\"") + "</g>\n";
  }

  std::string draw_edge(size_t e) const {
    const DiagramEdge& edge = diagram_.edges[e];
    const DiagramInput& input = diagram_.input_of(edge);
    const std::string& type = diagram_.type_of(edge);
    std::string path, latch = input.latch_text();
    for (const Curve& c : layout_.edges[e]) {
      if (path.empty()) path = fmt::format("M{:.1f} {:.1f}", c.from.x, c.from.y);
      path += fmt::format(" C{:.1f} {:.1f} {:.1f} {:.1f} {:.1f} {:.1f}", c.control_from.x, c.control_from.y,
                          c.control_to.x, c.control_to.y, c.to.x, c.to.y);
    }
    const Point tip = layout_.edges[e].back().to;
    return fmt::format(
        "<g class=\"edge{}\" data-from=\"{}\" data-to=\"{}\" data-type=\"{}\"><title>{}</title>\n"
        "<path class=\"t{}\" d=\"{}\"/>\n"
        "<polygon class=\"t{}\" points=\"{:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f}\"/></g>\n",
        input.releases ? " releases" : "", escape(diagram_.from_text(edge)), escape(diagram_.to_text(edge)),
        escape(type),
        escape(fmt::format("{} -> {}: {}{}{}{}", diagram_.from_text(edge), diagram_.to_text(edge), type,
                           latch.empty() ? "" : ", ", latch, input.releases ? ", releases the reader" : "")),
        colour_.at(type), path, colour_.at(type), tip.x, tip.y - 4, tip.x + kArrowLength, tip.y, tip.x, tip.y + 4);
  }

  std::string draw_box(size_t b) const {
    const DiagramBox& box = diagram_.boxes[b];
    const Rect& r = layout_.boxes[b];
    const double left = r.x + kBoxMargin, right = r.right() - kBoxMargin;
    std::string text = fmt::format(
        "<g class=\"box {}\" data-id=\"{}\" data-criticality=\"{}\">\n<rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" "
        "width=\"{:.1f}\" height=\"{:.1f}\" rx=\"5\"/>\n",
        box.device ? "device" : "node", escape(box.id), box.high ? "high" : "low", r.x, r.y, r.width, r.height);
    text += text_at(left, r.y + 20, kTitlePx, box.id, "font-weight=\"bold\"");
    if (box.high) text += high_mark(r);
    text += text_at(left, r.y + 37, kTextPx, box.type + ", " + box.release, "class=\"soft\"");
    text += text_at(left, r.y + 53, kTextPx, box.times, "class=\"soft\"");
    if (box.inputs.empty() && box.outputs.empty()) return text + "</g>\n";
    text += fmt::format("<line class=\"rule\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n", r.x + 1,
                        r.y + kHeaderHeight, r.right() - 1, r.y + kHeaderHeight);
    for (size_t i = 0; i < box.inputs.size(); ++i) text += draw_input(box.inputs[i], left, r.y + port_offset(i));
    for (size_t i = 0; i < box.outputs.size(); ++i) text += draw_output(box.outputs[i], right, r.y + port_offset(i));
    return text + draw_joins(box, r) + "</g>\n";
  }

  /// A bar along the left side and the word.
  static std::string high_mark(const Rect& r) {
    return fmt::format("<rect class=\"mark\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"4\" height=\"{:.1f}\"/>\n", r.x + 1,
                       r.y + 5, kHeaderHeight - 10) +
           text_at(r.right() - kBoxMargin, r.y + 20, kSmallPx, "high",
                   "class=\"mark\" font-weight=\"bold\" text-anchor=\"end\"");
  }

  static std::string draw_input(const DiagramInput& input, double x, double y) {
    std::string text = text_at(x, y + 4, kTextPx, input.name);
    if (const std::string latch = input.latch_text(); !latch.empty())
      text += text_at(x + text_width_px(input.name, kTextPx) + 8, y + 4, kSmallPx, latch, "class=\"soft\"");
    return text;
  }

  /// Name and type in one text, so that the name keeps its distance in every font.
  static std::string draw_output(const DiagramOutput& output, double x, double y) {
    return fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"end\"{}>{}<tspan dx=\"8\" font-size=\"{}\" "
        "class=\"{}\">{}</tspan></text>\n",
        x, y + 4, kTextPx, output.read ? "" : " class=\"unread\"", escape(output.name), kSmallPx,
        output.read ? "soft" : "unread", escape(output.type));
  }

  /// A bracket beside the inputs of each join.
  static std::string draw_joins(const DiagramBox& box, const Rect& r) {
    std::map<int, std::vector<double>> rows;
    for (size_t i = 0; i < box.inputs.size(); ++i)
      if (box.inputs[i].join >= 0) rows[box.inputs[i].join].push_back(r.y + port_offset(i));
    std::string text;
    for (const auto& [join, ys] : rows) {
      const double x = r.x + 4 + 2 * join;
      std::string path = fmt::format("M{:.1f} {:.1f} V{:.1f}", x, ys.front(), ys.back());
      for (const double y : ys) path += fmt::format(" M{:.1f} {:.1f} h4", x, y);
      text += fmt::format("<path class=\"join\" d=\"{}\"><title>joined: messages of one stamp</title></path>\n", path);
    }
    return text;
  }

  /// Below the picture: the chains, and how to read it.
  std::string notes(double y) {
    std::string text;
    if (!diagram_.chains.empty()) text += line(0, y, kTitlePx - 1, "chains", "font-weight=\"bold\"");
    for (const DiagramChain& chain : diagram_.chains) {
      y += kLine;
      text += line(
          0, y, kTextPx,
          fmt::format("{}: {} -> {}, age at most {}", chain.name, chain.from, chain.to, time_text(chain.max_age_ns)),
          "class=\"chain\"");
    }
    if (!diagram_.chains.empty()) y += kLine + 8;
    for (const char* words : {"high: criticality high. Colour: message type, named at the output; grey outputs have no "
                              "reader.",
                              "Thick edge: its messages release the reader; thin: latched at the reader's release. "
                              "Bracket: inputs joined by stamp."}) {
      text += line(0, y, kSmallPx, words, "class=\"soft\"");
      y += kLine - 3;
    }
    return text;
  }

  const Diagram& diagram_;
  const Layout layout_;
  std::map<std::string, int> colour_;  ///< by message type
  double text_right_ = 0, text_bottom_ = 0;
};

}  // namespace

std::string graph_svg(const Diagram& diagram) { return Drawing(diagram).draw(); }

}  // namespace takt::view
