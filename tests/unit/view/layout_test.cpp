// SPDX-License-Identifier: Apache-2.0
#include "graph/view/layout.hpp"

#include <algorithm>
#include <cmath>

#include "fixture.hpp"
#include "graph/view/layout_steps.hpp"
#include "graph/view/text_width.hpp"

using namespace takt;
using namespace takt::view;

namespace {

using view::Point;  // rt has one, too

bool overlap(const Rect& a, const Rect& b) {
  return a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom();
}

bool inside(const Rect& inner, const Rect& outer) {
  constexpr double rounding = 1e-6;
  return inner.x > outer.x - rounding && inner.right() < outer.right() + rounding && inner.y > outer.y - rounding &&
         inner.bottom() < outer.bottom() + rounding;
}

Point on_curve(const Curve& c, double t) {
  const double u = 1 - t;
  const auto mix = [&](double a, double b, double d, double e) {
    return u * u * u * a + 3 * u * u * t * b + 3 * u * t * t * d + t * t * t * e;
  };
  return {mix(c.from.x, c.control_from.x, c.control_to.x, c.to.x),
          mix(c.from.y, c.control_from.y, c.control_to.y, c.to.y)};
}

bool strictly_inside(Point p, const Rect& r) {
  constexpr double edge = 0.5;
  return p.x > r.x + edge && p.x < r.right() - edge && p.y > r.y + edge && p.y < r.bottom() - edge;
}

void check_boxes(const Diagram& diagram, const Layout& layout) {
  for (size_t a = 0; a < layout.boxes.size(); ++a) {
    CAPTURE(diagram.boxes[a].id);
    CHECK(inside(layout.boxes[a], layout.rooms[diagram.boxes[a].room]));
    CHECK(inside(layout.boxes[a], {0, 0, layout.width, layout.height}));
    CHECK(layout.boxes[a].width > box_width(diagram.boxes[a]) - 1e-6);
    CHECK(layout.boxes[a].height > box_height(diagram.boxes[a]) - 1e-6);
    for (size_t b = 0; b < a; ++b) CHECK_FALSE(overlap(layout.boxes[a], layout.boxes[b]));
  }
  for (size_t a = 0; a < layout.rooms.size(); ++a)
    for (size_t b = 0; b < a; ++b)
      if (layout.rooms[a].width > 0 && layout.rooms[b].width > 0)
        CHECK_FALSE(overlap(layout.rooms[a], layout.rooms[b]));
}

void check_edges(const Diagram& diagram, const Layout& layout) {
  REQUIRE(layout.edges.size() == diagram.edges.size());
  for (size_t e = 0; e < layout.edges.size(); ++e) {
    const auto& curves = layout.edges[e];
    CAPTURE(e);
    REQUIRE_FALSE(curves.empty());
    CHECK(curves.front().from.x == doctest::Approx(layout.boxes[diagram.edges[e].from_box].right()));
    CHECK(curves.back().to.x == doctest::Approx(layout.boxes[diagram.edges[e].to_box].x - kArrowLength));
    size_t through = 0;
    for (size_t i = 0; i < curves.size(); ++i) {
      if (i > 0) CHECK(std::hypot(curves[i].from.x - curves[i - 1].to.x, curves[i].from.y - curves[i - 1].to.y) < 1e-6);
      for (int step = 0; step <= 40; ++step)
        for (const Rect& box : layout.boxes) through += strictly_inside(on_curve(curves[i], step / 40.0), box);
    }
    CHECK(through == 0);
  }
}

}  // namespace

TEST_CASE("The layout of ACE: devices left, no overlap, no edge through a box") {
  const Diagram diagram = test::ace_diagram();
  const Layout layout = lay_out(diagram);
  check_boxes(diagram, layout);
  check_edges(diagram, layout);
  for (size_t b = 0; b < layout.boxes.size(); ++b)
    for (size_t d = 0; d < layout.boxes.size(); ++d)
      if (diagram.boxes[d].device && !diagram.boxes[b].device) CHECK(layout.boxes[d].right() < layout.boxes[b].x);
}

TEST_CASE("Random graphs, cycles and commands included: no overlap, no edge through a box") {
  for (unsigned seed = 0; seed < 25; ++seed) {
    CAPTURE(seed);
    const Diagram diagram = test::random_diagram(seed, 1 + seed % 6, 1 + seed % 17, 2 * seed);
    const Layout layout = lay_out(diagram);
    check_boxes(diagram, layout);
    check_edges(diagram, layout);
  }
}

