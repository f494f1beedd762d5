// SPDX-License-Identifier: Apache-2.0
// From attributes to a class, or to "unknown". Everything is learnt by the constructor;
// classify() allocates nothing. One thread at a time.
#pragma once
#include <memory>
#include <vector>

#include "nodes/object_3d/training.hpp"

namespace takt::object_3d {

inline constexpr int kUnknown = -1;

struct Answer {
  int class_id = kUnknown;  ///< index in Training::classes
  double score = 0;         ///< 0..1, how sure the best class was, also where the answer is unknown
};

class Classifier {
 public:
  virtual ~Classifier() = default;
  virtual Answer classify(const Attributes& attributes) = 0;
};

/// The used attributes at zero mean and unit variance over the samples; one that never varies counts as it is.
class Scaling {
 public:
  explicit Scaling(const Training& training);
  size_t size() const { return used_.size(); }
  /// `out` holds size() numbers.
  void apply(const Attributes& attributes, float* out) const;

 private:
  std::vector<Attribute> used_;
  std::vector<float> mean_, per_deviation_;
};

struct NearestParameters {
  double s = 1;      ///< width of the likeness, in deviations
  double t_q = 0.1;  ///< likeness of the nearest sample below which the answer is unknown
  double t_p = 0.6;  ///< probability of its class below which the answer is unknown
  bool reject = true;
};

/// q = exp(-D^2 / (2 s^2)) to each sample, P(class) = its best q / the sum of the classes' best.
class NearestNeighbour final : public Classifier {
 public:
  NearestNeighbour(const Training& training, const NearestParameters& parameters);
  /// From the next classify() on.
  void tune(const NearestParameters& parameters) { parameters_ = parameters; }
  Answer classify(const Attributes& attributes) override;

 private:
  NearestParameters parameters_;
  Scaling scaling_;
  size_t classes_;
  std::vector<size_t> class_of_;
  std::vector<float> samples_;  ///< scaled, one after the other
};

enum class SvmScheme : uint8_t {
  one_vs_rest,  ///< a machine a class; the largest decision wins, unknown if none is above 0
  pairwise      ///< a machine for each of the n (n - 1) / 2 pairs; most wins, of equals the first. Always answers
};

struct SvmParameters {
  SvmScheme scheme = SvmScheme::one_vs_rest;
  double c = 1;
  double gamma = 0;  ///< of exp(-gamma |x - y|^2); 0: one by the number of attributes
};

/// Machines trained by OpenCV, evaluated here: its predict() allocates.
class SupportVectorMachines final : public Classifier {
 public:
  /// Throws TrainingError for fewer than two classes.
  SupportVectorMachines(const Training& training, const SvmParameters& parameters);
  Answer classify(const Attributes& attributes) override;
  size_t machines() const { return machines_.size(); }
  size_t support_vectors() const { return alphas_.size(); }
  /// Largest difference between the decisions of these machines and OpenCV's for the samples they were trained with.
  double largest_difference() const { return largest_difference_; }

 private:
  struct Machine {
    size_t positive = 0, negative = 0;  ///< classes; of one_vs_rest the second is not used
    size_t first = 0, last = 0;         ///< of the support vectors
    double rho = 0;
  };
  void train(const std::vector<const Sample*>& samples, Machine machine);
  double decision(const Machine& machine, const float* x) const;

  SvmParameters parameters_;
  Scaling scaling_;
  size_t classes_;
  std::vector<Machine> machines_;
  std::vector<size_t> wins_;  ///< of each class, of the last pairwise classify()
  std::vector<float> vectors_;
  std::vector<double> alphas_;
  double largest_difference_ = 0;
};

}  // namespace takt::object_3d
