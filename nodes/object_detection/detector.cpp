// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/detector.hpp"

#include <algorithm>
#include <stdexcept>

#include "nodes/object_detection/layout_learning.hpp"

namespace takt::object_detection {
namespace {

/// Does one of the rectangles cover at least half of the other?
bool overlap(const Detection& a, const Detection& b) {
  const float width = std::min(a.x_px + a.width_px, b.x_px + b.width_px) - std::max(a.x_px, b.x_px);
  const float height = std::min(a.y_px + a.height_px, b.y_px + b.height_px) - std::max(a.y_px, b.y_px);
  const float smaller = std::min(a.width_px * a.height_px, b.width_px * b.height_px);
  return width > 0 && height > 0 && 2 * width * height >= smaller;
}

}  // namespace

Detector::Detector(int image_width, int image_height, std::span<const DatabaseObject> database,
                   const DetectorParameters& p, std::span<const Photograph> backgrounds)
    : width_(image_width), height_(image_height), last_(p.last), references_(cascade_references(database, p)) {
  std::vector<LayoutObject> layout;
  if (last_ >= Stage::layout) layout = learn_layout(database, backgrounds, p.threshold_scale);
  scales_.reserve(p.scales.size());
  for (const double scale : p.scales) {
    const auto at = static_cast<uint32_t>(scales_.size());
    const SearchGrid& grid =
        scales_.emplace_back(image_width, image_height, scale, database[0].views[0].side_px, references_, layout, p)
            .grid();
    for (int row = 0; row < grid.rows; ++row) rows_.push_back({at, static_cast<uint32_t>(row)});
    undecided_.emplace_back(static_cast<size_t>(grid.windows()));
    windows_ += undecided_.back().size();
  }
  if (last_ >= Stage::cooccurrence) candidates_.reserve(windows_ * database.size());
  for (size_t entry = 0; entry < database.size(); ++entry) class_ids_.push_back(static_cast<float>(entry));
  for (const DatabaseObject& object : database)
    first_of_name_.push_back(static_cast<size_t>(
        std::find_if(database.begin(), database.end(), [&](const auto& other) { return other.name == object.name; }) -
        database.begin()));
  at_scale_.resize(kMostDetections);
  found_.reserve(scales_.size() * kMostDetections);
}

bool Detector::begin(ImageView<const uint8_t> bgr, const MaskSums* mask) {
  if (bgr.width != width_ || bgr.height != height_ || bgr.channels != 3) return false;
  image_ = bgr;
  mask_ = mask;
  searched_rows_ = searched_windows_ = 0;
  for (ScaleSearch& scale : scales_) {
    scale.clear();
    if (!met_card_) scale.meet_card(bgr);
  }
  met_card_ = true;
  return true;
}

void Detector::search_row() {
  const auto [index, row] = rows_[(first_row_ + searched_rows_++) % rows_.size()];
  ScaleSearch& scale = scales_[index];
  if (!scale.begun()) scale.begin(image_, mask_, static_cast<int>(row));
  scale.search_row();
  searched_windows_ += static_cast<size_t>(scale.grid().columns);
}

void Detector::gather_candidates() {
  candidates_.clear();
  if (last_ < Stage::cooccurrence) return;
  for (size_t s = 0; s < scales_.size(); ++s) {
    const Decision& decision = scales_[s].decision();
    for (size_t object = 0; object < decision.objects(); ++object) {
      const std::span<const float> errors = decision.errors(object);
      for (size_t window = 0; window < errors.size(); ++window)
        if (errors[window] < kFailed)
          candidates_.push_back(
              {errors[window], static_cast<uint32_t>(s), static_cast<uint32_t>(window), static_cast<uint32_t>(object)});
    }
  }
  std::make_heap(candidates_.begin(), candidates_.end(), Candidate::worse);
}

/// All of them, though there may not be time for all: a card takes not much longer for more.
void Detector::announce_candidates() {
  for (uint32_t s = 0; s < scales_.size(); ++s) {
    if (scales_[s].cooccurrence() == nullptr || !scales_[s].cooccurrence()->uses_card()) continue;
    at_one_scale_.clear();
    for (const Candidate& candidate : candidates_)
      if (candidate.scale == s) at_one_scale_.push_back({candidate.window, candidate.object});
    if (!at_one_scale_.empty()) scales_[s].will_decide(at_one_scale_);
  }
}

void Detector::use(const cuda::CardUse& card) {
  at_one_scale_.reserve(candidates_.capacity());
  for (ScaleSearch& scale : scales_) {
    if (scale.cooccurrence() == nullptr)
      throw std::invalid_argument(
          "object_detection: a card has the stage of co-occurrences, which `stages` leaves out");
    scale.cooccurrence()->use(card);
  }
}

void Detector::leave_card(const std::string& why) {
  refused_ = why;
  for (ScaleSearch& scale : scales_)
    if (scale.cooccurrence() != nullptr) scale.cooccurrence()->leave_card();
}

bool Detector::card_is_quicker(const Clock& clock) { return scales_[0].cooccurrence()->card_is_quicker(clock); }

std::string_view Detector::trouble() {
  for (ScaleSearch& scale : scales_)
    if (scale.cooccurrence() != nullptr && !scale.cooccurrence()->trouble().empty())
      return scale.cooccurrence()->trouble();
  return refused_;
}

void Detector::decide_best_candidate() {
  std::pop_heap(candidates_.begin(), candidates_.end(), Candidate::worse);
  const Candidate best = candidates_.back();
  candidates_.pop_back();
  scales_[best.scale].decide(best.object, best.window);
}

void Detector::end() {
  first_row_ = searched_rows_ == rows_.size() ? 0 : (first_row_ + searched_rows_) % rows_.size();
  for (auto& undecided : undecided_) std::fill(undecided.begin(), undecided.end(), uint8_t{0});
  for (const Candidate& left : candidates_) {
    scales_[left.scale].decision().set(left.object, left.window, kFailed);
    undecided_[left.scale][left.window] = 1;
  }
}

float Detector::searched() const {
  size_t decided = searched_windows_;
  for (const auto& undecided : undecided_)
    decided -= static_cast<size_t>(std::count(undecided.begin(), undecided.end(), 1));
  return static_cast<float>(decided) / static_cast<float>(windows_);
}

size_t Detector::detections(double min_score, std::span<Detection> out) {
  found_.clear();
  for (size_t s = 0; s < scales_.size(); ++s) {
    const size_t count = scales_[s].decision().detections(min_score, at_scale_);
    for (size_t i = 0; i < count; ++i) {
      scales_[s].to_image(at_scale_[i]);
      found_.push_back({at_scale_[i], s});
    }
  }
  std::sort(found_.begin(), found_.end(), [](const Found& a, const Found& b) {
    if (better(a.detection, b.detection)) return true;
    return !better(b.detection, a.detection) && a.scale < b.scale;
  });
  size_t kept = 0;
  for (const Found& next : found_) {
    if (kept == out.size()) break;
    const auto same = [&](const Found& other) {
      const auto a = static_cast<size_t>(other.detection.class_id), b = static_cast<size_t>(next.detection.class_id);
      const bool rivals = last_ >= Stage::layout || first_of_name_[a] == first_of_name_[b];
      return rivals && (a != b || other.scale != next.scale) && overlap(other.detection, next.detection);
    };
    if (std::any_of(found_.begin(), found_.begin() + static_cast<ptrdiff_t>(kept), same)) continue;
    out[kept] = next.detection;
    out[kept].class_id = class_ids_[static_cast<size_t>(next.detection.class_id)];
    found_[kept++] = next;
  }
  return kept;
}

void Detector::region_of_interest(ImageView<uint8_t> roi) const {
  const SearchGrid& grid = this->grid();
  scales_[0].decision().region_of_interest(roi);
  for (size_t s = 1; s < scales_.size(); ++s) {
    const SearchGrid& other = scales_[s].grid();
    for (int window = 0; window < other.windows(); ++window) {
      if (!scales_[s].decision().passes(static_cast<size_t>(window))) continue;
      const int x = other.x0(window % other.columns), y = other.y0(window / other.columns);
      const auto covers = [&](int from, int middle, int size, int other_size) {
        return middle * other_size >= from * size && middle * other_size < (from + other.window_px) * size;
      };
      for (int v = 0; v < grid.rows; ++v) {
        if (!covers(y, grid.y0(v) + grid.window_px / 2, grid.image_height, other.image_height)) continue;
        for (int u = 0; u < grid.columns; ++u)
          if (covers(x, grid.x0(u) + grid.window_px / 2, grid.image_width, other.image_width)) roi.at(u, v) = 255;
      }
    }
  }
}

}  // namespace takt::object_detection
