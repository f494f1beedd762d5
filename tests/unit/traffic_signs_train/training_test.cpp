// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/training.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>

#include "nodes/traffic_signs/boosting.hpp"
#include "nodes/traffic_signs/reference.hpp"
#include "nodes/traffic_signs/search.hpp"
#include "nodes/traffic_signs/sign_scenes.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::traffic_signs;

namespace {

TrainingSet small_set(uint64_t first, int positives, int images) {
  TrainingSet set;
  for (int i = 0; i < positives; ++i)
    set.positives.push_back(make_positive(SignClass::yield, 1, first + static_cast<uint64_t>(i)));
  SceneParameters p;
  p.width = 240;
  p.height = 180;
  p.most_signs = 0;
  for (int i = 0; i < images; ++i) {
    cv::Mat1b grey;
    cv::cvtColor(make_scene(p, 1, first + static_cast<uint64_t>(i)).image, grey, cv::COLOR_BGR2GRAY);
    set.negatives.push_back({grey, {}});
  }
  return set;
}

TrainingParameters small_training() {
  TrainingParameters p;
  p.stages = 4;
  p.negatives = 300;
  p.features = 300;
  return p;
}

bool same(const Cascade& a, const Cascade& b) {
  if (a.stages.size() != b.stages.size()) return false;
  for (size_t s = 0; s < a.stages.size(); ++s) {
    if (a.stages[s].threshold != b.stages[s].threshold || a.stages[s].stumps.size() != b.stages[s].stumps.size())
      return false;
    for (size_t i = 0; i < a.stages[s].stumps.size(); ++i)
      if (a.stages[s].stumps[i].threshold != b.stages[s].stumps[i].threshold ||
          a.stages[s].stumps[i].below != b.stages[s].stumps[i].below)
        return false;
  }
  return true;
}

}  // namespace

TEST_CASE("traffic_signs: a cascade learns the yield sign; more stages miss more and let less pass") {
  const TrainingSet set = small_set(0, 250, 12), held_out = small_set(100000, 150, 6);
  size_t told = 0;
  const Cascade cascade =
      train_cascade(set, small_training(), [&](const Cascade& so_far) { CHECK(so_far.stages.size() == ++told); });
  REQUIRE(cascade.stages.size() == 4);
  CHECK(told == 4);
  const StageCurve curve = stage_curve(cascade, held_out, 1.2);
  for (size_t stage = 1; stage < 4; ++stage) {
    CHECK(curve.missed_pct[stage] >= curve.missed_pct[stage - 1]);
    CHECK(curve.false_positives_per_million[stage] < curve.false_positives_per_million[stage - 1]);
  }
  CHECK(curve.missed_pct.back() < 15);
  CHECK(curve.false_positives_per_million.front() < 500000);
  CHECK(curve.false_positives_per_million.back() < 60000);
  CHECK(same(cascade, train_cascade(set, small_training(), [](const Cascade&) {})));

  const test::TemporaryFolder folder;
  const auto file = folder.path / "yield.xml";
  write_cascade(cascade, file, "for a test");
  cv::CascadeClassifier theirs;
  REQUIRE(theirs.load(file.string()));
  const cv::Mat1b& image = held_out.negatives[0].grey;
  std::vector<cv::Rect> boxes;
  theirs.detectMultiScale(image, boxes, 1.2, 0);
  Search search(image.cols, image.rows, 1.2, {&cascade, 1});
  const size_t ours = detect_multi_scale(search, 0, {image.data, image.cols, image.rows}).size();
  CHECK(boxes.size() <= ours);
  CHECK(ours - boxes.size() <= ours / 4);  // the last rows, which OpenCV loses
}

TEST_CASE(
    "traffic_signs: samples have the values that the search computes; a stage keeps the hit rate it was asked for") {
  const TrainingSet set = small_set(0, 100, 1);
  const cv::Size window = set.positives[0].size();
  Samples samples(window);
  size_t positives = 0;
  for (const cv::Mat1b& positive : set.positives) positives += samples.add(positive, true);
  REQUIRE(positives >= 95);                                         // in the dark a few are too flat to be searched
  CHECK_FALSE(samples.add(cv::Mat1b(window, uint8_t{80}), false));  // flat
  for (int y = 0; y + window.height < 180; y += 11)
    for (int x = 0; x + window.width < 240; x += 13)
      samples.add(set.negatives[0].grey(cv::Rect(cv::Point(x, y), window)), false);
  samples.finish();
  CHECK(samples.positives() == positives);
  std::vector<HaarFeature> features;
  for (int i = 0; i < 12; ++i) {
    HaarFeature feature;
    feature[0] = {i, 3, 9, 12, -1};
    feature[1] = {i + 3, 3, 3, 12, 3};
    features.push_back(feature);
  }
  const BoostingParameters p{0.95, 0.3, 10};
  Cascade cascade{window.width, window.height, features, {boost_stage(samples, features, p)}};
  CHECK(cascade.stages[0].stumps.size() <= 10);
  int passed = 0;
  for (const cv::Mat1b& positive : set.positives)
    passed += stages_passed(cascade, {positive.data, positive.cols, positive.rows}, 0, 0) == 1;
  CHECK(static_cast<double>(passed) >= 0.95 * static_cast<double>(positives));
}

TEST_CASE("traffic_signs: scenes and positives follow from seed and index alone, and show what they say") {
  const SignScene a = make_scene({}, 3, 7), b = make_scene({}, 3, 7), c = make_scene({}, 3, 8);
  CHECK(cv::norm(a.image, b.image, cv::NORM_INF) == 0);
  CHECK(cv::norm(a.image, c.image, cv::NORM_INF) > 0);
  REQUIRE(a.signs.size() == b.signs.size());
  std::array<int, kSignShapes.size()> seen{};
  for (uint64_t i = 0; i < 12; ++i)
    for (const PlacedSign& sign : make_scene({}, 5, i).signs) {
      ++seen[static_cast<size_t>(sign.sign)];
      CHECK(sign.box.x >= 0);
      CHECK(sign.box.x + sign.box.width <= 640);
      CHECK(std::max(sign.box.width, sign.box.height) <= 132);
    }
  CHECK(std::count(seen.begin(), seen.end(), 0) <= 2);
  for (const SignShape& shape : kSignShapes) {
    const cv::Mat1b window = make_positive(shape.sign, 1, 2);
    CHECK(window.size() == cv::Size(shape.window_width, shape.window_height));
  }
}

TEST_CASE("traffic_signs: training says what it cannot work with") {
  const auto none = [](const Cascade&) {};
  TrainingSet set = small_set(0, 3, 2);
  CHECK_THROWS_AS(train_cascade({}, {}, none), std::invalid_argument);
  set.positives.push_back(cv::Mat1b(8, 8, uint8_t{1}));
  CHECK_THROWS_WITH_AS(train_cascade(set, {}, none), "positive windows differ in size", std::invalid_argument);
}
