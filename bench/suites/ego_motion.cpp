// SPDX-License-Identifier: Apache-2.0
// One step of ego-motion at 640x480 on one thread, from grey images and disparity to the motion, against OpenCV's
// corners and optical flow of one camera, which give no motion yet. The drive is the one of `takt eval ego_motion
// --generated` that drives and turns.
#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <string_view>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "bench/suites/hops.hpp"
#include "graph/evaluate/ego_motion_drive.hpp"

namespace takt::bench {

std::vector<Row> run_ego_motion(const Options& options);

namespace {

constexpr double kQuality = 0.001;  // so low that there are as many corners as asked for
constexpr int kDistance_px = 5;

/// Frames to and fro: without a jump from the last to the first.
class Swing {
 public:
  explicit Swing(size_t frames) : frames_(frames) {}
  size_t next() {
    const size_t at = count_++ % (2 * frames_ - 2);
    return at < frames_ ? at : 2 * frames_ - 2 - at;
  }

 private:
  size_t frames_, count_ = 0;
};

class Ours {
 public:
  Ours(const command::Drive& drive, int corners) : drive_(drive), swing_(drive.frames.size()) {
    ego_motion::Parameters parameters;
    parameters.corners.maximum = corners;
    parameters.corners.quality = kQuality;
    parameters.corners.distance_px = kDistance_px;
    ego_.configure(drive.frames[0].left.cols, drive.frames[0].left.rows, parameters);
  }
  double step() {
    ego_motion::Frame frame = command::frame_of(drive_, swing_.next());
    frame.stamp_ns = stamp_ns_ += 100'000'000;
    const int64_t begin = now_ns();
    result_ = ego_.step(frame);
    return static_cast<double>(now_ns() - begin) * 1e-6;
  }
  int corners() const { return result_.corners; }

 private:
  const command::Drive& drive_;
  Swing swing_;
  int64_t stamp_ns_ = 0;
  ego_motion::EgoMotion ego_;
  ego_motion::Result result_;
};

class Theirs {
 public:
  explicit Theirs(const command::Drive& drive) : drive_(drive), swing_(drive.frames.size()) {}
  double step(int wanted) {
    const cv::Mat& image = drive_.frames[swing_.next()].left;
    const int64_t begin = now_ns();
    cv::goodFeaturesToTrack(image, found_, wanted, kQuality, kDistance_px);
    if (!corners_.empty())
      cv::calcOpticalFlowPyrLK(previous_, image, corners_, matched_, status_, errors_, {21, 21}, 3);
    const double ms = static_cast<double>(now_ns() - begin) * 1e-6;
    previous_ = image;
    corners_.swap(found_);
    return ms;
  }
  size_t corners() const { return corners_.size(); }

 private:
  const command::Drive& drive_;
  Swing swing_;
  cv::Mat previous_;
  std::vector<cv::Point2f> corners_, found_, matched_;
  std::vector<uint8_t> status_;
  std::vector<float> errors_;
};

command::Drive drive(std::string_view name) {
  const auto all = command::drive_conditions();
  const auto condition = std::find_if(all.begin(), all.end(), [&](auto& c) { return c.name == name; });
  return command::generate_drive(*condition, 1, 20, 128);
}

}  // namespace

std::vector<Row> run_ego_motion(const Options& options) {
  cv::setNumThreads(1);
  const command::Drive straight = drive("drive"), turning = drive("drive and turn");
  struct Contest {
    const char* name;
    const command::Drive& drive;
    int corners;
  };
  std::vector<Row> rows;
  for (const Contest& contest : {Contest{"drive/500", straight, 500}, Contest{"drive/800", straight, 800},
                                 Contest{"drive/1500", straight, 1500}, Contest{"turn/800", turning, 800}}) {
    std::fprintf(stderr, "ego_motion: %s corners\n", contest.name);
    Ours ours(contest.drive, contest.corners);
    Theirs theirs(contest.drive);
    for (int i = 0; i < 3; ++i) ours.step(), theirs.step(ours.corners());
    Compared figures = compare(
        static_cast<size_t>(options.rounds_or(60)), [&] { return theirs.step(ours.corners()); },
        [&] { return ours.step(); });
    const std::string granted =
        "one thread, " + std::to_string(ours.corners()) + " corners, theirs " + std::to_string(theirs.corners());
    Row row{"ego_motion/" + std::string(contest.name), "ms", 0, std::move(figures.changed), {}, {}, {}, granted};
    add_pair(rows, std::move(row), "goodFeaturesToTrack + calcOpticalFlowPyrLK", figures.pairs);
  }
  return rows;
}

}  // namespace takt::bench
