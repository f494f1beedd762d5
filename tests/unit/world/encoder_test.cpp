// SPDX-License-Identifier: Apache-2.0
#include "graph/world/encoder.hpp"

#include <doctest/doctest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <thread>

#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/record/packed_message.hpp"
#include "tests/unit/world/placed.hpp"
#include "tests/unit/world/ros_reader.hpp"

using namespace takt;
using namespace takt::world;
using test::Placed;
using Json = test::RosReader::Json;

namespace {

constexpr int64_t kStamp_ns = 12'000'000'345;
const Json kTime{{"sec", 12}, {"nanosec", 345}};

/// One scalar of each type, a text, elements of several scalars, names that ROS 2 does not allow.
struct Odd {
  struct Pair {
    using scalar = int16_t;
    int16_t a, b;
  };
  static constexpr std::string_view type_name = "odd_2.type";
  uint8_t timestamp = 4;
  double Speed_ = 0.5;
  uint64_t large = UINT64_MAX;
  float range__m[3] = {1, 2, 3};
  Transform at;
  Array<Pair> pairs;
  Array<char> text;
  Array<double> last;
  TAKT_FIELDS(Odd, (timestamp, "s"), (Speed_, "m/s"), (large, ""), (range__m, "m"), (at), (pairs, "1"), (text, ""),
              (last, "two\nlines"))
};

/// Two pictures and a cloud of one topic; not sound if told so.
struct Crowd {
  static constexpr std::string_view type_name = "crowd";
  uint8_t bad = 0;
  bool sound() const { return bad == 0; }
  void show(Viewer& to) const {
    const uint8_t pixel = 3;
    to.picture({&pixel, 1, 1});
    to.picture({&pixel, 1, 1});
    to.cloud({}, {});
    to.text("all");
  }
  TAKT_FIELDS(Crowd, (bad, ""))
};

/// By topic.
template <class T>
std::map<std::string, Form> forms(Placed<T>& message, const Encoder& encoder = {}, const Wanted& wanted = {}) {
  std::map<std::string, Form> found;
  for (Form& form : encoder.forms(MessageType::of<T>(), message.get(), "eye", kStamp_ns, wanted))
    found.emplace(form.topic, std::move(form));
  return found;
}

Json read(const Form& form, std::span<const Field> fields = {}) {
  return test::RosReader(schema_text(form.schema, fields)).read(form.bytes);
}

Json read(const Form& form, const std::string& schema) {
  CHECK(form.schema == "foxglove_msgs/msg/" + schema);
  return read(form);
}

std::string topics(const std::map<std::string, Form>& forms) {
  std::string text;
  for (const auto& [topic, form] : forms) text += topic + " ";
  return text;
}

std::vector<uint8_t> pixels_of(const Json& jpeg, int width, int height, int channels) {
  const std::vector<uint8_t> bytes = jpeg;
  std::vector<uint8_t> pixels(static_cast<size_t>(width * height * channels));
  const tjhandle decompressor = tjInitDecompress();
  int w = 0, h = 0, sampling = 0, colours = 0;
  CHECK(tjDecompressHeader3(decompressor, bytes.data(), bytes.size(), &w, &h, &sampling, &colours) == 0);
  CHECK(w == width);
  CHECK(h == height);
  CHECK((colours == TJCS_GRAY) == (channels == 1));
  CHECK(tjDecompress2(decompressor, bytes.data(), bytes.size(), pixels.data(), w, 0, h,
                      channels == 1 ? TJPF_GRAY : TJPF_BGR, 0) == 0);
  tjDestroy(decompressor);
  return pixels;
}

Placed<StereoPair> pair(int channels) {
  Placed<StereoPair> pair({32, 16, static_cast<uint32_t>(channels)});
  pair->width = 32, pair->height = 16, pair->channels = channels;
  pair->left.resize(pair->left.capacity), pair->right.resize(pair->right.capacity);
  for (uint32_t i = 0; i < pair->left.size; ++i)
    pair->left[i] = static_cast<uint8_t>(100 + i / 16), pair->right[i] = static_cast<uint8_t>(200 - i / 16);
  return pair;
}

}  // namespace

