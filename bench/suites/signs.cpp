// SPDX-License-Identifier: Apache-2.0
// The seven cascades of graph/signs over a generated scene of 640x480, one thread, all windows at all scales and
// grouped, against cv::CascadeClassifier::detectMultiScale with the same files; and the node's whole search, with
// colours, rows without them left out. OpenCV leaves out each window after one that fails in the first stage.
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "graph/cli/outcome.hpp"
#include "nodes/traffic_signs/sign_detector.hpp"
#include "nodes/traffic_signs/sign_scenes.hpp"

namespace takt::bench {

std::vector<Row> run_signs(const Options& options);

namespace {

using namespace traffic_signs;

constexpr double kFactor = 1.15;
constexpr int kLeastHits = 3;

/// Every window of every cascade.
class Whole {
 public:
  Whole(cv::Size size, const std::vector<SignModel>& signs)
      : search_(size.width, size.height, kFactor, cascades(signs)), grouping_(4096) {}
  size_t run(const cv::Mat1b& grey) {
    const ImageView<const uint8_t> image(grey.data, grey.cols, grey.rows);
    std::vector<std::vector<Box>> hits(count_);
    std::vector<uint8_t> passed;
    for (int level = 0; level < search_.levels(); ++level) {
      search_.build(level, image);
      for (size_t c = 0; c < count_; ++c) {
        if (level >= search_.levels(c)) continue;
        passed.resize(static_cast<size_t>(search_.columns(c, level)));
        for (int row = 0; row < search_.rows(c, level); ++row) {
          search_.row(c, level, row, {}, passed);
          for (size_t column = 0; column < passed.size(); ++column)
            if (passed[column] == search_.stages(c))
              hits[c].push_back(search_.box(c, level, static_cast<int>(column), row));
        }
      }
    }
    size_t found = 0;
    for (const auto& boxes : hits) found += grouping_.group(boxes, kLeastHits).size();
    return found;
  }

 private:
  std::vector<Cascade> cascades(const std::vector<SignModel>& signs) {
    std::vector<Cascade> all;
    for (const SignModel& sign : signs) all.push_back(sign.cascade);
    count_ = all.size();
    return all;
  }
  size_t count_ = 0;  // before search_, whose cascades set it
  Search search_;
  Grouping grouping_;
};

}  // namespace

std::vector<Row> run_signs(const Options& options) {
  cv::setNumThreads(1);
  const auto folder = command::shipped("graph/signs");
  const auto signs = read_signs(folder);
  std::vector<cv::CascadeClassifier> theirs;
  for (const SignModel& sign : signs) theirs.emplace_back((folder / (sign.name + ".xml")).string());
  const SignScene scene = make_scene({}, 77, 5);
  cv::Mat1b grey;
  cv::cvtColor(scene.image, grey, cv::COLOR_BGR2GRAY);
  Whole whole(grey.size(), signs);
  SignDetectorParameters parameters;
  parameters.scale_factor = kFactor;
  parameters.least_hits = kLeastHits;
  SignDetector detector(grey.cols, grey.rows, signs, parameters);
  const ImageView<const uint8_t> bgr(scene.image.ptr(), grey.cols, grey.rows, 3);
  const auto opencv = [&] {
    return cpu_ms([&] {
      for (cv::CascadeClassifier& cascade : theirs) {
        std::vector<cv::Rect> boxes;
        cascade.detectMultiScale(grey, boxes, kFactor, kLeastHits - 1);
      }
    });
  };
  std::vector<Row> rows;
  const auto add = [&](const char* name, auto ours) {
    std::fprintf(stderr, "signs: %s\n", name);
    Compared figures = compare(static_cast<size_t>(options.rounds_or(15)), opencv, ours);
    Row row{"signs/" + std::string(name), "ms", 0, std::move(figures.changed), {}, {}, {}, "one thread, CPU time"};
    add_pair(rows, std::move(row), "seven detectMultiScale", figures.pairs);
  };
  add("every_window", [&] { return cpu_ms([&] { whole.run(grey); }); });
  add("colour_first", [&] { return cpu_ms([&] { detector.run(bgr, {}, {}, [] { return true; }); }); });
  return rows;
}

}  // namespace takt::bench
