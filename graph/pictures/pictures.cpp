// SPDX-License-Identifier: Apache-2.0
#include "graph/pictures/pictures.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/draw.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {
namespace {

constexpr int kPixelsPerCell = 6;

/// What can be drawn, side by side; the first sets height and colours, and what has others is left out.
class Drawing final : public Viewer {
 public:
  void picture(const ImageView<const uint8_t>& view, std::string_view) override {
    add({view.height, view.width, view.channels == 3 ? CV_8UC3 : CV_8UC1, const_cast<uint8_t*>(view.data)});
  }
  void disparity(const ImageView<const int16_t>& map, int disparities) override {
    cv::Mat out(map.height, map.width, CV_8UC3);
    picture::draw_disparity(map, disparities, {out.data, out.cols, out.rows, 3});
    add(out);
  }
  void grid(const Cells& grid) override {
    cv::Mat out(grid.cells.height * kPixelsPerCell, grid.cells.width * kPixelsPerCell, CV_8UC3);
    picture::draw_grid(grid.cells, kPixelsPerCell, {out.data, out.cols, out.rows, 3});
    add(out);
  }
  void cloud(std::span<const Point> points, std::span<const Colour> colours) override {
    const cloud::CloudView view{points, colours};
    add(picture::draw_clouds({&view, 1}));
  }
  const cv::Mat& all() const { return all_; }

 private:
  void add(const cv::Mat& image) {
    if (all_.empty()) all_ = image;
    else if (image.rows == all_.rows && image.type() == all_.type()) cv::hconcat(all_, image, all_);
  }
  cv::Mat all_;
};

/// The first cloud.
class CloudFile final : public Viewer {
 public:
  void cloud(std::span<const Point> points, std::span<const Colour> colours) override {
    if (!ply) ply = cloud::ply_of({points, colours}, cloud::Encoding::binary);
  }
  std::optional<std::string> ply;
};

bool show(const MessageType& type, const void* message, Viewer& to) {
  const bool shown = type.show != nullptr && type.sound(message);
  if (shown) type.show(message, to);
  return shown;
}

}  // namespace

std::optional<std::string> message_png(const MessageType& type, const void* message) {
  Drawing drawing;
  std::vector<uint8_t> png;
  if (!show(type, message, drawing) || drawing.all().empty() ||
      !cv::imencode(".png", drawing.all(), png, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    return std::nullopt;
  return std::string(png.begin(), png.end());
}

std::optional<std::string> message_ply(const MessageType& type, const void* message) {
  CloudFile file;
  if (!show(type, message, file)) return std::nullopt;
  return file.ply;
}

void register_pictures(Registry& registry) { registry.pictures = {message_png, message_ply}; }

}  // namespace takt
