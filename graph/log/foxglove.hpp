// SPDX-License-Identifier: Apache-2.0
// Messages and events in Foxglove's well-known schemas, as JSON.
#pragma once
#include <string>
#include <vector>

#include "graph/log/recorded_plan.hpp"
#include "rt/msg/viewer.hpp"

namespace takt::log {

/// What a message shows of itself:
///
///   FoxgloveViewer viewer("front_laser", message.stamp_ns);
///   type.show(memory, viewer);
///   for (const auto& form : viewer.forms) write(form.schema, "front_laser.scan" + form.topic, form.json);
class FoxgloveViewer final : public Viewer {
 public:
  struct Form {
    std::string topic;  ///< behind the name of the port; the whole topic if it begins with a slash
    std::string schema;
    Json json;
  };
  /// `node`: whose message it is, the frame of what is told in that of its sensor.
  FoxgloveViewer(std::string node, int64_t stamp_ns) : node_(std::move(node)), stamp_ns_(stamp_ns) {}
  std::vector<Form> forms;

  void picture(const ImageView<const uint8_t>& image, std::string_view part) override;
  /// 16UC1: 65535 where the disparity is invalid.
  void disparity(const ImageView<const int16_t>& map, int disparities) override;
  void cloud(std::span<const Point> points, std::span<const Colour> colours) override;
  void scan(const Scan& scan) override;
  void grid(const Cells& grid) override;
  void pose(const Transform& pose, std::string_view frame) override;
  void text(std::string_view text) override;
  void mounted(const Transform& sensor_in_robot) override;

 private:
  Json begin(std::string_view frame) const;
  void raw_image(int width, int height, const char* encoding, int pixel_bytes, const void* pixels, std::string topic);
  std::string node_;
  int64_t stamp_ns_;
};

/// {"sec": 1, "nsec": 500000000}
Json time_json(int64_t ns);
/// foxglove.Log
Json log_json(int64_t at_ns, const std::string& name, const std::string& text);

}  // namespace takt::log
