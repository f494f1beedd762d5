// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace takt::replay {

/// Times of recorded lines, in the order of the file.
struct LineTimes {
  std::vector<int64_t> time_ns;  ///< from `first_known` on: never falling, and rising where a stamp is trusted
  size_t first_known = 0;        ///< lines before this one have no time that can be told
  size_t late = 0;               ///< known lines whose stamp had to be replaced
};

/// A logger that is held up writes lines in their true order, but stamps some of them later than they happened: several
/// then carry one stamp, or a stamp greater than one that follows. A stamp is trusted if every later one is greater;
/// the lines between two trusted stamps are spread evenly over the time between them. Seconds must be finite and lie in
/// 0 .. 4e9.
LineTimes repair_late_stamps(std::span<const double> seconds);

}  // namespace takt::replay
