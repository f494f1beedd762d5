// SPDX-License-Identifier: Apache-2.0
// The bytes, the definitions, and that both say the same.
#include "graph/world/schema.hpp"

#include <doctest/doctest.h>

#include <array>
#include <limits>

#include "graph/world/encoder.hpp"
#include "graph/world/scene_schemas.hpp"
#include "tests/unit/world/ros_reader.hpp"

using namespace takt;
using namespace takt::world;
using Json = test::RosReader::Json;

namespace {

std::vector<int> as_numbers(std::span<const std::byte> bytes) {
  std::vector<int> numbers;
  for (const std::byte byte : bytes) numbers.push_back(static_cast<int>(byte));
  return numbers;
}

/// One member of each kind, so that each is aligned behind an odd number of bytes.
struct Inner {
  uint8_t small = 7;
  double large = 1.5;
  TAKT_SCHEMA(Inner, "takt_test/Inner", small, large)
};
struct Every {
  bool yes = true;
  int16_t number = -2;
  std::string_view text = "ab";
  std::span<const Inner> inner;
  uint8_t before = 9;
  std::span<const double> none;
  uint8_t behind = 8;
  std::array<float, 2> fixed{0.5f, -0.5f};
  Widened widened;
  int64_t last = std::numeric_limits<int64_t>::min();
  TAKT_SCHEMA(Every, "takt_test/Every", yes, number, text, inner, before, none, behind, fixed, widened, last)
};

template <Schema S>
Json read_back(const S& value) {
  return test::RosReader(definition<S>()).read(encoded(value));
}

/// A default value of every schema that has a name, through its definition.
template <class... S>
void check_all(const std::tuple<S...>*) {
  (
      [] {
        CAPTURE(S::schema_name);
        const std::string text = schema_text(full_name(S::schema_name));
        CHECK(text == definition<S>());
        CHECK_NOTHROW(test::RosReader(text).read(encoded(S{})));
      }(),
      ...);
}

}  // namespace

TEST_CASE("CDR: a header, values aligned to their size as counted behind it, texts with their 0") {
  std::byte room[64]{};
  CdrWriter writer(room);
  writer.number(uint8_t{1});
  writer.number(uint16_t{0x0203});
  writer.text("hi");
  writer.number(2.0);
  CHECK(writer.complete());
  CHECK(as_numbers(std::span(room).first(writer.bytes())) ==
        std::vector<int>{0, 1, 0, 0, 1, 0, 3, 2, 3, 0, 0, 0, 'h', 'i', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 64});
}

TEST_CASE("CDR: nothing is written behind the end of the room, and what it needs is known") {
  const auto write_some = [](CdrWriter& writer) {
    writer.number(uint8_t{1});
    writer.number(2.0);
    writer.text("text");
  };
  CdrWriter counted({});
  write_some(counted);
  CHECK_FALSE(counted.complete());
  for (size_t size = 0; size <= counted.bytes(); ++size) {
    std::vector<std::byte> bytes(counted.bytes() + 8, std::byte{0xaa});
    CdrWriter writer({bytes.data(), size});
    write_some(writer);
    CHECK(writer.bytes() == counted.bytes());
    CHECK(writer.complete() == (size == counted.bytes()));
    CHECK(std::all_of(bytes.begin() + static_cast<ptrdiff_t>(size), bytes.end(),
                      [](std::byte byte) { return byte == std::byte{0xaa}; }));
  }
}

TEST_CASE("CDR: a sequence longer than CDR can state is refused; a text ends at its first 0") {
  std::byte room[16]{};
  CdrWriter writer(room);
  writer.count(size_t{UINT32_MAX} + 1);
  CHECK_FALSE(writer.complete());
  CdrWriter other(room);
  other.text({"a\0b", 3});
  CHECK(other.bytes() == 4 + 4 + 2);
}

TEST_CASE("A definition is made from the members, those of the schemas that it uses behind it, each once") {
  CHECK(definition<Every>() ==
        "bool yes\nint16 number\nstring text\ntakt_test/Inner[] inner\nuint8 before\n"
        "float64[] none\nuint8 behind\nfloat32[2] fixed\nfloat64[] widened\nint64 last\n" +
            std::string(80, '=') + "\nMSG: takt_test/Inner\nuint8 small\nfloat64 large\n");
  const std::string scene = definition<SceneUpdate>();
  CHECK(scene.find("MSG: geometry_msgs/Pose\n") == scene.rfind("MSG: geometry_msgs/Pose\n"));
  CHECK(scene.find("MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n") != std::string::npos);
}

