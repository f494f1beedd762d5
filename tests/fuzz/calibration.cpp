// SPDX-License-Identifier: Apache-2.0
// Any text to the reader of calibrations: read, or refused with the file's name.
#include <stdexcept>

#include "nodes/stereo/calibration_file.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace takt;
using takt::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size > 0 && data[0] == '<') return 0;  // XML is OpenCV's to read
  const fuzz::MemoryFile file(data, size);
  try {
    const stereo::StereoCalibration calibration = stereo::read_calibration(file.path());
    require(calibration.width >= 0 && calibration.height >= 0);
  } catch (const std::invalid_argument& problem) {
    require(std::string_view(problem.what()).find(file.path().string()) != std::string_view::npos);
  }
  return 0;
}