TEST_CASE("A pair is two JPEG that look like its pictures, and its calibration once it is rectified") {
  for (const int channels : {1, 3}) {
    auto message = pair(channels);
    CHECK(topics(forms(message)) == ".left .right ");
    message->camera = {400, 15, 7, 0.1};
    const auto all = forms(message, Encoder({.jpeg_quality = 95}));
    CHECK(topics(all) == ".left .left.calibration .right .right.calibration ");
    for (const char* side : {"left", "right"}) {
      const Json image = read(all.at(std::string(".") + side), "CompressedImage");
      CHECK(image["timestamp"] == kTime);
      CHECK(image["frame_id"] == "eye");
      CHECK(image["format"] == "jpeg");
      const auto pixels = pixels_of(image["data"], 32, 16, channels);
      const auto& wanted = side[0] == 'l' ? message->left : message->right;
      int worst = 0;
      for (uint32_t i = 0; i < wanted.size; ++i) worst = std::max(worst, std::abs(pixels[i] - wanted[i]));
      CHECK(worst <= 12);
    }
    const Json left = read(all.at(".left.calibration"), "CameraCalibration");
    CHECK(left["k"] == Json{400, 0, 15, 0, 400, 7, 0, 0, 1});
    CHECK(left["p"] == Json{400, 0, 15, 0, 0, 400, 7, 0, 0, 0, 1, 0});
    CHECK(left["width"] == 32);
    CHECK(read(all.at(".right.calibration"))["p"][3] == -40);
  }
}

TEST_CASE("Pictures are raw if asked for, and the rows of a disparity are 16 bits a pixel") {
  auto message = pair(3);
  const Json raw = read(forms(message, Encoder({.jpeg_quality = 0})).at(".left"), "RawImage");
  CHECK(raw["encoding"] == "bgr8");
  CHECK(raw["step"] == 96);
  CHECK(raw["data"].get<std::vector<uint8_t>>() ==
        std::vector<uint8_t>(message->left.items().begin(), message->left.items().end()));
  Placed<DisparityMap> map({2, 1});
  map->width = 2, map->height = 1, map->camera.focal_px = 1;
  map->disparity.push_back(-1), map->disparity.push_back(258);
  const auto all = forms(map);
  CHECK(topics(all) == " .calibration ");
  const Json disparity = read(all.at(""), "RawImage");
  CHECK(disparity["encoding"] == "16UC1");
  CHECK(disparity["step"] == 4);
  CHECK(disparity["data"] == Json{255, 255, 2, 1});
}

TEST_CASE("Only what is wanted is made, and an outline tells what there is") {
  auto message = pair(1);
  std::string asked;
  const auto some = forms(message, {}, [&](std::string_view topic) {
    asked += std::string(topic) + " ";
    return topic == ".right";
  });
  CHECK(asked == ".left .right ");
  CHECK(topics(some) == ".right ");
  std::string told;
  for (const auto& [topic, schema] : Encoder().outline(MessageType::of<StereoPair>(), message.get()))
    told += topic + " " + schema + " ";
  CHECK(told == ".left foxglove_msgs/msg/CompressedImage .right foxglove_msgs/msg/CompressedImage ");
  CHECK(topic_of("eye.pair", ".left") == "eye.pair.left");
  CHECK(topic_of("eye.pair", "/tf") == "/tf");
}

TEST_CASE("An outline and the forms agree for every kind of message") {
  const auto agree = [](const MessageType& type, const void* message) {
    const auto outline = Encoder().outline(type, message);
    const auto forms = Encoder().forms(type, message, "n", 0);
    REQUIRE(outline.size() == forms.size());
    for (size_t i = 0; i < forms.size(); ++i) {
      CHECK(outline[i].topic == forms[i].topic);
      CHECK(outline[i].schema == forms[i].schema);
    }
  };
  agree(MessageType::of<StereoPair>(), pair(3).get());
  agree(MessageType::of<Crowd>(), Placed<Crowd>({}).get());
  agree(MessageType::of<Odd>(), Placed<Odd>({}).get());
  agree(MessageType::of<Objects3d>(), Placed<Objects3d>({0, 0, 1, 2}).get());
  agree(MessageType::of<LaserScan>(), Placed<LaserScan>({}).get());
  agree(MessageType::of<Image>(), Placed<Image>({}).get());
}

