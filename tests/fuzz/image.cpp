// SPDX-License-Identifier: Apache-2.0
// Any bytes as a picture: 8 bits of some size, or refused with the file's name.
#include <string_view>

#include "rt/image_file/image_file.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace takt;
using takt::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  // Whose heads we read; the decoders of the others are OpenCV's own matter.
  if (!bytes.starts_with("P") && !bytes.starts_with("\x89PNG")) return 0;
  const fuzz::MemoryFile file(data, size);
  try {
    const cv::Mat image = read_image(file.path(), Channels::as_file);
    require(image.depth() == CV_8U && image.cols > 0 && image.rows > 0);
  } catch (const ImageError& problem) {
    require(std::string_view(problem.what()).starts_with(file.path().string()));
  }
  return 0;
}
