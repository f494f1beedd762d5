// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/training.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <stdexcept>

#include "nodes/traffic_signs/boosting.hpp"
#include "nodes/traffic_signs/search.hpp"

namespace takt::traffic_signs {
namespace {

ImageView<const uint8_t> view(const cv::Mat1b& image) { return {image.data, image.cols, image.rows}; }

/// One Haar feature anywhere in the window: edges, lines, centre-surround, diagonal.
HaarFeature random_feature(cv::Size window, cv::RNG& random) {
  struct Kind {
    int columns, rows;
    int inner_x, inner_y;  ///< the cell that is told from the rest; for the diagonal the first of two
  };
  static constexpr Kind kKinds[] = {{2, 1, 0, 0}, {1, 2, 0, 0}, {3, 1, 1, 0}, {1, 3, 0, 1}, {3, 3, 1, 1}, {2, 2, 0, 0}};
  const Kind& kind = kKinds[random.uniform(0, static_cast<int>(std::size(kKinds)))];
  const int width = random.uniform(1, window.width / kind.columns + 1),
            height = random.uniform(1, window.height / kind.rows + 1);
  const int x = random.uniform(0, window.width - width * kind.columns + 1),
            y = random.uniform(0, window.height - height * kind.rows + 1);
  const int cells = kind.columns * kind.rows;
  const bool diagonal = kind.columns == 2 && kind.rows == 2;
  HaarFeature feature;
  feature[0] = {x, y, width * kind.columns, height * kind.rows, -1};
  feature[1] = {x + kind.inner_x * width, y + kind.inner_y * height, width, height,
                static_cast<float>(diagonal ? 2 : cells)};
  if (diagonal) feature[2] = {x + width, y + height, width, height, 2};
  return feature;
}

/// Windows of the negative images, image by image.
class Windows {
 public:
  Windows(const Cascade& cascade, const std::vector<NegativeImage>& images, double factor)
      : cascade_(cascade),
        images_(images),
        search_(images.at(0).grey.cols, images.at(0).grey.rows, factor, {&cascade, 1}) {}

  /// Calls use(stages passed, level, x, y) for each that touches no object and is not flat.
  template <class Use>
  void search(size_t index, Use use) {
    const NegativeImage& image = images_[index];
    for (int level = 0; level < search_.levels(0); ++level) {
      search_.build(level, view(image.grey));
      passed_.resize(static_cast<size_t>(search_.columns(0, level)));
      for (int row = 0; row < search_.rows(0, level); ++row) {
        search_.row(0, level, row, {}, passed_);
        for (int column = 0; column < static_cast<int>(passed_.size()); ++column) {
          const uint8_t passed = passed_[static_cast<size_t>(column)];
          if (passed == kFlat || touches(search_.box(0, level, column, row), image.objects)) continue;
          use(passed, search_.level(level), column * search_.level(level).step, row * search_.level(level).step);
        }
      }
    }
  }
  cv::Mat1b cut(const Level& level, int x, int y) const {
    cv::Mat1b window(cascade_.height, cascade_.width);
    for (int v = 0; v < window.rows; ++v) std::copy_n(level.grey().row(y + v) + x, window.cols, window.ptr(v));
    return window;
  }

