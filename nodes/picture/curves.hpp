// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace takt::picture {

/// A curve over the values of a parameter.
struct Curve {
  std::string label;
  std::vector<double> values;
  double foot = 0;  ///< where its scale begins
};

/// Curves one above the other, each with its own scale, over the same values of `parameter`, as a PNG. Throws
/// std::invalid_argument if the file cannot be written.
void write_curves(const std::string& file, const std::string& parameter, const std::vector<double>& values,
                  const std::vector<Curve>& curves);

}  // namespace takt::picture
