// SPDX-License-Identifier: Apache-2.0
#include "bench/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace takt::bench {

std::optional<double> Samples::quantile(double fraction) const {
  if (values_.empty()) return std::nullopt;
  std::vector<double> sorted = values_;
  const auto rank = static_cast<size_t>(std::ceil(fraction * static_cast<double>(sorted.size())));
  const size_t index = std::clamp<size_t>(rank, 1, sorted.size()) - 1;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(index), sorted.end());
  return sorted[index];
}

std::optional<double> Samples::max() const {
  if (values_.empty()) return std::nullopt;
  return *std::max_element(values_.begin(), values_.end());
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 != 0 ? values[half] : (values[half - 1] + values[half]) / 2;
}

namespace {

/// The lower middle of the pairs by ratio, so that it is one that was really measured.
std::optional<Pairs::Middle> middle_of(std::vector<Pairs::Middle> pairs) {
  if (pairs.empty()) return std::nullopt;
  std::sort(pairs.begin(), pairs.end(), [](const auto& x, const auto& y) { return x.ratio < y.ratio; });
  return pairs[(pairs.size() - 1) / 2];
}

}  // namespace

std::optional<Pairs::Middle> Pairs::middle() const {
  std::vector<Middle> pairs;
  for (size_t i = 0; i < b_.size() && i < a_.size(); ++i) {
    const double reference = a_.size() > b_.size() ? (a_[i] + a_[i + 1]) / 2 : a_[i];
    if (reference > 0) pairs.push_back({b_[i], reference, b_[i] / reference});
  }
  return middle_of(std::move(pairs));
}

std::optional<Pairs::Middle> Pairs::null() const {
  std::vector<Middle> pairs;
  if (a_.size() <= b_.size()) return std::nullopt;
  for (size_t i = 1; i + 1 < a_.size(); ++i) {
    const double reference = (a_[i - 1] + a_[i + 1]) / 2;
    if (reference > 0) pairs.push_back({a_[i], reference, a_[i] / reference});
  }
  return middle_of(std::move(pairs));
}

}  // namespace takt::bench