TEST_CASE("What the definition says is what the bytes hold") {
  const Inner inner[2]{{1, 2.5}, {3, -4.5}};
  const float values[3]{1, -2, 0.25f};
  Every every;
  every.inner = inner;
  every.widened = {values};
  CHECK(read_back(every) == Json{{"yes", true},
                                 {"number", -2},
                                 {"text", "ab"},
                                 {"inner", {{{"small", 1}, {"large", 2.5}}, {{"small", 3}, {"large", -4.5}}}},
                                 {"before", 9},
                                 {"none", Json::array()},
                                 {"behind", 8},
                                 {"fixed", {0.5, -0.5}},
                                 {"widened", {1, -2, 0.25}},
                                 {"last", std::numeric_limits<int64_t>::min()}});
}

TEST_CASE("The reader of these tests sees a definition that does not fit the bytes") {
  const auto bytes = encoded(Inner{});
  CHECK_NOTHROW(test::RosReader(definition<Inner>()).read(bytes));
  for (const char* other :
       {"uint8 small\n", "uint8 small\nfloat64 large\nuint8 more\n", "uint8 small\nfloat32 large\n",
        "float64 large\nuint8 small\n", "string small\nfloat64 large\n", "uint8[] small\nfloat64 large\n"})
    CHECK_THROWS_AS(test::RosReader(other).read(bytes), std::runtime_error);
  CHECK_THROWS_AS(test::RosReader("takt_test/Inner inner\n"), std::runtime_error);
  CHECK_THROWS_AS(test::RosReader("uint8 Small\n"), std::runtime_error);
}

TEST_CASE("Every well-known schema has its definition, which fits its bytes") {
  check_all(
      static_cast<std::tuple<CompressedImage, RawImage, CameraCalibration, CloudOfPoints, Scan, GridOfCells,
                             PoseInFrame, PosesInFrame, FrameTransform, FrameTransforms, Log, SceneUpdate>*>(nullptr));
  CHECK(schema_text("foxglove_msgs/msg/Nothing").empty());
  CHECK(schema_text("").empty());
}

TEST_CASE("A scene holds one of each primitive") {
  const Position points[2]{{1, 2, 3}, {4, 5, 6}};
  const Rgba colours[1]{{0.1, 0.2, 0.3, 0.4}};
  const uint32_t indices[3]{0, 1, 0};
  const uint8_t data[1]{5};
  const LinePrimitive line{1, {}, 0.5, true, points, colours[0], colours, indices};
  const TriangleListPrimitive triangles{{}, points, colours[0], colours, indices};
  const ArrowPrimitive arrow{{}, 1, 2, 3, 4, colours[0]};
  const CylinderPrimitive cylinder{{}, {1, 1, 2}, 1, 0.5, colours[0]};
  const ModelPrimitive model{{}, {1, 1, 1}, {}, true, "file:a", "model/gltf", data};
  SceneEntity entity;
  entity.id = "odd";
  entity.arrows = {&arrow, 1};
  entity.cylinders = {&cylinder, 1};
  entity.lines = {&line, 1};
  entity.triangles = {&triangles, 1};
  entity.models = {&model, 1};
  const Json json = read_back(SceneUpdate{{}, {&entity, 1}})["entities"][0];
  CHECK(json["lines"][0]["points"][1]["y"] == 5);
  CHECK(json["lines"][0]["indices"] == Json{0, 1, 0});
  CHECK(json["triangles"][0]["colors"][0]["a"] == 0.4);
  CHECK(json["arrows"][0]["head_diameter"] == 4);
  CHECK(json["cylinders"][0]["top_scale"] == 0.5);
  CHECK(json["models"][0]["data"] == Json{5});
  CHECK(json["models"][0]["url"] == "file:a");
}

TEST_CASE("A time before the start of its clock, and one that does not fit") {
  CHECK(time_of(1'500'000'000).nanosec == 500'000'000);
  CHECK(time_of(-1).sec == -1);
  CHECK(time_of(-1).nanosec == 999'999'999);
  CHECK(time_of(std::numeric_limits<int64_t>::max()).sec == std::numeric_limits<int32_t>::max());
  CHECK(time_of(std::numeric_limits<int64_t>::min()).sec == std::numeric_limits<int32_t>::min());
}
