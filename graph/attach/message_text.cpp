// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/message_text.hpp"

#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/picture/clouds.hpp"
#include "nodes/picture/draw.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/msg/viewer.hpp"

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

/// An array of `size` elements.
Json array_json(const Field& field, const std::byte* data, size_t size, size_t items) {
  if (field.text) return std::string(reinterpret_cast<const char*>(data), size);
  Json first = Json::array();
  const size_t bytes = field.element_bytes;
  for (size_t i = 0; i < std::min(size, items); ++i)
    first.push_back(scalars(field.scalar, data + i * bytes, bytes / scalar_bytes(field.scalar)));
  return {{"size", size}, {"first", first}};
}

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

nlohmann::ordered_json message_json(const MessageType& type, const void* message, size_t items) {
  Json json;
  const auto* bytes = static_cast<const std::byte*>(message);
  for (const Field& field : type.fields) {
    const std::string name(field.name);
    if (!field.is_array()) {
      json[name] = scalars(field.scalar, bytes + field.offset, field.count);
    } else {
      const Array<std::byte>& array = any_array(bytes + field.offset);
      json[name] = array_json(field, array.data(), array.size, items);
    }
  }
  return json;
}

tl::expected<nlohmann::ordered_json, std::string> packed_json(std::span<const Field> fields,
                                                              std::span<const std::byte> packed, size_t items) {
  Json json;
  size_t at = 0;
  for (const Field& field : fields) {
    uint32_t count = field.count;
    if (field.is_array()) {
      if (packed.size() - at < sizeof count) return tl::make_unexpected(std::string(field.name) + " is cut off");
      std::memcpy(&count, packed.data() + at, sizeof count);
      at += sizeof count;
    }
    const size_t bytes = size_t{count} * field.element_bytes;
    if (packed.size() - at < bytes) return tl::make_unexpected(std::string(field.name) + " is cut off");
    const std::byte* data = packed.data() + at;
    json[std::string(field.name)] =
        field.is_array() ? array_json(field, data, count, items) : scalars(field.scalar, data, count);
    at += bytes;
  }
  if (at != packed.size()) return tl::make_unexpected(std::to_string(packed.size() - at) + " bytes too many");
  return json;
}

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

}  // namespace takt::attach
