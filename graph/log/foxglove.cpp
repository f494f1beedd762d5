// SPDX-License-Identifier: Apache-2.0
#include "graph/log/foxglove.hpp"

#include "graph/view/markup.hpp"

namespace takt::log {
namespace {

/// Numbers that Foxglove's schemas give to the types of packed elements.
enum class Numeric : int { u8 = 1, i16 = 4, f32 = 7 };

std::string packed(const void* elements, size_t bytes) {
  return view::base64({static_cast<const char*>(elements), bytes});
}

Json vector_json(double x, double y, double z) { return {{"x", x}, {"y", y}, {"z", z}}; }

Json quaternion_json(const Transform& t) { return {{"x", t.qx}, {"y", t.qy}, {"z", t.qz}, {"w", t.qw}}; }

Json pose_json(const Transform& t) {
  return {{"position", vector_json(t.x, t.y, t.z)}, {"orientation", quaternion_json(t)}};
}

Json field_json(const char* name, int offset, Numeric type) {
  return {{"name", name}, {"offset", offset}, {"type", static_cast<int>(type)}};
}

}  // namespace

Json time_json(int64_t ns) { return {{"sec", ns / 1'000'000'000}, {"nsec", ns % 1'000'000'000}}; }

Json log_json(int64_t at_ns, const std::string& name, const std::string& text) {
  return {{"timestamp", time_json(at_ns)},
          {"level", 2},  // INFO
          {"message", text},
          {"name", name},
          {"file", ""},
          {"line", 0}};
}

Json FoxgloveViewer::begin(std::string_view frame) const {
  return {{"timestamp", time_json(stamp_ns_)}, {"frame_id", frame}};
}

void FoxgloveViewer::raw_image(int width, int height, const char* encoding, int pixel_bytes, const void* pixels,
                               std::string topic) {
  Json json = begin(node_);
  json["width"] = width;
  json["height"] = height;
  json["encoding"] = encoding;
  json["step"] = width * pixel_bytes;
  json["data"] =
      packed(pixels, static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(pixel_bytes));
  forms.push_back({std::move(topic), "foxglove.RawImage", std::move(json)});
}

void FoxgloveViewer::picture(const ImageView<const uint8_t>& image, std::string_view part) {
  raw_image(image.width, image.height, image.channels == 3 ? "bgr8" : "mono8", image.channels, image.data,
            (part.empty() ? "" : ".") + std::string(part));
}

void FoxgloveViewer::disparity(const ImageView<const int16_t>& map, int) {
  raw_image(map.width, map.height, "16UC1", sizeof(int16_t), map.data, "");
}

void FoxgloveViewer::cloud(std::span<const Point> points, std::span<const Colour> colours) {
  struct Element {
    Point point;
    uint8_t red, green, blue, alpha;
  };
  std::vector<Element> elements(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const Colour colour = i < colours.size() ? colours[i] : Colour{255, 255, 255};
    elements[i] = {points[i], colour.r, colour.g, colour.b, 255};
  }
  Json json = begin(node_);
  json["pose"] = pose_json({});
  json["point_stride"] = sizeof(Element);
  json["fields"] = {field_json("x", 0, Numeric::f32),     field_json("y", 4, Numeric::f32),
                    field_json("z", 8, Numeric::f32),     field_json("red", 12, Numeric::u8),
                    field_json("green", 13, Numeric::u8), field_json("blue", 14, Numeric::u8),
                    field_json("alpha", 15, Numeric::u8)};
  json["data"] = packed(elements.data(), elements.size() * sizeof(Element));
  forms.push_back({"", "foxglove.PointCloud", std::move(json)});
}

void FoxgloveViewer::scan(const Scan& scan) {
  const auto steps = static_cast<double>(scan.range_m.empty() ? 0 : scan.range_m.size() - 1);
  Json json = begin(node_);
  json["pose"] = pose_json({});
  json["start_angle"] = scan.first_angle_rad;
  json["end_angle"] = scan.first_angle_rad + steps * scan.step_rad;
  json["ranges"] = Json::array();
  for (const float range : scan.range_m) json["ranges"].push_back(range);
  json["intensities"] = Json::array();
  forms.push_back({"", "foxglove.LaserScan", std::move(json)});
}

void FoxgloveViewer::grid(const Cells& grid) {
  const auto& [cells, cell_m, origin_x_m, origin_y_m] = grid;
  Json json = begin("robot");
  json["pose"] = pose_json({.x = origin_x_m, .y = origin_y_m});
  json["column_count"] = cells.width;
  json["cell_size"] = {{"x", cell_m}, {"y", cell_m}};
  json["row_stride"] = cells.width * 2;
  json["cell_stride"] = 2;
  json["fields"] = Json::array({field_json("occupancy", 0, Numeric::i16)});  // 0 free .. 1000 occupied, -1 unknown
  json["data"] = packed(cells.data, static_cast<size_t>(cells.width) * static_cast<size_t>(cells.height) * 2);
  forms.push_back({"", "foxglove.Grid", std::move(json)});
}

void FoxgloveViewer::pose(const Transform& pose, std::string_view frame) {
  Json json = begin(frame);
  json["pose"] = pose_json(pose);
  forms.push_back({"", "foxglove.PoseInFrame", std::move(json)});
}

void FoxgloveViewer::text(std::string_view text) {
  forms.push_back({"", "foxglove.Log", log_json(stamp_ns_, node_, std::string(text))});
}

void FoxgloveViewer::mounted(const Transform& sensor_in_robot) {
  Json json{{"timestamp", time_json(stamp_ns_)}, {"parent_frame_id", "robot"}, {"child_frame_id", node_}};
  json["translation"] = vector_json(sensor_in_robot.x, sensor_in_robot.y, sensor_in_robot.z);
  json["rotation"] = quaternion_json(sensor_in_robot);
  forms.push_back({"/tf", "foxglove.FrameTransform", std::move(json)});
}

}  // namespace takt::log
