// SPDX-License-Identifier: Apache-2.0
// Figures of a benchmark: tails over all samples, ratios over neighbouring rounds.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace takt::bench {

/// One measured quantity. No sample is ever dropped.
class Samples {
 public:
  void add(double value) { values_.push_back(value); }
  void add(std::span<const double> values) { values_.insert(values_.end(), values.begin(), values.end()); }
  void clear() { values_.clear(); }
  size_t size() const { return values_.size(); }
  const std::vector<double>& values() const { return values_; }
  /// Smallest sample that at least `fraction` (0..1) of all do not exceed; nothing without samples.
  std::optional<double> quantile(double fraction) const;
  std::optional<double> max() const;

 private:
  std::vector<double> values_;
};

/// Median of an even number: mean of the middle two. 0 without values.
double median(std::vector<double> values);

/// One row of the report (design of the command: `takt bench`).
struct Row {
  std::string name;  ///< suite/what/variant
  std::string unit;
  double value = 0;
  Samples samples;  ///< all rounds together
  std::string reference;
  std::optional<double> reference_value, ratio;
  std::string granted;
};

/// Rounds of two contestants A (reference) and B. Either measured A B A B ... A, one A more than B's: each B then
/// stands against the mean of its two neighbours. Or both inside each round, sample by sample in turn: as many A's as
/// B's.
class Pairs {
 public:
  void add_a(double value) { a_.push_back(value); }
  void add_b(double value) { b_.push_back(value); }
  /// Figures of the middle round by ratio: B, its A, and their ratio. So ratio is
  /// value / reference_value, all three from one moment of a machine whose speed drifts.
  struct Middle {
    double value = 0, reference = 0, ratio = 0;
  };
  std::optional<Middle> middle() const;
  /// The same of A against its own neighbours: what a ratio of equal contestants looks like here. Only of A B A B.
  std::optional<Middle> null() const;
  size_t rounds() const { return b_.size(); }

 private:
  std::vector<double> a_, b_;
};

}  // namespace takt::bench
