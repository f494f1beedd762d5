// SPDX-License-Identifier: Apache-2.0
// What the parts of `takt eval ground` share.
#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/ground_map/evaluate.hpp"
#include "nodes/ground_map/ground_detector.hpp"

namespace takt::command {

struct GroundParameters {
  ground_map::DetectorParameters detector;
  ground_map::GridParameters grid;
};

/// "param=value" by the names of the node's parameters; throws std::runtime_error with the valid ones.
GroundParameters ground_parameters(const std::vector<std::string>& set);

/// precision_pct, recall_pct, and where given border_error_m, border_error_p90_m, time_ms.
nlohmann::ordered_json ground_row(const ground_map::MaskScore& score, const std::vector<double>* border_errors,
                                  std::optional<double> time_ms);

inline ImageView<const uint8_t> view(const cv::Mat& m) {
  return {m.data, m.cols, m.rows, m.channels(), static_cast<ptrdiff_t>(m.step)};
}
inline ImageView<uint8_t> writable(cv::Mat& m) {
  return {m.data, m.cols, m.rows, m.channels(), static_cast<ptrdiff_t>(m.step)};
}

/// The generated pavement, with `variants` in other light and of other stone too, and distances on the floor.
nlohmann::ordered_json measure_pavement(const EvalGroundOptions& options);

}  // namespace takt::command
