// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/layout_learning.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include "nodes/object_detection/scenes.hpp"

namespace takt::object_detection {
namespace {

constexpr auto kSize = static_cast<Eigen::Index>(kLayoutFeatures);
constexpr int kScenesOfView = 40;
constexpr uint64_t kGenerated = 3;
constexpr double kLights[] = {0.6, 1.0, 1.4};  ///< of the surroundings
constexpr double kRidge = 0.05;                ///< share of the mean variance added to each: samples are few

/// Mean and covariance of features.
class Moments {
 public:
  Moments() : sum_(Eigen::VectorXd::Zero(kSize)), products_(Eigen::MatrixXf::Zero(kSize, kSize)) {}

  void add(const LayoutFeatures& features) {
    for (Eigen::Index i = 0; i < kSize; ++i) batch_(i, in_batch_) = features[static_cast<size_t>(i)];
    if (++in_batch_ == batch_.cols()) flush();
  }
  Eigen::VectorXd mean() {
    flush();
    return sum_ / static_cast<double>(count_);
  }
  Eigen::MatrixXd covariance() {
    const Eigen::VectorXd mean = this->mean();
    const Eigen::MatrixXf whole = products_.selfadjointView<Eigen::Lower>();
    return whole.cast<double>() / static_cast<double>(count_) - mean * mean.transpose();
  }

 private:
  void flush() {
    if (in_batch_ == 0) return;
    const auto batch = batch_.leftCols(in_batch_);
    products_.selfadjointView<Eigen::Lower>().rankUpdate(batch);
    sum_ += batch.cast<double>().rowwise().sum();
    count_ += in_batch_;
    in_batch_ = 0;
  }

  Eigen::VectorXd sum_;
  Eigen::MatrixXf products_, batch_{kSize, 256};
  Eigen::Index in_batch_ = 0, count_ = 0;
};

std::vector<uint8_t> lit(const Photograph& photograph, double light) {
  std::vector<uint8_t> pixels;
  for (const uint8_t value : photograph.pixels)
    pixels.push_back(static_cast<uint8_t>(std::min(255.0, std::round(light * value))));
  return pixels;
}

int side_at(double scale, int view_px) { return static_cast<int>(std::lround(scale * view_px)); }

Moments surroundings(std::span<const Photograph> photographs, int view_px) {
  Moments moments;
  LayoutFeatures features;
  for (const Photograph& photograph : photographs) {
    LayoutSums sums(photograph.width, photograph.height);
    for (const double light : kLights) {
      const std::vector<uint8_t> pixels = lit(photograph, light);
      sums.take({pixels.data(), photograph.width, photograph.height, 3}, 0, 0, photograph.width, photograph.height);
      for (const double scale : LayoutStage::kSides) {
        const int side = side_at(scale, view_px);
        for (int y = 0; y + side <= photograph.height; y += side / 2) {
          for (int x = 0; x + side <= photograph.width; x += side / 2) {
            sums.features({x, y, side}, features);
            moments.add(features);
          }
        }
      }
    }
  }
  return moments;
}

/// Features of a view in a scene of its own, as LayoutStage may meet it: the size that is nearest, a little off.
class ViewScenes {
 public:
  ViewScenes(std::span<const Photograph> photographs, int view_px)
      : photographs_(photographs), view_px_(view_px), sums_(2 * view_px, 2 * view_px) {
    piece_.resize(static_cast<size_t>(12 * view_px * view_px));
  }

  Moments of(const ReferenceView& view) {
    DatabaseObject object;
    object.test_views = {view};
    const int edge = 2 * view_px_;
    SceneParameters p;
    p.width = p.height = edge;
    p.fewest_objects = p.most_objects = 1;
    p.scale_max = 1.3;
    p.background = {piece_.data(), edge, edge, 3};
    Moments moments;
    LayoutFeatures features;
    for (int i = 0; i < kScenesOfView; ++i) {
      take_piece();
      const Scene scene = make_scene({&object, 1}, p, number_++, 0);
      sums_.take(scene.view(), 0, 0, edge, edge);
      sums_.features(near(scene.objects[0]), features);
      moments.add(features);
    }
    return moments;
  }

 private:
  int below(int end) { return static_cast<int>(random_() % static_cast<uint32_t>(end)); }

  void take_piece() {
    const Photograph& from = photographs_[static_cast<size_t>(below(static_cast<int>(photographs_.size())))];
    const int edge = 2 * view_px_, x = below(from.width - edge + 1), y = below(from.height - edge + 1);
    uint8_t* out = piece_.data();
    for (int row = 0; row < edge; ++row) out = std::copy_n(&from.view().at(x, y + row), 3 * edge, out);
  }

