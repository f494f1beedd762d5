// SPDX-License-Identifier: Apache-2.0
// Inside the readers of clouds: rows of numbers become points and colours.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "nodes/cloud/cloud.hpp"
#include "nodes/cloud/cloud_input.hpp"

namespace takt::cloud {

/// What a column means to us.
enum Role : uint8_t { kX, kY, kZ, kRed, kGreen, kBlue, kPacked, kRoles, kNone };

/// The points of a table, a row after the other. Coordinates that a float would round to more than half a millimetre
/// are kept relative to an origin (Cloud::origin). Colours of 16 bits and of floating point become 8 bits.
class PointRows {
 public:
  /// Throws Bad if the table lacks x, y or z.
  PointRows(const Table& table, const Input& input);
  /// The first value of a column in the row at hand.
  void set(size_t column, double value) {
    if (roles_[column] != kNone) values_[roles_[column]] = value;
  }
  /// Ends the row.
  void push();
  /// All rows, and what was left out of the file.
  Cloud take(const Header& header);

 private:
  void find_roles(const Table& table);
  void check_colours();
  bool coloured() const { return kinds_[kRed].has_value() || kinds_[kPacked].has_value(); }
  void move_origin();
  void push_colour();
  void finish_colours();

  Cloud cloud_;
  std::vector<Role> roles_;  ///< of each column
  std::vector<std::string> unread_;
  std::array<std::optional<Kind>, kRoles> kinds_;
  std::array<double, kRoles> values_{};
  std::vector<std::array<float, 3>> raw_;  ///< blue, green, red of columns that are not bytes
  double largest_ = 0;                     ///< coordinate of the file
  size_t not_finite_ = 0, rounded_ = 0;
};

}  // namespace takt::cloud
