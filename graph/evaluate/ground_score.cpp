// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/ground_score.hpp"

#include <fmt/format.h>

#include "graph/cli/set_option.hpp"
#include "rt/quantile.hpp"

namespace takt::command {

using namespace ground_map;
using Json = nlohmann::ordered_json;

GroundParameters ground_parameters(const std::vector<std::string>& set) {
  GroundParameters all;
  DetectorParameters& p = all.detector;
  for (const std::string& text : set) {
    const size_t equals = text.find('=');
    const std::string key = text.substr(0, equals), value = equals == std::string::npos ? "" : text.substr(equals + 1);
    if (key == "t_m") p.t_m = set_number(text, value, 0, 1e6);
    else if (key == "n_b") p.memory_entries = static_cast<int>(set_number(text, value, 1, 10000));
    else if (key == "t_w") p.t_w = set_number(text, value, 0, 5000);
    else if (key == "mean_size") p.mean_size = static_cast<int>(set_number(text, value, 1, 31));
    else if (key == "light_min") p.light_min = set_number(text, value, 0, 255);
    else if (key == "doubt") p.doubt.doubtful = static_cast<uint8_t>(kSure * set_number(text, value, 0, 1) + 0.5);
    else if (text == "votes=columns") all.grid.votes = Votes::columns;
    else if (text == "votes=pixels") all.grid.votes = Votes::pixels;
    else
      throw std::runtime_error(fmt::format(
          "--set {}: valid are t_m, n_b, t_w, mean_size, light_min and doubt with a number, votes=columns and "
          "votes=pixels",
          text));
  }
  if (p.mean_size % 2 == 0) throw std::runtime_error(fmt::format("--set mean_size={}: must be odd", p.mean_size));
  all.grid.beyond_px = p.mean_size / 2;
  return all;
}

Json ground_row(const MaskScore& score, const std::vector<double>* border_errors, std::optional<double> time_ms) {
  Json out{{"precision_pct", score.precision_pct()}, {"recall_pct", score.recall_pct()}};
  if (border_errors) {
    out["border_error_m"] = quantile(*border_errors, 0.5);
    out["border_error_p90_m"] = quantile(*border_errors, 0.9);
  }
  if (time_ms) out["time_ms"] = *time_ms;
  return out;
}

}  // namespace takt::command
