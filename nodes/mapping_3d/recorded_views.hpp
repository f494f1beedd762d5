// SPDX-License-Identifier: Apache-2.0
// Depth images from files, with poses: depth/1.png .. (uint16, mm) and pose.txt (tx ty tz qx qy qz qw, camera to
// world), as slambook2 records them; or a TUM RGB-D recording (depth.txt, groundtruth.txt; uint16, 1/5000 m).
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/mapping_3d/depth_view.hpp"
#include "nodes/mapping_3d/generated_world.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::mapping_3d {

struct RecordedView {
  DepthCamera camera;
  Transform camera_in_world;
  std::vector<float> depth_m;
};

/// At half their size. Of a TUM RGB-D recording some neighbouring views, as many as a fusion needs. `left_out` gets
/// what was not read, a sentence each. Throws std::runtime_error that names the file, and the line where there is one.
///
///     std::vector<std::string> left_out;
///     const auto views = read_recorded_views("rgbd_dataset_freiburg1_xyz", left_out);
std::vector<RecordedView> read_recorded_views(const std::filesystem::path& folder, std::vector<std::string>& left_out);

/// As a stereo camera of 0.24 m baseline would have measured it: disparities off by 0.2 px at full size, 2 % of them
/// anything, a tenth missing, nothing beyond 5 m.
std::vector<float> with_stereo_noise(const RecordedView& view, Lot& lot);

}  // namespace takt::mapping_3d