TEST_CASE("A scan, where its sensor sits, a pose, a text") {
  Placed<LaserScan> scan({0, 0, 1, 3});
  scan->first_angle_rad = -1, scan->step_rad = 0.25;
  for (const float range : {1.5f, 0.f, 8.25f}) scan->range_m.push_back(range);
  scan->sensor_in_robot = {1, 2, 3, 0.5, 0.5, -0.5, 0.5};
  const auto all = forms(scan);
  const Json json = read(all.at(""), "LaserScan");
  CHECK(json["start_angle"] == -1);
  CHECK(json["end_angle"] == -0.5);
  CHECK(json["ranges"] == Json{1.5, 0, 8.25});
  CHECK(json["intensities"].empty());
  const Json mount = read(all.at("/tf"), "FrameTransform");
  CHECK(mount["parent_frame_id"] == "robot");
  CHECK(mount["child_frame_id"] == "eye");
  CHECK(mount["translation"] == Json{{"x", 1}, {"y", 2}, {"z", 3}});
  CHECK(mount["rotation"] == Json{{"x", 0.5}, {"y", -0.5}, {"z", 0.5}, {"w", 0.5}});
  Placed<Odometry> odometry({});
  odometry->x_m = 4;
  const Json pose = read(forms(odometry).at(""), "PoseInFrame");
  CHECK(pose["frame_id"] == "odometry");
  CHECK(pose["pose"]["position"]["x"] == 4);
  Placed<TextStatus> text({0, 0, 1, 8});
  for (const char letter : {'h', 'i'}) text->text.push_back(letter);
  const Json log = read(forms(text).at(""), "Log");
  CHECK(log["message"] == "hi");
  CHECK(log["name"] == "eye");
  CHECK(log["level"] == 2);
  CHECK(read(log_form(kStamp_ns, "cruise", "started"), "Log")["level"] == 2);
  const Json lost = read(log_form(kStamp_ns, "cruise", "lost", LogLevel::error), "Log");
  CHECK(lost["name"] == "cruise");
  CHECK(lost["level"] == 4);
}

TEST_CASE("A cloud has 16 bytes a point, white where it has no colour; a grid its cells") {
  Placed<PointCloud> cloud({0, 0, 1, 2});
  cloud->points.push_back({1, 2, 3}), cloud->points.push_back({4, 5, 6});
  cloud->colours.push_back({10, 20, 30});
  const Json json = read(forms(cloud).at(""), "PointCloud");
  CHECK(json["point_stride"] == 16);
  const std::vector<uint8_t> data = json["data"];
  REQUIRE(data.size() == 32);
  CHECK(std::vector<uint8_t>(data.begin() + 12, data.begin() + 16) == std::vector<uint8_t>{30, 20, 10, 255});
  CHECK(std::vector<uint8_t>(data.begin() + 28, data.end()) == std::vector<uint8_t>{255, 255, 255, 255});
  const Json z = json["fields"][2];
  CHECK(z == Json{{"name", "z"}, {"offset", 8}, {"type", 7}});
  float value = 0;
  std::memcpy(&value, data.data() + 16 + 8, sizeof value);
  CHECK(value == 6);
  Placed<Grid> grid({2, 1});
  grid->width = 2, grid->height = 1, grid->cell_m = 0.5, grid->origin_x_m = -1;
  grid->cells.push_back(-1), grid->cells.push_back(1000);
  const Json cells = read(forms(grid).at(""), "Grid");
  CHECK(cells["column_count"] == 2);
  CHECK(cells["row_stride"] == 4);
  CHECK(cells["cell_size"]["x"] == 0.5);
  CHECK(cells["pose"]["position"]["x"] == -1);
  CHECK(cells["data"] == Json{255, 255, 232, 3});
}

TEST_CASE("Objects are a scene that replaces the one before, next to their fields") {
  Placed<Objects3d> message({0, 0, 1, 3});
  Object3d thing{};
  thing.class_id = 2, thing.score = 0.75f, thing.x_m = 1, thing.z_m = 0.5f;
  thing.length_m = 0.4f, thing.width_m = 0.3f, thing.height_m = 0.2f;
  message->objects.push_back(thing);
  thing.class_id = NAN, thing.length_m = 0;
  message->objects.push_back(thing);
  const auto all = forms(message);
  CHECK(topics(all) == " .scene ");
  const Json fields = read(all.at(""), Objects3d::fields());
  CHECK(all.at("").schema == "takt_msgs/msg/Objects3d");
  CHECK(fields["objects"].size() == 2 * sizeof(Object3d) / sizeof(float));
  const Json scene = read(all.at(".scene"), "SceneUpdate");
  CHECK(scene["deletions"] == Json::array({Json{{"timestamp", kTime}, {"type", 1}, {"id", ""}}}));
  REQUIRE(scene["entities"].size() == 2);
  const Json& first = scene["entities"][0];
  CHECK(first["frame_id"] == "robot");
  CHECK(first["cubes"][0]["size"]["x"] == static_cast<double>(0.4f));
  CHECK(first["texts"][0]["text"] == "class 2");
  CHECK(first["metadata"][1] == Json{{"key", "confidence"}, {"value", "0.75"}});
  CHECK(first["spheres"].empty());
  const Json& second = scene["entities"][1];  // of unknown size
  CHECK(second["cubes"].empty());
  CHECK(second["spheres"][0]["pose"]["position"]["z"] == 0.5);
  CHECK(second["metadata"][0]["value"] == "unknown");
  CHECK(second["id"] != first["id"]);
}

