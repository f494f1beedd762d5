// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/message_text.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/draw.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/robot_task.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/msg/text_status.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kPixelsPerCell = 6;

Json scalars(Scalar scalar, const std::byte* at, size_t count) {
  const auto value_at = [&](size_t i) {
    return visit_scalar(scalar, at + i * scalar_bytes(scalar), [](auto value) { return Json(value); });
  };
  if (count == 1) return value_at(0);
  Json list = Json::array();
  for (size_t i = 0; i < count; ++i) list.push_back(value_at(i));
  return list;
}

Json array_json(const Field& field, const std::byte* at, size_t element_bytes, size_t items) {
  const Array<std::byte>& array = any_array(at);
  const std::byte* data = array.data();
  Json first = Json::array();
  for (size_t i = 0; i < std::min<size_t>(array.size, items); ++i)
    first.push_back(scalars(field.scalar, data + i * element_bytes, element_bytes / scalar_bytes(field.scalar)));
  return {{"size", array.size}, {"first", first}};
}

cv::Mat wrap(ImageView<const uint8_t> view) {
  return {view.height, view.width, view.channels == 3 ? CV_8UC3 : CV_8UC1, const_cast<uint8_t*>(view.data)};
}

cv::Mat draw(const DisparityMap& map) {
  cv::Mat out(map.height, map.width, CV_8UC3);
  picture::draw_disparity(map.view(), map.disparities, {out.data, out.cols, out.rows, 3});
  return out;
}

cv::Mat draw(const Grid& grid) {
  cv::Mat out(grid.height * kPixelsPerCell, grid.width * kPixelsPerCell, CV_8UC3);
  picture::draw_grid(grid.view(), kPixelsPerCell, {out.data, out.cols, out.rows, 3});
  return out;
}

cv::Mat draw(const StereoPair& pair) {
  cv::Mat both;
  cv::hconcat(wrap(pair.left_view()), wrap(pair.right_view()), both);
  return both;
}

cv::Mat draw(const PointCloud& cloud) {
  const cloud::CloudView view{cloud.points.items(), cloud.colours.items()};
  return picture::draw_clouds({&view, 1});
}

cv::Mat picture_of(const MessageType& type, const void* message) {
  if (type.name == Image::type_name) return wrap(static_cast<const Image*>(message)->view());
  if (type.name == StereoPair::type_name) return draw(*static_cast<const StereoPair*>(message));
  if (type.name == DisparityMap::type_name) return draw(*static_cast<const DisparityMap*>(message));
  if (type.name == Grid::type_name) return draw(*static_cast<const Grid*>(message));
  if (type.name == PointCloud::type_name) return draw(*static_cast<const PointCloud*>(message));
  return {};
}

}  // namespace

nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items) {
  Json json;
  const auto* bytes = static_cast<const std::byte*>(message);
  for (const Field& field : type.fields) {
    const std::string name(field.name);
    if (!field.is_array()) {
      json[name] = scalars(field.scalar, bytes + field.offset, field.count);
    } else if (type.name == TextStatus::type_name || type.name == RobotTask::type_name) {
      const auto& text = *reinterpret_cast<const Array<char>*>(bytes + field.offset);
      json[name] = std::string(text.data(), text.size);
    } else {
      json[name] = array_json(field, bytes + field.offset, field.element_bytes, items);
    }
  }
  return json;
}

std::optional<std::string> message_png(const MessageType& type, const void* message) {
  const cv::Mat image = picture_of(type, message);
  std::vector<uint8_t> png;
  if (image.empty() || !cv::imencode(".png", image, png, {cv::IMWRITE_PNG_COMPRESSION, 1})) return std::nullopt;
  return std::string(png.begin(), png.end());
}

std::optional<std::string> message_ply(const MessageType& type, const void* message) {
  if (type.name != PointCloud::type_name) return std::nullopt;
  const auto& cloud = *static_cast<const PointCloud*>(message);
  return cloud::ply_of({cloud.points.items(), cloud.colours.items()}, cloud::Encoding::binary);
}

}  // namespace takt::attach
