// SPDX-License-Identifier: Apache-2.0
// Drives for `takt eval ego_motion`: stereo images with their disparity and the true poses, recorded or generated.
#pragma once
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "nodes/ego_motion/ego_motion.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::command {

/// What is wrong with the data, with the file and the next step.
struct BadData : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct DriveFrame {
  cv::Mat left, right;     ///< rectified, grey
  cv::Mat disparity;       ///< 16-bit whole px, -1 where rejected: of nodes/stereo at its defaults
  ego_motion::Rigid pose;  ///< true: camera in a fixed frame
  int64_t stamp_ns = 0;
};

struct Drive {
  CameraModel camera;
  std::vector<DriveFrame> frames;
  double stereo_ms = 0;  ///< median time of the disparity of a frame
};

/// Computes the disparity of all frames. Throws BadData if their sizes differ.
void add_disparity(Drive& drive, int disparities);

/// Folder with image_l/, image_r/, calib.txt and poses.txt as in KITTI's odometry data, 10 frames a second. Images are
/// made `scale` times as large. Throws BadData.
Drive read_drive(const std::filesystem::path& folder, double scale, int disparities);

struct EvalEgoMotionOptions;
/// The one that the options name; its search range shrinks with the images.
Drive recorded_drive(const EvalEgoMotionOptions& options);

/// How a generated drive is made worse than a sharp, evenly lit, static one.
struct DriveCondition {
  std::string_view name;
  double speed_m_s = 0;                     ///< largest
  double turn_deg_s = 0;                    ///< largest
  double exposure_s = 0;                    ///< of each image: motion blur
  double frame_gain = 1;                    ///< brightness changes from frame to frame by up to this factor, either way
  double frame_offset = 0;                  ///< and by up to that many levels
  double right_gain = 1, right_offset = 0;  ///< of the right camera
  bool movers = false;                      ///< boxes and a person move across the view
  int covered_every = 0;                    ///< every n-th frame shows nothing
};
std::span<const DriveCondition> drive_conditions();

/// A camera that swings along a line and about a vertical axis in a furnished room, 10 frames a second (640 x 480, 66
/// degrees, baseline 0.24 m, rendered by hal/sim). Equal for equal seeds.
Drive generate_drive(const DriveCondition& condition, uint64_t seed, int frames, int disparities);

/// What a step is given of a frame.
ego_motion::Frame frame_of(const Drive& drive, size_t index);

struct Track {
  std::vector<ego_motion::Result> results;  ///< one for each frame
  double step_ms = 0;                       ///< median
  std::vector<ego_motion::Rigid> poses() const;
};
Track follow(const Drive& drive, const ego_motion::Parameters& parameters);

}  // namespace takt::command