TEST_CASE("The semantic map has names and a frame; people have the box around the joints that were found") {
  Placed<ObjectReports> map({0, 0, 1, 2});
  map->in_map = 1;
  ObjectName name;
  std::fill_n(name.name, sizeof name.name, 'x');  // no 0 at its end
  std::memcpy(name.type, "cup", 4);
  map->names.push_back(name);
  map->names.push_back({});
  map->places.push_back({1, 2, 3, 0, 0.5f, 0});
  const Json scene = read(forms(map).at(".scene"), "SceneUpdate");
  REQUIRE(scene["entities"].size() == 1);  // as many as have both
  CHECK(scene["entities"][0]["frame_id"] == "map");
  CHECK(scene["entities"][0]["texts"][0]["text"] == std::string(32, 'x') + " (cup)");
  Placed<BodyPoses> people({0, 0, 1, 2});
  Body body{};
  people->bodies.push_back(body);  // nothing of it was found
  body.joints[0] = {1, 2, 0.5f, 1}, body.joints[3] = {2, 4, 1.5f, 0.5f};
  body.joints[4] = {9, 9, 9, 0};
  body.valid = 1;
  people->bodies.push_back(body);
  const Json persons = read(forms(people).at(".scene"), "SceneUpdate")["entities"];
  REQUIRE(persons.size() == 1);
  CHECK(persons[0]["cubes"][0]["pose"]["position"] == Json{{"x", 1.5}, {"y", 3}, {"z", 1}});
  CHECK(persons[0]["cubes"][0]["size"] == Json{{"x", 1}, {"y", 2}, {"z", 1}});
}

TEST_CASE("A message that shows nothing has its fields, under names that ROS 2 allows") {
  Placed<Odd> odd({0, 0, 1, 4});
  odd->pairs.push_back({-1, 2});
  for (const char letter : {'o', 'k'}) odd->text.push_back(letter);
  odd->last.push_back(2.5);
  const auto all = forms(odd);
  REQUIRE(topics(all) == " ");
  CHECK(all.at("").schema == "takt_msgs/msg/Odd2Type");
  const Json json = read(all.at(""), Odd::fields());
  CHECK(json["timestamp"] == kTime);
  CHECK(json["timestamp_2"] == 4);
  CHECK(json["speed"] == 0.5);
  CHECK(json["large"] == UINT64_MAX);
  CHECK(json["range_m"] == Json{1, 2, 3});
  CHECK(json["at_qw"] == 1);
  CHECK(json["pairs"] == Json{-1, 2});
  CHECK(json["text"] == "ok");
  CHECK(json["last"] == Json{2.5});
  const std::string text = schema_text(all.at("").schema, Odd::fields());
  CHECK(text.find("int16[] pairs  # 1, 2 for each element\n") != std::string::npos);
  CHECK(text.find("float64[] last  # two lines\n") != std::string::npos);
  std::vector<std::byte> packed;
  record::pack(MessageType::of<Odd>(), odd.get(), packed);
  const auto of_record = own_form(Odd::type_name, Odd::fields(), packed, kStamp_ns);
  REQUIRE(of_record);
  CHECK(of_record->bytes == all.at("").bytes);
  for (size_t size = 0; size < packed.size(); ++size)
    CHECK_FALSE(own_form(Odd::type_name, Odd::fields(), std::span(packed).first(size), 0));
  packed.push_back({});
  CHECK(own_form(Odd::type_name, Odd::fields(), packed, 0).error() == "1 bytes too many");
}

TEST_CASE("Two forms of a message have two topics; a message that is not sound has none") {
  Placed<Crowd> crowd({});
  CHECK(topics(forms(crowd)) == " .cloud .picture .text ");
  crowd->bad = 1;
  CHECK(forms(crowd).empty());
  CHECK(Encoder().outline(MessageType::of<Crowd>(), crowd.get()).empty());
  Placed<Image> empty({4, 4});
  CHECK(forms(empty).empty());  // no pixels
}

TEST_CASE("One encoder serves several threads") {
  auto message = pair(3);
  const Encoder encoder;
  const auto wanted = encoder.forms(MessageType::of<StereoPair>(), message.get(), "eye", 1);
  std::vector<std::thread> threads;
  std::vector<int> same(3);
  for (int& one : same)
    threads.emplace_back([&] {
      for (int round = 0; round < 20; ++round) {
        const auto got = encoder.forms(MessageType::of<StereoPair>(), message.get(), "eye", 1);
        one += got.size() == wanted.size() && got[0].bytes == wanted[0].bytes && got[1].bytes == wanted[1].bytes;
      }
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(same == std::vector<int>(3, 20));
}
