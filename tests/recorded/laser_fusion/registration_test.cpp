// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/registration.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/laser_fusion/evaluate.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt;
using namespace takt::laser_fusion;
using takt::test::recording;

namespace {

/// Rows of a 4 x 4 matrix.
Rigid read_pose(const std::filesystem::path& file) {
  std::ifstream in(file);
  Rigid pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) in >> pose.R(row, column);
    in >> pose.t(row);
  }
  REQUIRE(in);
  return pose;
}

Rigid registered(const std::filesystem::path& folder, const char* moving_file, const char* fixed_file,
                 uint32_t generations) {
  const auto moving = cloud::read_cloud(folder / moving_file), fixed = cloud::read_cloud(folder / fixed_file);
  REQUIRE(moving);
  REQUIRE(fixed);
  Registration registration(fixed->view(), moving->view(), {.genetic = {.generations = generations}});
  return registration.refined(registration.search({}));
}

}  // namespace

TEST_CASE("the bunny from its front to its side, as Stanford, where it was scanned, aligned it") {
  const auto folder = recording("clouds/registration/bunny");
  // The reference beside the clouds, a result of 50 steps of PCL's ICP, is 6.4 degrees away from that.
  const PoseError error =
      error_of(registered(folder, "bun0.pcd", "bun4.pcd", 4000),
               read_pose(std::filesystem::path(TAKT_SOURCE_DIR) / "nodes/laser_fusion/bunny_stanford.txt"));
  CHECK(error.m < 0.002);
  CHECK(error.rad < 0.01);
}

TEST_CASE("a lidar on a car that turned by 15 degrees, as libpointmatcher has it") {
  const auto folder = recording("clouds/registration/car_lidar");
  const PoseError error = error_of(registered(folder, "cloud_00001.ply", "cloud_00000.ply", 4000),
                                   read_pose(folder / "reference_transform.txt"));
  CHECK(error.m < 0.05);
  CHECK(error.rad < 0.0087);
}
