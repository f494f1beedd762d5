// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/band_matcher.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include "nodes/stereo/post_process.hpp"

namespace takt::stereo {
namespace {

/// Rows above and below that a pixel's disparity depends on: windows, median and the neighbourhood of the cost.
int reach(const MatcherParameters& p) {
  return p.n_square / 2 + p.n_min / 2 + (p.median ? 1 : 0) + (p.cost == CostKind::census ? kCensusRadius : 1);
}

template <class T>
ImageView<const T> rows_of(ImageView<const T> image, int top, int height) {
  return {image.row(top), image.width, height, image.channels, image.stride};
}

template <class T>
void copy_rows(const std::vector<T>& from, int skip, int width, ImageView<T> to, int first, int last) {
  for (int y = first; y < last; ++y)
    std::memcpy(to.row(y), from.data() + static_cast<size_t>(skip + y - first) * static_cast<size_t>(width),
                static_cast<size_t>(width) * sizeof(T));
}

}  // namespace

BandMatcher::BandMatcher(int width, int height, int channels, const MatcherParameters& parameters, int bands)
    : width_(width), height_(height), channels_(channels) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  const int most = std::clamp(height / 16, 1, 8);
  if (bands < 1 || bands > most)
    throw std::invalid_argument("stereo: " + std::to_string(bands) + " bands, must lie in 1.." + std::to_string(most) +
                                " for " + std::to_string(height) + " rows");
  if (parameters.selection == Selection::semi_global)
    throw std::invalid_argument("stereo: semi_global looks along the whole image and has no bands");
  for (int i = 0; i < bands; ++i) {
    Band band;
    band.first = height * i / bands;
    band.last = height * (i + 1) / bands;
    band.top = std::max(0, band.first - reach(parameters));
    band.height = std::min(height, band.last + reach(parameters)) - band.top;
    band.matcher = make_matcher(width, band.height, channels, parameters);
    const auto count = static_cast<size_t>(width) * static_cast<size_t>(band.height);
    band.disparity.resize(count);
    band.confidence.resize(count);
    band.fraction.resize(count);
    bands_.push_back(std::move(band));
  }
  for (size_t i = 1; i < bands_.size(); ++i)
    threads_.emplace_back([this, &band = bands_[i]](const std::stop_token& stop) { serve(band, stop); });
}

BandMatcher::~BandMatcher() {
  for (std::jthread& thread : threads_) thread.request_stop();
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_all();
}

void BandMatcher::run(Band& band) const {
  const DisparityViews own{{band.disparity.data(), width_, band.height},
                           {band.confidence.data(), width_, band.height},
                           {band.fraction.data(), width_, band.height}};
  // Sizes were checked for the whole image.
  (void)band.matcher->match(rows_of(left_, band.top, band.height), rows_of(right_, band.top, band.height), own);
  const int skip = band.first - band.top;
  copy_rows(band.disparity, skip, width_, out_.disparity, band.first, band.last);
  copy_rows(band.confidence, skip, width_, out_.confidence, band.first, band.last);
  if (out_.fraction.data != nullptr) copy_rows(band.fraction, skip, width_, out_.fraction, band.first, band.last);
}

void BandMatcher::serve(Band& band, const std::stop_token& stop) {
  for (uint32_t seen = 0;;) {
    asked_.wait(seen, std::memory_order_acquire);
    if (stop.stop_requested()) return;
    seen = asked_.load(std::memory_order_acquire);
    run(band);
    if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == threads_.size()) done_.notify_one();
  }
}

bool BandMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  if (!fit(left, right, out, width_, height_, channels_)) return false;
  left_ = left;
  right_ = right;
  out_ = out;
  done_.store(0, std::memory_order_relaxed);
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_all();
  run(bands_.front());
  const auto others = static_cast<uint32_t>(bands_.size() - 1);
  for (uint32_t done = done_.load(std::memory_order_acquire); done != others;
       done = done_.load(std::memory_order_acquire))
    done_.wait(done, std::memory_order_acquire);
  return true;
}

void BandMatcher::limit_search(int disparities) {
  for (Band& band : bands_) band.matcher->limit_search(disparities);
}

}  // namespace takt::stereo
