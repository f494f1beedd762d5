// SPDX-License-Identifier: Apache-2.0
#include "graph/pictures/pictures.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/draw.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/point_cloud.hpp"

namespace takt {
namespace {

constexpr int kPixelsPerCell = 6;

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

void register_pictures(Registry& registry) { registry.pictures = {message_png, message_ply}; }

}  // namespace takt
