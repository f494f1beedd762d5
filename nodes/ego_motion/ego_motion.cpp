// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/ego_motion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "nodes/ego_motion/block_kernel.hpp"

namespace takt::ego_motion {
namespace {

constexpr int kLevels = 4;
constexpr int kCoarseHalf = 3;  // block at the coarsest level, where most positions are tested

int round_int(double v) { return static_cast<int>(std::lround(v)); }

}  // namespace

Parameters Parameters::faithful() {
  Parameters p;
  p.corners = {1500, 0.01, 5, 8, 1 << 14};
  p.predict = Predict::none;
  p.subpixel = Subpixel::none;
  p.brightness = false;
  p.flow_filter = true;
  p.estimator.model = Model::planar;
  p.estimator.robust = false;
  p.estimator.inlier_px = 2;
  return p;
}

std::string Parameters::error() const {
  const auto wrong = [](const char* name, double value, const char* rule) {
    return std::string(name) + " is " + std::to_string(value) + ", must " + rule;
  };
  if (n_search < 3 || n_search > 15 || n_search % 2 == 0) return wrong("n_search", n_search, "be odd and lie in 3..15");
  if (corners.maximum < 12 || corners.maximum > 20000) return wrong("corners", corners.maximum, "lie in 12..20000");
  if (!(corners.quality >= 0 && corners.quality < 1)) return wrong("quality", corners.quality, "lie in 0..1");
  if (corners.distance_px < 1) return wrong("distance", corners.distance_px, "be at least 1 px");
  if (corners.tile_px < 8) return wrong("tile", corners.tile_px, "be at least 8 px");
  if (!(sigma >= 0 && sigma <= 10)) return wrong("sigma", sigma, "lie in 0..10");
  if (!(r_const >= 0 && r_const <= 500)) return wrong("r_const", r_const, "lie in 0..500 px");
  if (pyramid_range_px < 8 || pyramid_range_px > 512)
    return wrong("pyramid_range", pyramid_range_px, "lie in 8..512 px");
  if (!(flow.r_min_px > 0)) return wrong("r_min", flow.r_min_px, "be above 0 px");
  if (!(estimator.inlier_px > 0)) return wrong("inlier", estimator.inlier_px, "be above 0 px");
  if (!(estimator.shared_px >= 0)) return wrong("shared_error", estimator.shared_px, "be at least 0 px");
  for (const auto& [name, value] : {std::pair{"acceleration", expectation.acceleration_m_s2},
                                    {"turn_acceleration", expectation.turn_acceleration_rad_s2},
                                    {"odometry_error", expectation.odometry_error}})
    if (!(value > 0)) return wrong(name, value, "be above 0");
  return {};
}

void EgoMotion::take(const Parameters& parameters) {
  if (const std::string error = parameters.error(); !error.empty()) throw std::invalid_argument("ego_motion: " + error);
  p_ = parameters;
  half_ = p_.n_search / 2;
  p_.corners.margin_px = std::max(p_.corners.margin_px, half_ + 3);
}

void EgoMotion::tune(const Parameters& parameters) {
  if (static_cast<size_t>(std::max(0, parameters.corners.maximum)) > tracked_.capacity())
    throw std::invalid_argument("ego_motion: memory was taken for " + std::to_string(tracked_.capacity()) + " corners");
  const bool before = p_.brightness;
  take(parameters);
  detector_.tune(p_.corners);
  flow_filter_.tune(p_.flow);
  estimator_.tune(p_.estimator);
  expectation_.tune(p_.expectation);
  // A block may be larger now than where these were found.
  const int margin = p_.corners.margin_px;
  std::erase_if(tracked_, [&](const TrackedCorner& t) {
    return t.corner.x < margin || t.corner.y < margin || t.corner.x >= width_ - margin ||
           t.corner.y >= height_ - margin;
  });
  if (p_.brightness == before || !has_previous_) return;
  current_.build(previous_.image().view(), p_.brightness);
  previous_.swap(current_);
}

void EgoMotion::configure(int width, int height, const Parameters& parameters) {
  take(parameters);
  if (width < 128 || height < 128 || width > 16384 || height > 16384)
    throw std::invalid_argument("ego_motion: image of " + std::to_string(width) + " x " + std::to_string(height) +
                                " px, each side must lie in 128..16384");
  width_ = width;
  height_ = height;
  const auto capacity = static_cast<size_t>(p_.corners.maximum);
  previous_ = Pyramid(width, height, kLevels);
  current_ = Pyramid(width, height, kLevels);
  right_ = Level(width, height);
  detector_ = CornerDetector(width, height, p_.corners);
  flow_filter_ = FlowFilter(width, height, capacity, p_.flow);
  estimator_ = MotionEstimator(p_.estimator, capacity);
  tracked_.reserve(capacity);
  found_.reserve(capacity);
  observations_.reserve(capacity);
  flows_.reserve(capacity);
  keep_.resize(capacity);
  candidates_.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  reset();
}

void EgoMotion::resume(const UncertainPose& pose, int64_t stamp_ns) {
  reset();
  pose_ = pose;
  stamp_ns_ = stamp_ns;
  has_previous_ = resumed_ = true;
}

void EgoMotion::reset() {
  has_previous_ = resumed_ = false;
  steps_ = 0;
  pose_ = {};
  expectation_ = Expectation(p_.expectation);
  tracked_.clear();
  observations_.clear();
  flows_.clear();
}

void EgoMotion::remember(StateArchive& archive) {
  TAKT_STATE(archive, tracked_, expectation_, has_previous_, resumed_, stamp_ns_, steps_, pose_);
  archive(previous_.image());
  if (!archive.loads() || archive.failed()) return;
  if (tracked_.size() > keep_.size()) return archive.fail();
  current_.build(previous_.image().view(), p_.brightness);
  previous_.swap(current_);
}

// Disparity at (x, y) of the current left image, searched between whole disparities first..last; negative: not found.
double EgoMotion::measure_disparity(double x, double y, int first, int last) const {
  const Level& left = current_.level(0);
  const int xi = round_int(x), yi = round_int(y);
  if (xi < half_ || yi < half_ || xi >= width_ - half_ || yi >= height_ - half_) return -1;
  first = std::max(0, first);
  last = std::min(last, xi - half_);
  if (first > last) return -1;
  Patch patch;
  patch.take(left, xi, yi, half_);
  const BlockMatch m = search_blocks(patch, right_, {xi - last, xi - first, yi, yi});
  const int best = xi - m.x;
  if (p_.subpixel == Subpixel::none) return best;
  if (p_.subpixel == Subpixel::parabola) {
    if (best == 0 || m.x - 1 < half_ || m.x + 1 >= width_ - half_) return best;
    // d grows to the left, so the cost of d + 1 lies one pixel to the left.
    return best + parabola_offset(sad(patch, right_, m.x + 1, yi), m.cost, sad(patch, right_, m.x - 1, yi));
  }
  RefinePatch fine;
  if (!fine.take(left.image, x, y, half_)) return -1;
  const SubPixel at = fine.refine_in_row(right_.image, x - best, y, 1.5);
  return at.converged ? std::max(0.0, x - at.x) : -1;
}

double EgoMotion::current_disparity(const Frame& frame, double x, double y, double previous) const {
  const int xi = round_int(x), yi = round_int(y);
  if (!frame.disparity.contains(xi, yi)) return -1;
  const int known = frame.disparity.at(xi, yi);
  if (p_.subpixel == Subpixel::none) return known;
  if (known >= 0) return measure_disparity(x, y, known - 2, known + 2);
  const int around = round_int(previous), reach = 3 + around / 5;
  return measure_disparity(x, y, around - reach, around + reach);
}

void EgoMotion::find_corners(const Frame& frame) {
  found_.clear();
  for (const Corner& c : detector_.detect(current_.level(0).image, frame.disparity)) {
    const int known = frame.disparity.at(c.x, c.y);
    const double d = p_.subpixel == Subpixel::none ? known : measure_disparity(c.x, c.y, known - 2, known + 2);
    if (d > 0.25) found_.push_back({c, static_cast<float>(d)});
  }
}

void EgoMotion::mark_candidates() {
  std::fill(candidates_.begin(), candidates_.end(), uint8_t{0});
  for (const TrackedCorner& t : found_)
    for (int v = t.corner.y - 1; v <= t.corner.y + 1; ++v)
      for (int u = t.corner.x - 1; u <= t.corner.x + 1; ++u)
        candidates_[static_cast<size_t>(v) * static_cast<size_t>(width_) + static_cast<size_t>(u)] = 1;
}

// The thesis's search: a window that grows with the disparity (near points move further).
BlockMatch EgoMotion::search_window(const Patch& patch, const TrackedCorner& from, int centre_x, int centre_y) const {
  const int n = static_cast<int>(p_.sigma * static_cast<double>(from.disparity) + p_.r_const);
  const int radius = p_.search_is_radius ? n : n / 2;
  if (p_.corner_candidates) {
    const BlockMatch m =
        block_search_among(patch, current_.level(0), centre_x, centre_y, radius, radius, candidates_.data());
    if (m.found()) return m;
  }
  return block_search(patch, current_.level(0), centre_x, centre_y, radius, radius);
}

// Coarse to fine; level l has pixels 2^l wide. The guess (from the expected motion) competes at level 1.
BlockMatch EgoMotion::search_pyramid(const TrackedCorner& from, int guess_x, int guess_y) const {
  const int top = current_.levels() - 1;
  const double range = p_.pyramid_range_px + p_.pyramid_share * static_cast<double>(from.disparity);
  int dx = 0, dy = 0;
  BlockMatch best;
  for (int l = top; l >= 0; --l) {
    const Level& before = previous_.level(l);
    const Level& now = current_.level(l);
    const int half = l == top ? std::min(half_, kCoarseHalf) : half_;
    const int x = std::clamp(from.corner.x >> l, half, before.image.width() - 1 - half);
    const int y = std::clamp(from.corner.y >> l, half, before.image.height() - 1 - half);
    Patch patch;
    patch.take(before, x, y, half);
    const int radius = l == top ? static_cast<int>(range) >> l : l == 0 ? 1 : 2;
    best = block_search(patch, now, x + dx, y + dy, radius, radius);
    if (l == 1) {
      const BlockMatch other = block_search(patch, now, x + (guess_x >> 1), y + (guess_y >> 1), 2, 2);
      if (other.cost < best.cost) best = other;
    }
    if (!best.found()) return best;
    dx = (best.x - x) * 2;
    dy = (best.y - y) * 2;
  }
  return best;
}

EgoMotion::Located EgoMotion::sharpen(const Patch& patch, const TrackedCorner& from, const BlockMatch& m) const {
  const Level& now = current_.level(0);
  Located at{static_cast<double>(m.x), static_cast<double>(m.y), true};
  if (p_.subpixel == Subpixel::parabola) {
    if (m.x - 1 < half_ || m.y - 1 < half_ || m.x + 1 >= width_ - half_ || m.y + 1 >= height_ - half_) return at;
    at.x += parabola_offset(sad(patch, now, m.x - 1, m.y), m.cost, sad(patch, now, m.x + 1, m.y));
    at.y += parabola_offset(sad(patch, now, m.x, m.y - 1), m.cost, sad(patch, now, m.x, m.y + 1));
  } else if (p_.subpixel == Subpixel::lucas_kanade) {
    RefinePatch fine;
    if (!fine.take(previous_.level(0).image, from.corner.x, from.corner.y, half_)) return {};
    const SubPixel s = fine.refine(now.image, at.x, at.y, 1.5);
    at = {s.x, s.y, s.converged};
  }
  return at;
}

EgoMotion::Located EgoMotion::locate(const TrackedCorner& from, const CameraModel& camera,
                                     const std::optional<Rigid>& centre) const {
  int guess_x = 0, guess_y = 0;
  if (centre) {
    const double s = camera.baseline_m / static_cast<double>(from.disparity);
    const Eigen::Vector3d p = *centre * Eigen::Vector3d((from.corner.x - camera.cu_px) * s,
                                                        (from.corner.y - camera.cv_px) * s, camera.focal_px * s);
    if (p.z() < 0.1) return {};  // will be behind the camera
    const double limit = width_;
    guess_x = round_int(std::clamp(camera.focal_px * p.x() / p.z() + camera.cu_px - from.corner.x, -limit, limit));
    guess_y = round_int(std::clamp(camera.focal_px * p.y() / p.z() + camera.cv_px - from.corner.y, -limit, limit));
  }
  Patch patch;
  patch.take(previous_.level(0), from.corner.x, from.corner.y, half_);
  const BlockMatch m = p_.predict == Predict::pyramid
                           ? search_pyramid(from, guess_x, guess_y)
                           : search_window(patch, from, from.corner.x + guess_x, from.corner.y + guess_y);
  if (!m.found()) return {};
  return sharpen(patch, from, m);
}

void EgoMotion::match_all(const Frame& frame, const std::optional<Rigid>& centre) {
  observations_.clear();
  flows_.clear();
  const CameraModel& c = frame.camera;
  for (const TrackedCorner& from : tracked_) {
    const Located at = locate(from, c, centre);
    if (!at.found) continue;
    const double d = current_disparity(frame, at.x, at.y, static_cast<double>(from.disparity));
    observations_.push_back({from.corner.x - c.cu_px, from.corner.y - c.cv_px, static_cast<double>(from.disparity),
                             at.x - c.cu_px, at.y - c.cv_px, d > 0 ? d : -1});
    flows_.push_back({static_cast<float>(from.corner.x), static_cast<float>(from.corner.y),
                      static_cast<float>(at.x - from.corner.x), static_cast<float>(at.y - from.corner.y)});
  }
}

void EgoMotion::filter_flow() {
  flow_filter_.apply(flows_, std::span(keep_).first(flows_.size()));
  size_t kept = 0;
  for (size_t i = 0; i < flows_.size(); ++i)
    if (keep_[i]) observations_[kept++] = observations_[i];
  observations_.resize(kept);
}

bool EgoMotion::measure(const Frame& frame, const Rigid& expected, Result& result) {
  const int64_t interval = frame.stamp_ns - stamp_ns_;
  std::optional<Rigid> centre;  // maps previous coordinates into current ones
  if (p_.predict == Predict::constant_velocity) centre = expectation_.continued(interval);
  else if (p_.predict != Predict::none && (frame.odometry || expectation_.continued(interval))) centre = expected;
  if (centre) centre = centre->inverse();
  match_all(frame, centre);
  if (p_.flow_filter) filter_flow();
  const Optics optics{frame.camera.focal_px, frame.camera.baseline_m};
  const Estimate e = estimator_.estimate(observations_, optics, expected.inverse(), steps_);
  result.matched = static_cast<int>(observations_.size());
  if (!e.solved) return false;
  result.estimate = e.T.inverse();
  result.inliers = e.inliers;
  result.rms_px = e.rms_px;
  result.confidence = e.inliers * std::exp(-e.rms_px) / result.matched;
  if (result.confidence < p_.confidence_minimum || e.inliers < p_.inliers_minimum) return false;
  result.camera_in_previous = camera_in_previous(e);
  return true;
}

Result EgoMotion::step(const Frame& frame) {
  Result result;
  current_.build(frame.left, p_.brightness);
  to_grey(frame.right, right_.image);
  if (p_.brightness) right_.fill_mean();
  find_corners(frame);
  if (p_.corner_candidates) mark_candidates();
  result.corners = static_cast<int>(found_.size());
  if (!has_previous_) {
    result.keyframe = result.valid = true;
    result.confidence = 1;
  } else {
    // Motion is per actual stamp difference.
    const int64_t interval = frame.stamp_ns - stamp_ns_;
    const UncertainPose expected = expectation_.motion(interval, frame.odometry);
    // In an image without texture every block looks the same everywhere.
    const bool sees = result.corners >= p_.inliers_minimum;
    result.valid = sees && !resumed_ && measure(frame, from_transform(expected.transform), result);
    if (result.valid) {
      expectation_.measured(*result.estimate, interval);
    } else {
      result.camera_in_previous = expected;
      expectation_.unmeasured(interval, frame.odometry);
    }
    pose_ = compose(pose_, result.camera_in_previous);
  }
  result.pose = pose_;
  previous_.swap(current_);
  tracked_.swap(found_);
  stamp_ns_ = frame.stamp_ns;
  has_previous_ = true;
  resumed_ = false;
  ++steps_;
  return result;
}

}  // namespace takt::ego_motion
