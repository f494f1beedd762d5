// SPDX-License-Identifier: Apache-2.0
#include "graph/web/page_frames.hpp"

#include <algorithm>
#include <cstring>
#include <span>

#include "graph/world/specimen.hpp"
#include "rt/msg/viewer.hpp"
#include "rt/record/jpeg_compressor.hpp"

namespace takt::web {
namespace {

constexpr size_t kMostPoints = 30'000;  ///< of a cloud: more is not seen, and is 0.5 MB a frame

template <class T>
void append(std::string& bytes, const T* from, size_t count) {
  bytes.append(reinterpret_cast<const char*>(from), count * sizeof(T));
}

/// As a file; empty: it is no picture that JPEG can hold.
std::string jpeg_of(const ImageView<const uint8_t>& image) {
  thread_local record::JpegCompressor compressor(75);
  const auto file = compressor.compress(image);
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

/// Makes frames of one kind, or (kind "") only notes which kinds there are.
class PageViewer final : public Viewer {
 public:
  PageViewer(std::string kind, const Origin& origin) : kind_(std::move(kind)), origin_(origin) {}

  void picture(const ImageView<const uint8_t>& image, std::string_view part) override {
    if (!wants("picture")) return;
    if (std::string jpeg = jpeg_of(image); !jpeg.empty())
      add(part, {{"width", image.width}, {"height", image.height}}, jpeg);
  }
  void disparity(const ImageView<const int16_t>& map, int disparities) override {
    if (!wants("disparity")) return;
    std::vector<uint8_t> grey(static_cast<size_t>(map.width) * static_cast<size_t>(map.height));
    const int most = std::max(disparities - 1, 1);
    for (int y = 0; y < map.height; ++y)
      for (int x = 0; x < map.width; ++x) {
        const int value = std::clamp<int>(map.at(x, y), 0, most);  // none is 0, too: black
        grey[static_cast<size_t>(y) * static_cast<size_t>(map.width) + static_cast<size_t>(x)] =
            static_cast<uint8_t>(value * 255 / most);
      }
    if (std::string jpeg = jpeg_of({grey.data(), map.width, map.height}); !jpeg.empty())
      add("", {{"width", map.width}, {"height", map.height}}, jpeg);
  }
  void cloud(std::span<const Point> points, std::span<const Colour> colours) override {
    if (!wants("cloud")) return;
    const size_t step = points.size() / kMostPoints + 1;
    std::string bytes;
    size_t count = 0;
    for (size_t i = 0; i < points.size(); i += step, ++count) {
      append(bytes, &points[i], 1);
      const Colour colour = i < colours.size() ? colours[i] : Colour{200, 200, 200};
      const uint8_t rgba[4] = {colour.r, colour.g, colour.b, 255};
      append(bytes, rgba, 4);
    }
    add("", {{"count", count}, {"of", points.size()}}, bytes);
  }
  void scan(const Scan& scan) override {
    if (!wants("scan")) return;
    std::string bytes;
    append(bytes, scan.range_m.data(), scan.range_m.size());
    add("", {{"first_angle_rad", scan.first_angle_rad}, {"step_rad", scan.step_rad}}, bytes);
  }
  void grid(const Cells& grid) override {
    if (!wants("grid")) return;
    std::string bytes;
    for (int y = 0; y < grid.cells.height; ++y) append(bytes, grid.cells.row(y), static_cast<size_t>(grid.cells.width));
    add("",
        {{"width", grid.cells.width},
         {"height", grid.cells.height},
         {"cell_m", grid.cell_m},
         {"origin_x_m", grid.origin_x_m},
         {"origin_y_m", grid.origin_y_m}},
        bytes);
  }
  void pose(const Transform& pose, std::string_view frame) override {
    if (!wants("pose")) return;
    add("",
        {{"frame", frame},
         {"x", pose.x},
         {"y", pose.y},
         {"z", pose.z},
         {"qx", pose.qx},
         {"qy", pose.qy},
         {"qz", pose.qz},
         {"qw", pose.qw}},
        "");
  }

  std::vector<Hub::Part> parts;
  std::vector<std::string> kinds;

 private:
  bool wants(const char* kind) {
    if (kind_.empty() && std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) kinds.emplace_back(kind);
    return kind_ == kind;
  }
  void add(std::string_view part, const Json& more, const std::string& bytes) {
    Json head{{"port", origin_.port},
              {"part", part},
              {"kind", kind_},
              {"sequence", origin_.sequence},
              {"stamp_s", static_cast<double>(origin_.stamp_ns - origin_.epoch_ns) / 1e9},
              {"age_ms", origin_.age_ms},
              {"level", origin_.level}};
    head.update(more);
    const std::string text = head.dump();
    const auto size = static_cast<uint32_t>(text.size());
    std::string frame;
    frame.reserve(sizeof size + text.size() + bytes.size());
    append(frame, &size, 1);
    frame += text;
    frame += bytes;
    parts.push_back({origin_.stamp_ns, frame_of(std::move(frame))});
  }

  const std::string kind_;
  const Origin& origin_;
};

}  // namespace

std::vector<std::string> kinds_of(const MessageType& type, const Capacity& capacity) {
  if (type.show == nullptr) return {};
  const Origin nowhere;
  PageViewer viewer("", nowhere);
  type.show(world::specimen(type, capacity).get(), viewer);
  return viewer.kinds;
}

std::vector<Hub::Part> page_frames(const MessageType& type, const void* message, const std::string& kind,
                                   const Origin& origin) {
  if (type.show == nullptr) return {};
  PageViewer viewer(kind, origin);
  type.show(message, viewer);
  return std::move(viewer.parts);
}

}  // namespace takt::web
