// SPDX-License-Identifier: Apache-2.0
// The node in a graph of its own, at its rate in virtual time: clouds in, labelled objects out.
#include <doctest/doctest.h>

#include "tests/unit/compose/drive.hpp"
#include "tests/unit/object_3d/table_probe.hpp"

using namespace takt;

namespace {

constexpr test::DriveGraph kGraph{
    .devices = R"(
  base: {kind: mobile_base, rate: 5}
)",
    .nodes = R"(
    probe: {type: probe, in: {objects: object_3d.objects}}
    object_3d: {type: object_3d, in: {cloud: probe.cloud}, params: {training: @/objects_3d.txt}}
)",
    .schedule = R"(
  base: {rate: 5, budget: 1ms}
  probe: {rate: 5, offset: 5ms, budget: 5ms, criticality: high}
  object_3d: {rate: 5, offset: 20ms, budget: 20ms}
)",
};

}  // namespace

TEST_CASE("object_3d at 5 Hz in a graph: each cloud gives its three objects by their names") {
  const test::Drive<test::TableProbe> drive(kGraph, 2'000'000'000);
  const auto& seen = drive.probe().seen;
  CHECK(seen.clouds == 10);
  CHECK(seen.messages >= 8);
  CHECK(seen.objects == 3 * seen.messages);
  CHECK(seen.right == seen.objects);
}
