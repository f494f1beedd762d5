// SPDX-License-Identifier: Apache-2.0
// Any bytes to the readers of PLY and PCD: a colour for each point or none, and what is written again is as much.
#include "nodes/cloud/cloud_file.hpp"
#include "tests/fuzz/require.hpp"

using namespace takt;
using takt::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto cloud = cloud::parse_cloud({reinterpret_cast<const char*>(data), size}, "input");
  if (!cloud) {
    require(cloud.error().starts_with("input:"));
    return 0;
  }
  require(cloud->colours.empty() || cloud->colours.size() == cloud->points.size());
  const auto again = cloud::parse_cloud(cloud::ply_of(cloud->view(), cloud::Encoding::binary), "again");
  require(again && again->points.size() == cloud->points.size() && again->colours.size() == cloud->colours.size());
  return 0;
}
