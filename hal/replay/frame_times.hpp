// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hal/device.hpp"

namespace takt::replay {

/// Instants of recorded frames.
struct FrameTimes {
  std::vector<int64_t> stamp_ns;  ///< since the first frame, rising
  std::string note;               ///< which unit was recognised, or why it is doubted; empty: seconds, without doubt
};

/// One time a line, for `frames` frames: a number in s, ms, us or ns, or a date as in KITTI (2011-09-26
/// 13:02:25.594360375).
/// `#` begins a comment line; what follows a comma or blank is passed over (EuRoC: file names).
///
///     const auto times = read_frame_times("head_camera", "drive/times.txt", 108);
///
/// The unit is the one in which frames are 4 ms to 2 s apart (median). Where it is none, seconds are assumed and `note`
/// says so. Error with file:line: no time, times that do not rise, another number of times.
tl::expected<FrameTimes, DeviceError> read_frame_times(const std::string& device_id, const std::filesystem::path& file,
                                                       size_t frames);

}  // namespace takt::replay