  Placement near(const PlacedObject& object) {
    const auto off = [&](double scale) { return std::abs(std::log(scale * view_px_ / object.side)); };
    const double scale = *std::min_element(LayoutStage::kSides.begin(), LayoutStage::kSides.end(),
                                           [&](double a, double b) { return off(a) < off(b); });
    const int side = side_at(scale, view_px_), most = 2 * view_px_ - side, off_px = view_px_ / 24;
    const auto jittered = [&](int from) {
      return std::clamp(from + (object.side - side) / 2 + below(2 * off_px + 1) - off_px, 0, most);
    };
    const int x = jittered(object.x);
    return {x, jittered(object.y), side};
  }

  std::span<const Photograph> photographs_;
  int view_px_;
  LayoutSums sums_;
  std::vector<uint8_t> piece_;
  std::mt19937 random_{1};
  uint64_t number_ = 0;
};

LayoutTemplate whole_numbers(const Eigen::VectorXd& weight, const Eigen::VectorXd& present,
                             const Eigen::VectorXd& absent) {
  const double factor = kLargestLayoutWeight / weight.cwiseAbs().maxCoeff();
  LayoutTemplate view;
  double middle = 0;
  for (Eigen::Index i = 0; i < kSize; ++i) {
    const auto whole = static_cast<int16_t>(std::lround(factor * weight(i)));
    view.weight[static_cast<size_t>(i)] = whole;
    middle += whole * (present(i) + absent(i)) / 2;
  }
  view.middle = static_cast<int32_t>(std::lround(middle));
  view.unit = static_cast<float>(1 / factor);
  return view;
}

/// The photographs, and generated surroundings, in which any colour may be: what photographs do not show may still
/// come.
std::vector<Photograph> with_generated(std::span<const Photograph> photographs) {
  std::vector<Photograph> all(photographs.begin(), photographs.end());
  SceneParameters p;
  p.fewest_objects = p.most_objects = 0;
  for (uint64_t i = 0; i < kGenerated; ++i) {
    const Scene scene = make_scene({}, p, 1, i);
    all.push_back({{}, scene.width, scene.height, scene.pixels});
  }
  return all;
}

void check(std::span<const Photograph> photographs, int view_px) {
  for (const Photograph& photograph : photographs)
    if (std::min(photograph.width, photograph.height) < 2 * view_px)
      throw std::invalid_argument("background " + photograph.file.string() + " is " + std::to_string(photograph.width) +
                                  " x " + std::to_string(photograph.height) + " px, must have at least " +
                                  std::to_string(2 * view_px));
}

}  // namespace

std::vector<LayoutObject> learn_layout(std::span<const DatabaseObject> database,
                                       std::span<const Photograph> photographs, double threshold_scale) {
  const int view_px = database[0].views[0].side_px;
  check(photographs, view_px);
  const std::vector<Photograph> around = with_generated(photographs);
  Moments surrounding = surroundings(around, view_px);
  const Eigen::VectorXd absent = surrounding.mean();
  ViewScenes scenes(around, view_px);
  std::vector<std::vector<Eigen::VectorXd>> present;  // means, by object and view
  Eigen::MatrixXd of_views = Eigen::MatrixXd::Zero(kSize, kSize);
  double views = 0;
  for (const DatabaseObject& object : database) {
    auto& means = present.emplace_back();
    for (const ReferenceView& view : object.views) {
      Moments moments = scenes.of(view);
      means.push_back(moments.mean());
      of_views += moments.covariance();
      ++views;
    }
    Eigen::VectorXd middle = Eigen::VectorXd::Zero(kSize);
    for (const Eigen::VectorXd& mean : means) middle += mean / static_cast<double>(means.size());
    for (const Eigen::VectorXd& mean : means) of_views += (mean - middle) * (mean - middle).transpose();
  }
  Eigen::MatrixXd covariance = surrounding.covariance() + of_views / views;
  covariance.diagonal().array() += kRidge * covariance.trace() / static_cast<double>(kSize);
  const Eigen::LDLT<Eigen::MatrixXd> factors(covariance);
  std::vector<LayoutObject> objects;
  for (size_t o = 0; o < database.size(); ++o) {
    constexpr auto kLayout = static_cast<size_t>(Stage::layout);
    LayoutObject& object = objects.emplace_back();
    object.threshold = threshold_scale * database[o].thresholds[kLayout].value_or(kLayoutThreshold);
    for (const Eigen::VectorXd& mean : present[o])
      object.views.push_back(whole_numbers(factors.solve(mean - absent), mean, absent));
  }
  return objects;
}

}  // namespace takt::object_detection
