// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace takt::calibration {

struct ImagePair {
  std::string name;  ///< what both file names have where the patterns have `*`
  std::filesystem::path left, right;
};

/// The pairs of a folder, sorted by name. Each pattern is a file name with exactly one `*`; files whose names have the
/// same text there belong together. Throws std::invalid_argument for a folder that cannot be read, a pattern that is
/// none, patterns without a file, or files without a partner, and names them.
std::vector<ImagePair> find_pairs(const std::filesystem::path& folder, const std::string& left_pattern,
                                  const std::string& right_pattern);

/// Both images of a pair in grey.
struct GreyPair {
  cv::Mat left, right;
};

/// Reads all images. Throws std::invalid_argument naming the first that cannot be decoded, or that has another size
/// than the first image.
std::vector<GreyPair> read_pairs(const std::vector<ImagePair>& files);

}  // namespace takt::calibration
