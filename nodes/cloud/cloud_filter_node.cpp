// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <optional>
#include <string>

#include "nodes/cloud/cloud_filter.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace cloud;

/// Appends to the text of a message; what does not fit is cut off.
class Line {
 public:
  explicit Line(Array<char>& text) : text_(text) {}
  Line& add(std::string_view words) {
    for (const char c : words) text_.push_back(c);
    return *this;
  }
  Line& add(size_t number) {
    char digits[20];
    return add({digits, static_cast<size_t>(std::to_chars(digits, digits + sizeof digits, number).ptr - digits)});
  }

 private:
  Array<char>& text_;
};

class CloudFilterNode final : public Node {
 public:
  void setup(Setup&) override {
    const uint32_t capacity = std::max(in_.capacity().count, static_cast<uint32_t>(capacity_()));
    try {
      filter_.emplace(capacity, steps());
    } catch (const std::invalid_argument& problem) {
      throw SetupError(std::string(problem.what()) + ", these clouds may have " + std::to_string(capacity));
    }
    out_.reserve({0, 0, 1, capacity});
    status_.reserve({0, 0, 1, kStatusCharacters});
  }

  void changed() override { filter_->tune(steps()); }

  void run(Job& job) override {
    if (!in_.is_new()) return job.no_result();
    const PointCloud& in = *in_.newest();
    PointCloud* out = out_.loan();
    TextStatus* status = status_.connected() ? status_.loan() : nullptr;
    if (!out || (status_.connected() && !status)) job.no_result();
    if (!out) return;
    out->sensor_in_robot = in.sensor_in_robot;
    out->camera = in.camera;
    out->step_px = in.step_px;
    const bool coloured = in.colours.size == in.points.size;
    out->points.resize(out->points.capacity);
    out->colours.resize(coloured ? out->colours.capacity : 0);
    CloudBuffer cloud(out->points.items(), out->colours.items());
    for (uint32_t i = 0; i < in.points.size; ++i) cloud.push(in.points[i], coloured ? in.colours[i] : Colour{});
    if (status) Line(status->text).add(in.points.size).add(" in");
    size_t unusable = 0;
    filter_->run(cloud, [&](const StepResult& result) {
      unusable += result.unusable;
      if (status) Line(status->text).add(", ").add(to_string(result.step)).add(" ").add(result.points);
    });
    out->points.resize(cloud.size());
    out->colours.resize(coloured ? cloud.size() : 0);
    out_.send(in_.stamp_ns());
    if (!status) return;
    Line(status->text).add(", ").add(unusable).add(" unusable, ").add(cloud.lost()).add(" lost");
    status_.send(in_.stamp_ns());
  }

  void remember(StateArchive&) override {}

 private:
  FilterSteps steps() const {
    for (const Param<double>* length : {&outlier_radius_, &interpolate_, &smooth_, &reduce_})
      if (*length > 0 && *length < kShortest_m)
        throw SetupError(std::string(length->name()) + " is " + length->value_text() +
                         " m, must be 0 (none) or at least 0.001 m");
    FilterSteps steps;
    steps.outliers = {outlier_radius_, outlier_n_min_};
    steps.n_min_points = kPointsOfNMin;
    steps.interpolate = {interpolate_, n_adj_, k_, reach_};
    steps.smooth = {smooth_, t_occ_};
    steps.reduce_edge_m = reduce_;
    return steps;
  }

  static constexpr size_t kPointsOfNMin = 1'200'000;
  static constexpr double kShortest_m = 1e-3;
  static constexpr uint32_t kStatusCharacters = 160;

  Input<PointCloud> in_{this, "cloud", "points in any frame; the newest one is filtered, once"};
  Output<PointCloud> out_{this, "cloud", "what the steps leave of it; camera, step and mount as they came"};
  Output<TextStatus> status_{this, "status",
                             "one line: points in, after each step, unusable (not finite, too far) and lost (no room)"};
  Param<double> outlier_radius_{this, "outlier_radius", 0.0, {0.0, 2.0}, "m", "outlier removal; 0: none"};
  Param<int> outlier_n_min_{this, "outlier_n_min",
                            100,  {1, 100000},
                            "",   "others within the radius that a point needs, for a cloud of 1.2 million points"};
  Param<double> interpolate_{this,       "interpolate", 0.0,
                             {0.0, 1.0}, "m",           "edge of the voxels whose gaps are filled; 0: none"};
  Param<int> n_adj_{this, "n_adj", 4, {1, 26}, "", "occupied voxels around an empty one that make it a gap"};
  Param<int> k_{this, "k", 4, {1, kMostNearest}, "", "nearest points that a gap is filled from"};
  Param<double> reach_{
      this, "reach", 2.0, {0.5, kFarthestReach}, "1", "of these the farthest may lie so many edges away"};
  Param<double> smooth_{this, "smooth", 0.0, {0.0, 1.0}, "m", "edge of the voxels that are convolved; 0: no smoothing"};
  Param<double> t_occ_{this,       "t_occ", 0.25,
                       {0.0, 1.0}, "1",     "convolved number of points that a voxel needs to give one"};
  Param<double> reduce_{this, "reduce", 0.0, {0.0, 1.0}, "m", "edge of the voxels that become one point each; 0: none"};
  Param<int> capacity_{this,         "capacity", 0,
                       {0, 1 << 24}, "",         "points that the result may have; 0: as the clouds that come in",
                       kSizesMemory};

  std::optional<CloudFilter> filter_;
};

}  // namespace

void register_cloud_filter(NodeTypes& types) {
  types.add<CloudFilterNode>("cloud_filter", Layer::perception,
                             "Outlier removal, interpolation, smoothing and reduction of a point cloud");
}

}  // namespace takt
