// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/classifier.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/ml.hpp>

namespace takt::object_3d {

Scaling::Scaling(const Training& training)
    : used_(training.used), mean_(used_.size()), per_deviation_(used_.size(), 1.0f) {
  const double n = static_cast<double>(training.samples.size());
  for (size_t k = 0; k < used_.size(); ++k) {
    double sum = 0, squares = 0;
    for (const Sample& sample : training.samples) sum += static_cast<double>(value(sample.attributes, used_[k]));
    const double mean = sum / n;
    for (const Sample& sample : training.samples) {
      const double off = static_cast<double>(value(sample.attributes, used_[k])) - mean;
      squares += off * off;
    }
    mean_[k] = static_cast<float>(mean);
    if (squares > 0) per_deviation_[k] = static_cast<float>(1 / std::sqrt(squares / n));
  }
}

void Scaling::apply(const Attributes& attributes, float* out) const {
  for (size_t k = 0; k < used_.size(); ++k) out[k] = (value(attributes, used_[k]) - mean_[k]) * per_deviation_[k];
}

NearestNeighbour::NearestNeighbour(const Training& training, const NearestParameters& parameters)
    : parameters_(parameters), scaling_(training), classes_(training.classes.size()) {
  samples_.resize(training.samples.size() * scaling_.size());
  for (size_t i = 0; i < training.samples.size(); ++i) {
    class_of_.push_back(training.samples[i].class_id);
    scaling_.apply(training.samples[i].attributes, samples_.data() + i * scaling_.size());
  }
}

// With the samples of a class one after the other, the best of each is known when the next class begins.
Answer NearestNeighbour::classify(const Attributes& attributes) {
  std::array<float, kAttributes> x;
  scaling_.apply(attributes, x.data());
  double best_q = 0, sum = 0, class_q = 0;
  Answer answer;
  const float* sample = samples_.data();
  for (size_t i = 0; i < class_of_.size(); ++i, sample += scaling_.size()) {
    double distance2 = 0;
    for (size_t k = 0; k < scaling_.size(); ++k) {
      const auto off = static_cast<double>(x[k] - sample[k]);
      distance2 += off * off;
    }
    class_q = std::max(class_q, std::exp(-distance2 / (2 * parameters_.s * parameters_.s)));
    if (i + 1 < class_of_.size() && class_of_[i + 1] == class_of_[i]) continue;
    sum += class_q;
    if (class_q > best_q) best_q = class_q, answer.class_id = static_cast<int>(class_of_[i]);
    class_q = 0;
  }
  if (best_q > 0) answer.score = best_q / sum;
  if (parameters_.reject && (best_q < parameters_.t_q || answer.score < parameters_.t_p)) answer.class_id = kUnknown;
  return answer;
}

SupportVectorMachines::SupportVectorMachines(const Training& training, const SvmParameters& parameters)
    : parameters_(parameters), scaling_(training), classes_(training.classes.size()), wins_(classes_) {
  if (classes_ < 2) throw TrainingError("a support vector machine tells classes apart and needs two at least");
  if (parameters_.gamma <= 0) parameters_.gamma = 1 / static_cast<double>(scaling_.size());
  const auto of = [&](size_t positive, size_t negative, bool rest) {
    std::vector<const Sample*> samples;
    for (const Sample& sample : training.samples)
      if (rest || sample.class_id == positive || sample.class_id == negative) samples.push_back(&sample);
    train(samples, {positive, negative, 0, 0, 0});
  };
  for (size_t i = 0; i < classes_; ++i) {
    if (parameters_.scheme == SvmScheme::one_vs_rest) of(i, i, true);
    else
      for (size_t k = i + 1; k < classes_; ++k) of(i, k, false);
  }
}

void SupportVectorMachines::train(const std::vector<const Sample*>& samples, Machine machine) {
  const int count = static_cast<int>(samples.size()), size = static_cast<int>(scaling_.size());
  cv::Mat1f rows(count, size);
  cv::Mat1i labels(count, 1);
  for (int i = 0; i < count; ++i) {
    scaling_.apply(samples[static_cast<size_t>(i)]->attributes, rows.ptr<float>(i));
    labels(i) = samples[static_cast<size_t>(i)]->class_id == machine.positive ? 0 : 1;  // the first label is positive
  }
  const cv::Ptr<cv::ml::SVM> svm = cv::ml::SVM::create();
  svm->setType(cv::ml::SVM::C_SVC);
  svm->setKernel(cv::ml::SVM::RBF);
  svm->setC(parameters_.c);
  svm->setGamma(parameters_.gamma);
  svm->setTermCriteria({cv::TermCriteria::MAX_ITER + cv::TermCriteria::EPS, 100'000, 1e-6});
  svm->train(rows, cv::ml::ROW_SAMPLE, labels);
  cv::Mat alpha, indices;
  machine.rho = svm->getDecisionFunction(0, alpha, indices);
  const cv::Mat1f vectors = svm->getSupportVectors();
  machine.first = alphas_.size();
  for (int i = 0; i < alpha.cols; ++i) {
    alphas_.push_back(alpha.at<double>(i));
    const float* vector = vectors.ptr<float>(indices.at<int>(i));
    vectors_.insert(vectors_.end(), vector, vector + size);
  }
  machine.last = alphas_.size();
  machines_.push_back(machine);
  cv::Mat1f theirs;
  svm->predict(rows, theirs, cv::ml::StatModel::RAW_OUTPUT);
  for (int i = 0; i < count; ++i)
    largest_difference_ =
        std::max(largest_difference_, std::abs(decision(machine, rows.ptr<float>(i)) - static_cast<double>(theirs(i))));
}

double SupportVectorMachines::decision(const Machine& machine, const float* x) const {
  double sum = -machine.rho;
  for (size_t i = machine.first; i < machine.last; ++i) {
    const float* vector = vectors_.data() + i * scaling_.size();
    double distance2 = 0;
    for (size_t k = 0; k < scaling_.size(); ++k) {
      const auto off = static_cast<double>(x[k] - vector[k]);
      distance2 += off * off;
    }
    sum += alphas_[i] * std::exp(-parameters_.gamma * distance2);
  }
  return sum;
}

Answer SupportVectorMachines::classify(const Attributes& attributes) {
  std::array<float, kAttributes> x;
  scaling_.apply(attributes, x.data());
  Answer answer;
  if (parameters_.scheme == SvmScheme::one_vs_rest) {
    double best = -1;  // a decision of 1 is on the margin of the class, of -1 on that of the rest
    for (const Machine& machine : machines_) {
      const double d = decision(machine, x.data());
      if (d > std::max(0.0, best)) answer.class_id = static_cast<int>(machine.positive);
      best = std::max(best, d);
    }
    answer.score = std::clamp((best + 1) / 2, 0.0, 1.0);
    return answer;
  }
  std::fill(wins_.begin(), wins_.end(), size_t{0});
  for (const Machine& machine : machines_)
    ++wins_[decision(machine, x.data()) > 0 ? machine.positive : machine.negative];
  const auto most = std::max_element(wins_.begin(), wins_.end());
  answer.class_id = static_cast<int>(most - wins_.begin());
  answer.score = static_cast<double>(*most) / static_cast<double>(classes_ - 1);
  return answer;
}

}  // namespace takt::object_3d
