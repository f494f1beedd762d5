// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/point_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

namespace takt::cloud {
namespace {

/// Up to here a float is exact to half a millimetre.
constexpr double kExact_m = 4096;

/// As PLY of MeshLab, CloudCompare and older programs name them, in any case.
Role role_of(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  for (const std::string_view before : {"diffuse_", "vertex_"})
    if (name.starts_with(before)) name.erase(0, before.size());
  if (packed_colour(name)) return kPacked;
  constexpr std::array<std::string_view, kPacked> kNames{"x", "y", "z", "red", "green", "blue"};
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found != kNames.end()) return static_cast<Role>(found - kNames.begin());
  if (name == "r") return kRed;
  if (name == "g") return kGreen;
  return name == "b" ? kBlue : kNone;
}

/// From one float to the next.
double step_at(double value) {
  const auto at = static_cast<float>(value);
  return static_cast<double>(std::nextafter(at, std::numeric_limits<float>::infinity()) - at);
}

}  // namespace

PointRows::PointRows(const Table& table, const Input& input) {
  find_roles(table);
  for (const Role role : {kX, kY, kZ})
    if (!kinds_[role]) input.bad_line(fmt::format("{} has no column {}, expected x, y and z", table.name, "xyz"[role]));
  check_colours();
  cloud_.points.reserve(table.rows);
  if (coloured()) cloud_.colours.reserve(table.rows);
}

void PointRows::find_roles(const Table& table) {
  for (const Column& column : table.columns) {
    Role role = role_of(column.name);
    if (role != kNone && (kinds_[role] || column.length || column.count != 1)) role = kNone;  // the first one counts
    if (role != kNone) kinds_[role] = column.kind;
    if (role == kNone && column.name != "_") unread_.push_back(column.name);  // PCL pads with "_"
    roles_.push_back(role);
  }
}

/// Colours that cannot be used are left out, not the points.
void PointRows::check_colours() {
  const auto drop = [&](Role role, const char* name) {
    if (!kinds_[role]) return;
    kinds_[role].reset();
    std::replace(roles_.begin(), roles_.end(), role, kNone);
    unread_.push_back(name);
  };
  const std::optional<Kind>& packed = kinds_[kPacked];
  const bool whole = kinds_[kRed] && kinds_[kGreen] && kinds_[kBlue];
  if (whole || (packed && *packed != Kind::f32 && *packed != Kind::u32 && *packed != Kind::i32)) drop(kPacked, "rgb");
  const bool same = whole && kinds_[kRed] == kinds_[kGreen] && kinds_[kRed] == kinds_[kBlue];
  if (!same) drop(kRed, "red"), drop(kGreen, "green"), drop(kBlue, "blue");
}

void PointRows::push() {
  Point point;
  std::array<float*, 3> to{&point.x, &point.y, &point.z};
  bool finite = true;
  for (size_t axis = 0; axis < 3; ++axis) finite = finite && std::isfinite(values_[axis]);
  not_finite_ += finite ? 0 : 1;
  if (finite) move_origin();
  bool rounded = false;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double value = values_[axis] - (finite ? cloud_.origin[axis] : 0);
    *to[axis] = static_cast<float>(value);
    if (finite) largest_ = std::max(largest_, std::abs(values_[axis]));
    rounded = rounded || (finite && std::abs(value) > kExact_m && static_cast<double>(*to[axis]) != value);
  }
  rounded_ += rounded ? 1 : 0;
  cloud_.points.push_back(point);
  if (coloured()) push_colour();
}

/// To the first point that is far away; where there is an origin, it stays.
void PointRows::move_origin() {
  std::array<double, 3>& origin = cloud_.origin;
  if (origin != std::array<double, 3>{}) return;
  for (size_t axis = 0; axis < 3; ++axis)
    if (std::abs(values_[axis]) > kExact_m) origin[axis] = std::floor(values_[axis]);
  if (origin == std::array<double, 3>{}) return;
  for (Point& point : cloud_.points) {
    const auto relative = [&](float& value, size_t axis) {
      value = static_cast<float>(static_cast<double>(value) - origin[axis]);
    };
    relative(point.x, 0), relative(point.y, 1), relative(point.z, 2);
  }
}