TEST_CASE("The same diagram gives the same layout") {
  const Diagram diagram = test::random_diagram(7, 4, 12, 24);
  const Layout a = lay_out(diagram), b = lay_out(diagram);
  for (size_t i = 0; i < a.boxes.size(); ++i) CHECK((a.boxes[i].x == b.boxes[i].x && a.boxes[i].y == b.boxes[i].y));
}

TEST_CASE("A graph without anything has no size") {
  Diagram diagram;
  diagram.rooms = {"devices"};
  const Layout layout = lay_out(diagram);
  CHECK(layout.width == 0);
  CHECK(layout.height == 0);
}

TEST_CASE("Columns are longest paths, and agree with every path tried one after the other") {
  for (unsigned seed = 0; seed < 30; ++seed) {
    // Forward edges only: the reference lengthens columns until nothing changes (Bellman-Ford).
    Diagram diagram = test::random_diagram(seed, 3, 12, 30);
    std::erase_if(diagram.edges, [](const DiagramEdge& edge) { return edge.from_box >= edge.to_box; });
    std::vector<int> reference;
    for (const auto& box : diagram.boxes) reference.push_back(box.device ? 0 : 1);
    for (size_t round = 0; round < diagram.boxes.size(); ++round)
      for (const auto& edge : diagram.edges)
        if (!diagram.boxes[edge.to_box].device)
          reference[edge.to_box] = std::max(reference[edge.to_box], reference[edge.from_box] + 1);
    CAPTURE(seed);
    CHECK(assign_columns(diagram) == reference);
  }
}

TEST_CASE("A cycle ends, and goes forward as far as it can") {
  Diagram diagram = test::random_diagram(1, 1, 3, 0);
  for (auto& box : diagram.boxes) box.room = box.device ? 0 : 1;
  diagram.edges = {{3, 0, 1, 0}, {0, 0, 1, 1}, {1, 0, 2, 0}, {2, 0, 3, 0}};
  CHECK(assign_columns(diagram) == std::vector<int>{0, 1, 2, 3});
}

TEST_CASE("Requests and commands go against the data and move nothing to the right") {
  Diagram diagram = test::random_diagram(1, 1, 3, 0);
  diagram.edges = {{0, 0, 1, 0}, {0, 0, 2, 0}, {2, 0, 3, 0}, {3, 0, 1, 1, true}, {3, 0, 0, 0}};
  CHECK(assign_columns(diagram) == std::vector<int>{0, 1, 1, 2});
  diagram.edges[3].control = false;
  CHECK(assign_columns(diagram) == std::vector<int>{0, 3, 1, 2});
}

TEST_CASE("stack agrees with the minimax formula of isotonic regression") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> value(0, 300);
  for (int trial = 0; trial < 200; ++trial) {
    const size_t n = 1 + static_cast<size_t>(trial) % 7;
    std::vector<double> wanted, heights, gaps, above(n, 0);
    for (size_t i = 0; i < n; ++i)
      wanted.push_back(value(random)), heights.push_back(20 + value(random) / 20), gaps.push_back(5);
    for (size_t i = 1; i < n; ++i) above[i] = above[i - 1] + heights[i - 1] + gaps[i];
    const double low = -50, high = 500;
    const auto tops = stack(wanted, heights, gaps, low, high);
    for (size_t i = 0; i < n; ++i) {
      double most = -1e300;  // max over j <= i of the min over k >= i of the mean of j..k
      for (size_t j = 0; j <= i; ++j) {
        double least = 1e300, sum = 0;
        for (size_t k = j; k < n; ++k) {
          sum += wanted[k] - above[k];
          if (k >= i) least = std::min(least, sum / static_cast<double>(k - j + 1));
        }
        most = std::max(most, least);
      }
      const double expected = std::clamp(most, low, high - above[n - 1] - heights[n - 1]) + above[i];
      CHECK(tops[i] == doctest::Approx(expected));
    }
  }
}

TEST_CASE("Text is as wide as the face says") {
  CHECK(text_width_px("", 10) == 0);
  CHECK(text_width_px("il", 100) == doctest::Approx(56));
  CHECK(text_width_px("WW", 10, true) > text_width_px("WW", 10));
  CHECK(text_width_px("\xC3\xBC", 10) == doctest::Approx(10.5));  // one letter, two bytes
}
