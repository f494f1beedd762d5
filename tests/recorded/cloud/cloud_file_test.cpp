// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cloud_file.hpp"

#include <doctest/doctest.h>

#include <string>
#include <utility>

#include "tests/recorded/recording.hpp"

using namespace takt::cloud;

TEST_CASE("recorded clouds") {
  for (const auto& [name, count] : {std::pair{"human/ism_train_michael.pcd", size_t{3400}},
                                    {"registration/bunny/bun0.pcd", 397},
                                    {"registration/car_lidar/cloud_00000.ply", 24989}}) {
    const auto cloud = read_cloud(takt::test::recording(std::string("clouds/") + name));
    REQUIRE_MESSAGE(cloud.has_value(), cloud.error());
    CHECK(cloud->points.size() == count);
  }
}
