// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/cloud_filter.hpp"

#include <stdexcept>
#include <string>

namespace takt::cloud {

std::string_view to_string(Step step) {
  switch (step) {
    case Step::outliers: return "outliers";
    case Step::interpolate: return "interpolate";
    case Step::smooth: return "smooth";
    case Step::reduce: break;
  }
  return "reduce";
}

CloudFilter::CloudFilter(size_t capacity, const FilterSteps& steps) : steps_(steps) {
  if (wants(Step::outliers)) {
    outliers_.emplace(capacity);
    keep_.resize(capacity);
  }
  if (wants(Step::interpolate) || wants(Step::smooth) || wants(Step::reduce)) grid_.emplace(capacity);
}

void CloudFilter::tune(const FilterSteps& steps) {
  for (const Step step : {Step::outliers, Step::interpolate, Step::smooth, Step::reduce})
    if (wants(steps, step) && (step == Step::outliers ? !outliers_ : !grid_))
      throw std::invalid_argument("no memory was taken for the step " + std::string(to_string(step)) +
                                  ": it was off at the start; start with it");
  steps_ = steps;
}

bool CloudFilter::wants(const FilterSteps& steps, Step step) {
  switch (step) {
    case Step::outliers: return steps.outliers.radius_m > 0;
    case Step::interpolate: return steps.interpolate.edge_m > 0;
    case Step::smooth: return steps.smooth.edge_m > 0;
    case Step::reduce: break;
  }
  return steps.reduce_edge_m > 0;
}

size_t CloudFilter::run(Step step, CloudBuffer& cloud) {
  if (step == Step::outliers) {
    OutlierParameters p = steps_.outliers;
    if (steps_.n_min_points > 0) p.n_min = scaled_n_min(p.n_min, cloud.size(), steps_.n_min_points);
    const std::span<uint8_t> keep = std::span(keep_).first(cloud.size());
    outliers_->filter(cloud.points(), p, keep);
    cloud.shorten(compact(cloud.points(), cloud.colours(), keep));
    return outliers_->unusable();
  }
  // The grid holds all of the cloud from here on, so its memory can take the result.
  grid_->fill(cloud.view(), step == Step::interpolate ? steps_.interpolate.edge_m
                            : step == Step::smooth    ? steps_.smooth.edge_m
                                                      : steps_.reduce_edge_m);
  cloud.clear();
  if (step == Step::interpolate) interpolate(*grid_, steps_.interpolate, cloud);
  else if (step == Step::smooth) smooth(*grid_, steps_.smooth.t_occ, cloud);
  else reduce(*grid_, cloud);
  return grid_->unusable();
}

}  // namespace takt::cloud