void PointRows::push_colour() {
  if (!kinds_[kPacked]) {
    raw_.push_back(
        {static_cast<float>(values_[kBlue]), static_cast<float>(values_[kGreen]), static_cast<float>(values_[kRed])});
    return;
  }
  const uint32_t rgb = kinds_[kPacked] == Kind::f32 ? std::bit_cast<uint32_t>(static_cast<float>(values_[kPacked]))
                                                    : static_cast<uint32_t>(static_cast<int64_t>(values_[kPacked]));
  cloud_.colours.push_back(
      {static_cast<uint8_t>(rgb), static_cast<uint8_t>(rgb >> 8), static_cast<uint8_t>(rgb >> 16)});
}

/// Bytes as they are; floats of 0 to 1 and whole numbers of 16 bits scaled by what the largest one says.
void PointRows::finish_colours() {
  if (raw_.empty()) return;
  float largest = 0;
  size_t beyond = 0;
  for (const auto& colour : raw_)
    for (const float value : colour)
      if (std::isfinite(value)) largest = std::max(largest, value);
  const bool floating = kinds_[kRed] == Kind::f32 || kinds_[kRed] == Kind::f64;
  const float top = floating && largest <= 1 ? 1 : largest <= 255 ? 255 : 65535;
  for (const auto& colour : raw_) {
    std::array<uint8_t, 3> bytes{};
    for (size_t i = 0; i < 3; ++i) {
      const float scaled = std::isfinite(colour[i]) ? std::round(colour[i] / top * 255) : -1;
      beyond += scaled < 0 || scaled > 255 ? 1 : 0;
      bytes[i] = static_cast<uint8_t>(std::clamp(scaled, 0.f, 255.f));
    }
    cloud_.colours.push_back({bytes[0], bytes[1], bytes[2]});
  }
  if (kinds_[kRed] != Kind::u8)
    cloud_.left_out.push_back(fmt::format("colours are read as values of 0 to {}, and scaled to 0 to 255", top));
  if (beyond > 0)
    cloud_.left_out.push_back(fmt::format("{} values of colours lie outside that range and are cut", beyond));
}

Cloud PointRows::take(const Header& header) {
  finish_colours();
  std::vector<std::string>& left = cloud_.left_out;
  left.insert(left.end(), header.left_out.begin(), header.left_out.end());
  if (!unread_.empty()) left.push_back(fmt::format("columns that are not read: {}", fmt::join(unread_, ", ")));
  std::vector<std::string> others;
  for (size_t i = 0; i + 1 < header.tables.size(); ++i)
    others.push_back(fmt::format("{} {}", header.tables[i].rows, header.tables[i].name));
  for (const Table& table : header.behind) others.push_back(fmt::format("{} {}", table.rows, table.name));
  if (!others.empty()) left.push_back(fmt::format("elements that are not read: {}", fmt::join(others, ", ")));
  if (not_finite_ > 0) left.push_back(fmt::format("{} points are not finite", not_finite_));
  if (largest_ > kExact_m &&
      std::any_of(kinds_.begin(), kinds_.begin() + 3, [](const auto& k) { return k == Kind::f32; }) &&
      header.layout != Layout::ascii)
    left.push_back(fmt::format("coordinates are floats of up to {:.0f}: steps of {} m in the file itself", largest_,
                               step_at(largest_)));
  if (rounded_ > 0)
    left.push_back(fmt::format("{} points lie further than {:.0f} m from the others and are rounded to floats",
                               rounded_, kExact_m));
  return std::move(cloud_);
}

}  // namespace takt::cloud