 private:
  static bool touches(const Box& window, const std::vector<Box>& objects) {
    return std::any_of(objects.begin(), objects.end(),
                       [&](const Box& object) { return intersection_over_union(window, object) > 0; });
  }
  const Cascade& cascade_;
  const std::vector<NegativeImage>& images_;
  Search search_;
  std::vector<uint8_t> passed_;
};

/// Windows that pass the cascade so far; from each image at most some, any of them.
std::vector<cv::Mat1b> hard_negatives(const Cascade& cascade, const TrainingSet& set, const TrainingParameters& p,
                                      std::mt19937_64& random) {
  std::vector<cv::Mat1b> found;
  Windows windows(cascade, set.negatives, p.scale_factor);
  std::vector<size_t> order(set.negatives.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  for (const size_t image : order) {
    std::vector<cv::Mat1b> kept;
    size_t seen = 0;
    windows.search(image, [&](uint8_t passed, const Level& level, int x, int y) {
      if (passed < cascade.stages.size()) return;
      if (kept.size() < static_cast<size_t>(p.from_one_image)) kept.push_back(windows.cut(level, x, y));
      else if (const size_t place = random() % (seen + 1); place < kept.size()) kept[place] = windows.cut(level, x, y);
      ++seen;
    });
    found.insert(found.end(), kept.begin(), kept.end());
    if (found.size() >= static_cast<size_t>(p.negatives)) break;
  }
  found.resize(std::min(found.size(), static_cast<size_t>(p.negatives)));
  return found;
}

void check(const TrainingSet& set) {
  if (set.positives.empty() || set.negatives.empty())
    throw std::invalid_argument("training wants at least one positive window and one negative image");
  for (const cv::Mat1b& window : set.positives)
    if (window.size() != set.positives[0].size()) throw std::invalid_argument("positive windows differ in size");
  for (const NegativeImage& image : set.negatives)
    if (image.grey.size() != set.negatives[0].grey.size())
      throw std::invalid_argument("negative images differ in size");
}

/// Takes only those features over that the stage uses.
void append(Stage stage, std::span<const HaarFeature> features, Cascade& cascade) {
  for (Stump& stump : stage.stumps) {
    cascade.features.push_back(features[static_cast<size_t>(stump.feature)]);
    stump.feature = static_cast<int>(cascade.features.size()) - 1;
  }
  cascade.stages.push_back(std::move(stage));
}

/// How many stages a single window passes.
size_t stages_of(Search& search, const cv::Mat1b& window) {
  search.build(0, view(window));
  uint8_t passed = 0;
  search.row(0, 0, 0, {}, {&passed, 1});
  return passed == kFlat ? 0 : passed;
}

}  // namespace

Cascade train_cascade(const TrainingSet& set, const TrainingParameters& p,
                      const std::function<void(const Cascade&)>& progress) {
  check(set);
  const cv::Size window = set.positives[0].size();
  std::mt19937_64 random(p.seed);
  Cascade cascade;
  cascade.width = window.width;
  cascade.height = window.height;
  std::vector<cv::Mat1b> positives = set.positives;
  while (static_cast<int>(cascade.stages.size()) < p.stages) {
    Samples samples(window);
    const auto negatives = hard_negatives(cascade, set, p, random);
    if (negatives.size() < static_cast<size_t>(p.least_negatives)) break;
    for (const cv::Mat1b& positive : positives) samples.add(positive, true);
    for (const cv::Mat1b& negative : negatives) samples.add(negative, false);
    samples.finish();
    cv::RNG draw(random());
    std::vector<HaarFeature> features;
    for (int i = 0; i < p.features; ++i) features.push_back(random_feature(window, draw));
    append(boost_stage(samples, features, {p.least_hit_rate, p.most_false_alarms, p.most_stumps}), features, cascade);
    Search search(window.width, window.height, 2.0, {&cascade, 1});
    std::erase_if(positives,
                  [&](const cv::Mat1b& positive) { return stages_of(search, positive) < cascade.stages.size(); });
    progress(cascade);
  }
  return cascade;
}

StageCurve stage_curve(const Cascade& cascade, const TrainingSet& set, double scale_factor) {
  const size_t stages = cascade.stages.size();
  std::vector<double> missed(stages), alarms(stages);
  Search search(cascade.width, cascade.height, 2.0, {&cascade, 1});
  for (const cv::Mat1b& positive : set.positives)
    for (size_t stage = stages_of(search, positive); stage < stages; ++stage) ++missed[stage];
  Windows windows(cascade, set.negatives, scale_factor);
  double looked_at = 0;
  for (size_t image = 0; image < set.negatives.size(); ++image)
    windows.search(image, [&](uint8_t passed, const Level&, int, int) {
      ++looked_at;
      for (size_t stage = 0; stage < passed; ++stage) ++alarms[stage];
    });
  StageCurve curve;
  for (size_t stage = 0; stage < stages; ++stage) {
    curve.missed_pct.push_back(100 * missed[stage] / static_cast<double>(set.positives.size()));
    curve.false_positives_per_million.push_back(1e6 * alarms[stage] / looked_at);
  }
  return curve;
}

}  // namespace takt::traffic_signs
