// SPDX-License-Identifier: Apache-2.0
// What a node remembers goes into bytes and comes back, or is refused.
#include "rt/state_archive.hpp"

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

using namespace takt;

namespace {

struct Part {
  double x = 0;
  std::vector<int> cells;
  void remember(StateArchive& archive) { TAKT_STATE(archive, x, cells); }
  bool operator==(const Part&) const = default;
};

struct Whole {
  int64_t stamp_ns = 0;
  bool told = false;
  std::string text;
  std::optional<Part> part;
  std::vector<Part> parts;
  std::deque<float> window;
  std::array<Part, 2> two;
  std::map<std::string, double> named;
  std::set<int> seen;
  std::unique_ptr<Part> owned = std::make_unique<Part>();
  Eigen::Matrix3d fixed = Eigen::Matrix3d::Zero();
  Eigen::VectorXd grown;
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, stamp_ns, told, text, part, parts, window, two, named, seen, owned, fixed, grown);
  }
  bool operator==(const Whole& other) const {
    return stamp_ns == other.stamp_ns && told == other.told && text == other.text && part == other.part &&
           parts == other.parts && window == other.window && two == other.two && named == other.named &&
           seen == other.seen && *owned == *other.owned && fixed == other.fixed && grown == other.grown;
  }
};

Whole filled() {
  Whole whole;
  whole.stamp_ns = -7;
  whole.told = true;
  whole.text = "a door";
  whole.part = Part{2.5, {1, 2, 3}};
  whole.parts = {{1, {}}, {2, {9}}};
  whole.window = {0.5F, -0.5F};
  whole.two[1].cells = {4};
  whole.named = {{"x", 1}, {"y", 2}};
  whole.seen = {3, 5};
  whole.owned->x = 8;
  whole.fixed(1, 2) = 6;
  whole.grown = Eigen::VectorXd::LinSpaced(4, 0, 3);
  return whole;
}

std::vector<std::byte> saved(Whole& whole) {
  std::vector<std::byte> bytes(4096);
  StateArchive archive = StateArchive::saving(bytes);
  whole.remember(archive);
  REQUIRE_FALSE(archive.failed());
  bytes.resize(archive.bytes());
  return bytes;
}

}  // namespace

TEST_CASE("What was saved is there again") {
  Whole before = filled(), after;
  after.parts.resize(7);
  after.named["z"] = 3;
  const auto bytes = saved(before);
  StateArchive archive = StateArchive::loading(bytes);
  after.remember(archive);
  CHECK_FALSE(archive.failed());
  CHECK(archive.at_end());
  CHECK(after == before);
}

TEST_CASE("Too little room, bytes that end early and sizes that cannot be are refused") {
  Whole whole = filled();
  const auto bytes = saved(whole);
  for (size_t size = 0; size < bytes.size(); ++size) {
    std::vector<std::byte> room(size);
    StateArchive small = StateArchive::saving(room);
    whole.remember(small);
    CHECK(small.failed());
    Whole other;
    StateArchive cut = StateArchive::loading(std::span(bytes).first(size));
    other.remember(cut);
    CHECK(cut.failed());
  }
  for (size_t at = 0; at < bytes.size(); ++at) {  // any byte wrong: it is loaded or refused, and takes no memory beyond
    auto wrong = bytes;
    wrong[at] ^= std::byte{0xff};
    Whole other;
    StateArchive archive = StateArchive::loading(wrong);
    other.remember(archive);
    CHECK(other.parts.size() <= bytes.size());
  }
}

TEST_CASE("Measuring tells the most that capacities allow, and the layout of an object as set up") {
  Whole whole, same;
  whole.parts.reserve(10);
  same.parts.reserve(10);
  StateArchive measured = StateArchive::measuring();
  whole.remember(measured);
  Whole full = filled();
  CHECK(measured.bytes() >= 10 * sizeof(Part));
  StateArchive again = StateArchive::measuring();
  same.remember(again);
  CHECK(again.layout() == measured.layout());
  Part part;
  StateArchive other = StateArchive::measuring();
  part.remember(other);
  CHECK(other.layout() != measured.layout());
}

TEST_CASE("Members are told by their names") {
  Whole whole = filled();
  std::vector<std::string> lines;
  StateArchive told = StateArchive::telling(
      [&](const std::string& name, const std::string& value) { lines.push_back(name + "=" + value); });
  whole.remember(told);
  CHECK(lines.front() == "stamp_ns=-7");
  CHECK(std::find(lines.begin(), lines.end(), "text=\"a door\"") != lines.end());
  CHECK(std::find_if(lines.begin(), lines.end(), [](const auto& l) { return l.starts_with("part.x="); }) !=
        lines.end());
}
