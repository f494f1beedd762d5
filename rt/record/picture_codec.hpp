// SPDX-License-Identifier: Apache-2.0
// Pictures of packed messages as JPEG, for records that are to be ten times smaller and may differ from the run.
//
//   PictureCoder coder(85);
//   coder.code(type.fields, packed, kept);        // kept has the pictures as JPEG, all else as it was
//   auto again = plain_of(kept);                  // packed, with pixels that are nearly those of before
//
// A message has pictures if it has scalars `width`, `height` and `channels` (1 or 3, BGR) and arrays of u8 that hold as
// many bytes, as takt::Image and takt::StereoPair do. Kept are, over and over: a number of bytes (u32) and these bytes
// as they were, then a number of bytes (u32) and a JPEG whose pixels followed there; 0 at the end.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/msg/field.hpp"
#include "rt/record/jpeg_compressor.hpp"

namespace takt::record {

/// Whether messages of these fields may have pictures.
bool may_have_pictures(std::span<const Field> fields);

/// One thread at a time.
class PictureCoder {
 public:
  /// `quality`: 1 to 100; colours have half the resolution below 90.
  explicit PictureCoder(int quality) : compressor_(quality) {}

  /// Appends what is kept of a packed message. What is no picture, or is none that fits, is kept as it is.
  void code(std::span<const Field> fields, std::span<const std::byte> packed, std::vector<std::byte>& to);

 private:
  bool append_jpeg(std::span<const std::byte> pixels, int width, int height, int channels, std::vector<std::byte>& to);

  JpegCompressor compressor_;
};

/// The packed message. Error: damaged.
tl::expected<std::vector<std::byte>, std::string> plain_of(std::span<const std::byte> kept);

}  // namespace takt::record
