// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/recorded_views.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt::mapping_3d;
using takt::test::has;

TEST_CASE("a TUM RGB-D recording: depth in 1/5000 m, the nearest pose within 20 ms, the rest counted") {
  const takt::test::TemporaryFolder folder;
  std::filesystem::create_directory(folder.path / "depth");
  std::string depth = "# depth maps\n", poses = "# timestamp tx ty tz qx qy qz qw\n";
  for (int i = 0; i < 12; ++i) {
    const double at = 1305031102.16 + 0.1 * i;
    const std::string name = "depth/" + std::to_string(i) + ".png";
    cv::imwrite((folder.path / name).string(), cv::Mat1w(480, 640, static_cast<uint16_t>(5000 + i)));
    depth += std::to_string(at) + " " + name + "\n";
    if (i != 4) poses += std::to_string(at + 0.01) + " " + std::to_string(i) + " 0 0 0 0 0 1\n";
  }
  folder.write("depth.txt", depth);
  folder.write("groundtruth.txt", poses);
  std::vector<std::string> left_out;
  const auto views = read_recorded_views(folder.path, left_out);
  REQUIRE(views.size() == 6);  // 0, 2, then 5, for 4 has no pose
  CHECK(views[0].camera.width == 320);
  CHECK(views[0].depth_m[1000] == doctest::Approx(1.0));
  CHECK(views[2].camera_in_world.x == 5);
  CHECK(views[2].depth_m[0] == doctest::Approx(1.001));
  REQUIRE(left_out.size() == 1);
  CHECK(has(left_out[0], "6 of 12 depth images are read, 1 have no pose"));
  folder.write("depth.txt", "1 depth/0.png\nsoon depth/1.png\n");
  CHECK_THROWS_WITH_AS(read_recorded_views(folder.path, left_out), doctest::Contains("depth.txt:2: `soon"),
                       std::runtime_error);
}
