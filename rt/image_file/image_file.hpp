// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <stdexcept>

namespace takt {

/// Why a picture is not read. The text begins with the file.
struct ImageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class Channels { as_file, grey, colour };

/// A picture in 8 bits.
///
///     const cv::Mat left = read_image("left/000000.pgm", Channels::grey);
///
/// A picture of more bits is scaled so that its largest possible value becomes 255; nothing is cut off. The largest
/// value is that of `bits` (10: 1023), if given, else of the file: the maxval of PGM and PPM, the chunk sBIT of PNG. A
/// file that states neither counts as 16 bits if a value needs the 16th.
///
/// `bits`: 0 (as the file says) or 8 to 16. Colour is BGR. Throws ImageError: not there, not decodable, larger than
/// memory, of floating point, a value beyond `bits`, or a 16-bit picture that leaves open how many bits count. Any
/// thread.
cv::Mat read_image(const std::filesystem::path& file, Channels channels, int bits = 0);

/// The values as they lie in the file (depth, disparity, labels): 8 or 16 bits, any channels. Throws ImageError.
cv::Mat read_values(const std::filesystem::path& file);

/// A PFM (ground truth of Middlebury from 2014 on): floats, one channel; infinite where nothing is known. Throws
/// ImageError.
cv::Mat1f read_floats(const std::filesystem::path& file);

}  // namespace takt
