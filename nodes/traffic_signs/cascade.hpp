// SPDX-License-Identifier: Apache-2.0
// A boosted cascade of Haar features and its file, in OpenCV's format (thesis Sec. 3.4.1; ).
#pragma once
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace takt::traffic_signs {

/// The sum of the window's pixels in [x, x + width) x [y, y + height), times a weight; weight 0: unused.
struct WeightedRect {
  int x = 0, y = 0, width = 0, height = 0;
  float weight = 0;
};

/// Two or three rectangles; the value is the sum of theirs, divided by area and standard deviation of the window.
using HaarFeature = std::array<WeightedRect, 3>;

/// The weak classifier: `below` if the feature's value is less than the threshold, else `otherwise`.
struct Stump {
  int feature = 0;  ///< index
  float threshold = 0, below = 0, otherwise = 0;
};

/// A window passes if its stumps sum to the threshold or more.
struct Stage {
  std::vector<Stump> stumps;
  float threshold = 0;
};

struct Cascade {
  static constexpr int kLargestWindow_px = 128;  ///< edge: so that sums of squares fit 31 bits
  int width = 0, height = 0;                     ///< of the window, px
  std::vector<HaarFeature> features;
  std::vector<Stage> stages;  ///< at most 200
};

/// What cannot be used: "FILE:LINE: what is wrong; what is valid".
struct CascadeError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads what OpenCV 2.4 to 4 write and read: BOOST stages of HAAR features, upright, in stumps. Throws CascadeError.
Cascade read_cascade(const std::filesystem::path& file);

/// Writes the same format; read_cascade() and cv::CascadeClassifier give back what was written, bit for bit. `comment`:
/// where it comes from, at the head of the file, without "--". Throws CascadeError if the file cannot be written.
void write_cascade(const Cascade& cascade, const std::filesystem::path& file, const std::string& comment);

}  // namespace takt::traffic_signs
