// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "nodes/object_3d/evaluate.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/object_3d/scene_cloud.hpp"

namespace takt {
void register_object_3d(NodeTypes& types);
}

using namespace takt;
using namespace takt::object_3d;

namespace {

const std::filesystem::path kTraining = takt::test::graph_folder() / "objects_3d.txt";
constexpr Capacity kClouds{0, 0, 1, 320 * 240};

std::unique_ptr<Node> make_node(const std::vector<std::pair<std::string, ParamValue>>& params) {
  NodeTypes types;
  register_object_3d(types);
  auto node = types.find("object_3d")->make();
  for (const auto& [name, value] : params) test::set(*node, name, value);
  return node;
}

/// The node on its bench, and a scene before it.
struct Bench {
  std::unique_ptr<Node> node;
  test::Box<PointCloud> cloud{kClouds};
  uint64_t sequence = 0;

  Bench(const Scene& scene, const std::vector<std::pair<std::string, ParamValue>>& params, bool boxes = false)
      : node(make_node(params)) {
    PortAccess::connect(test::input(*node, "cloud"), kClouds);
    if (boxes) PortAccess::connect(test::input(*node, "detections"), {0, 0, 1, 4});
    test::set_up(*node);
    test::write_scene(scene, *cloud);
  }
  bool run(int64_t stamp_ns = 1234) {
    test::latch(test::input(*node, "cloud"), cloud, stamp_ns, ++sequence);
    return test::run(*node);
  }
};

std::string setup_error(const std::vector<std::pair<std::string, ParamValue>>& params) {
  const auto node = make_node(params);
  PortAccess::connect(test::input(*node, "cloud"), kClouds);
  try {
    test::set_up(*node);
  } catch (const SetupError& error) {
    return error.what();
  }
  return "";
}

/// Which of a message's objects lies nearest to a placed thing.
const Object3d& nearest(const Objects3d& objects, const PlacedModel& placed) {
  size_t best = 0;
  const auto distance = [&](const Object3d& o) { return std::hypot(o.x_m - placed.x, o.y_m - placed.y); };
  for (size_t i = 1; i < objects.objects.size; ++i)
    if (distance(objects.objects[i]) < distance(objects.objects[best])) best = i;
  return objects.objects[best];
}

}  // namespace

TEST_CASE("object_3d labels a scene of three with the shipped training data, each by every classifier") {
  const std::vector<size_t> kinds{0, 3, 4};
  const Scene scene = make_scene(table_models(), kinds, {}, 21, 0);
  for (const char* classifier : {"nearest", "one_vs_rest", "pairwise"}) {
    CAPTURE(classifier);
    Bench bench(scene, {{"training", kTraining.string()}, {"classifier", std::string(classifier)}});
    test::BoxWriter<Objects3d> out(*bench.node->outputs()[0]);
    CHECK_FALSE(test::run(*bench.node));  // nothing latched
    const uint64_t before = thread_memory_use().allocations;
    REQUIRE(bench.run());
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    REQUIRE(out.sent());
    CHECK(out.stamp_ns() == 1234);
    const Objects3d& objects = out.message();
    CHECK(objects.searched == 1);
    CHECK(objects.supported == 1);
    CHECK(objects.support_m + objects.support_b * 1.1 == doctest::Approx(0.75).epsilon(0.005));
    REQUIRE(objects.objects.size == 3);
    for (size_t i = 0; i < kinds.size(); ++i) {
      const Object3d& object = nearest(objects, scene.placed[i]);
      CHECK(object.class_id == static_cast<float>(kinds[i]));
      CHECK(object.score > 0.5f);
      CHECK(object.x_m == doctest::Approx(scene.placed[i].x).epsilon(0.02));
      CHECK(std::abs(object.y_m - scene.placed[i].y) < 0.04);
      CHECK(object.on == -1);
    }
    const Part& carton = scene.placed[0].model.parts[0];
    CHECK(nearest(objects, scene.placed[0]).length_m == doctest::Approx(carton.length).epsilon(0.05));
    CHECK(nearest(objects, scene.placed[0]).z_m == doctest::Approx(0.75 + carton.height / 2).epsilon(0.01));
  }
}

TEST_CASE("object_3d: a thing of no class is unknown; without training data all are") {
  const Scene scene = make_scene(strange_models(), {0}, {}, 22, 0);
  for (const std::string& training : {kTraining.string(), std::string()}) {
    Bench bench(scene, {{"training", training}});
    test::BoxWriter<Objects3d> out(*bench.node->outputs()[0]);
    REQUIRE(bench.run());
    REQUIRE(out.message().objects.size == 1);
    CHECK(out.message().objects[0].class_id == -1);
  }
}

TEST_CASE("object_3d takes the boxes of the cloud's own image, and no others") {
  const Scene scene = make_scene(table_models(), {0}, {}, 23, 0);
  Bench bench(scene, {{"seeds", std::string("boxes")}}, true);
  test::BoxWriter<Objects3d> out(*bench.node->outputs()[0]);
  test::Box<Detections> boxes({0, 0, 1, 4});
  boxes->boxes.push_back({0, 220, 180, 200, 120, 1});
  test::latch(test::input(*bench.node, "detections"), boxes, 1234, 1);
  REQUIRE(bench.run(1234));
  CHECK(out.message().objects.size == 1);
  out.clear();
  REQUIRE(bench.run(9999));
  CHECK(out.message().objects.size == 0);
}

TEST_CASE("object_3d: no more objects than asked for, and out of time it says how far it came") {
  const Scene scene = make_scene(table_models(), {0, 2, 4}, {}, 24, 0);
  Bench bench(scene, {{"max_objects", int64_t{2}}});
  test::BoxWriter<Objects3d> out(*bench.node->outputs()[0]);
  REQUIRE(bench.run());
  CHECK(out.message().objects.size == 2);
  out.clear();
  test::latch(test::input(*bench.node, "cloud"), bench.cloud, 5, 7);
  const VirtualClock late(99'500'000);  // half a millisecond before the deadline, less than `reserve`
  Job job(late, 0, 0, 100'000'000, 0, "full");
  bench.node->run(job);
  REQUIRE(out.sent());
  CHECK(out.message().searched == 0);
  CHECK(out.message().objects.size == 0);
}

TEST_CASE("object_3d: what cannot work is said before start") {
  const auto says = [](const std::string& error, const char* words) { return error.find(words) != std::string::npos; };
  const test::TemporaryFolder folder;
  CHECK(setup_error({}).empty());
  CHECK(says(setup_error({{"seeds", std::string("boxes")}}), "connect it, or choose standing or colour"));
  CHECK(says(setup_error({{"support_low", 2.0}}), "must lie below support_high = 1.2 m"));
  CHECK(says(setup_error({{"training", std::string("/nonexistent")}}), "/nonexistent: cannot be read"));
  const auto one = folder.write("one.txt", "attributes length\nclass a\nsample 1\n").string();
  CHECK(setup_error({{"training", one}}).empty());
  CHECK(says(setup_error({{"training", one}, {"classifier", std::string("pairwise")}}), "needs two at least"));
}
