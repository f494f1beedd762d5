// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <exception>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <vector>

#include "rt/file/output_file.hpp"

namespace takt::picture {

/// Writes an image whole (rt/file/output_file.hpp), in the format that the ending of its name tells.
inline tl::expected<void, OutputFailure> write_image(const std::filesystem::path& file, const cv::Mat& image) {
  std::vector<unsigned char> encoded;
  bool known = false;
  try {
    known = cv::imencode(file.extension().string(), image, encoded);
  } catch (const cv::Exception&) {  // no such format, or an empty image
  }
  if (!known) return tl::unexpected(OutputFailure{file.string() + ": wants a name that ends in .png", false});
  return write_file(file, {reinterpret_cast<const char*>(encoded.data()), encoded.size()});
}

}  // namespace takt::picture
