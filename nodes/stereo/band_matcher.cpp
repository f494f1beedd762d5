// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/band_matcher.hpp"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>

#include "nodes/stereo/post_process.hpp"
#include "rt/time/clock.hpp"

namespace takt::stereo {
namespace {

/// Rows above and below that a pixel's disparity depends on: windows, median and the neighbourhood of the cost.
int reach(const MatcherParameters& p) {
  return p.n_square / 2 + p.n_min / 2 + (p.median ? 1 : 0) + (p.cost == CostKind::census ? kCensusRadius : 1);
}

void copy_image(ImageView<const uint8_t> from, uint8_t* to) {
  const size_t row = static_cast<size_t>(from.width) * static_cast<size_t>(from.channels);
  for (int y = 0; y < from.height; ++y) std::memcpy(to + static_cast<size_t>(y) * row, from.row(y), row);
}

template <class T>
ImageView<T> first_rows(ImageView<T> image, int rows) {
  return {image.data, image.width, rows, image.channels, image.stride};
}

template <class T>
void copy_rows(const std::vector<T>& from, int skip, int width, ImageView<T> to, int first, int last) {
  for (int y = first; y < last; ++y)
    std::memcpy(to.row(y), from.data() + static_cast<size_t>(skip + y - first) * static_cast<size_t>(width),
                static_cast<size_t>(width) * sizeof(T));
}

}  // namespace

BandMatcher::BandMatcher(int width, int height, int channels, const MatcherParameters& parameters, int bands,
                         int patience)
    : width_(width),
      channels_(channels),
      height_(height),
      patience_(patience),
      search_(parameters.disparities),
      parameters_(parameters) {
  if (const auto wrong = problem(parameters, width, height, channels)) throw std::invalid_argument("stereo: " + *wrong);
  const int most = std::clamp(height / 16, 1, 8);
  if (bands < 1 || bands > most)
    throw std::invalid_argument("stereo: " + std::to_string(bands) + " bands, must lie in 1.." + std::to_string(most) +
                                " for " + std::to_string(height) + " rows");
  if (parameters.selection == Selection::semi_global)
    throw std::invalid_argument("stereo: semi_global looks along the whole image and has no bands");
  // The caller begins while the others wake up, and so has a few rows more.
  const int lead = bands > 1 ? height / 96 : 0;
  for (int i = 0; i < bands; ++i) {
    Band& band = bands_.emplace_back();
    band.first = i == 0 ? 0 : lead + (height - lead) * i / bands;
    band.last = lead + (height - lead) * (i + 1) / bands;
    band.top = std::max(0, band.first - reach(parameters));
    band.height = std::min(height, band.last + reach(parameters)) - band.top;
    if (i == 0) {
      band.own.matcher = make_matcher_of(band, parameters);
      continue;
    }
    band.own = make_desk(band, parameters);
    band.helper = std::make_unique<Helper>();
    band.helper->desk = make_desk(band, parameters);
    band.helper->left.resize(bytes_of(band.height));
    band.helper->right.resize(bytes_of(band.height));
  }
  for (Band& band : bands_)
    if (band.helper)
      band.helper->thread = std::jthread([this, &band](const std::stop_token& stop) { serve(band, stop); });
}

BandMatcher::~BandMatcher() {
  for (Band& band : bands_) {
    if (!band.helper) continue;
    band.helper->thread.request_stop();
    band.helper->calls.fetch_add(1, std::memory_order_release);
    band.helper->calls.notify_one();
  }
}

size_t BandMatcher::bytes_of(int height) const {
  return static_cast<size_t>(width_) * static_cast<size_t>(height) * static_cast<size_t>(channels_);
}

std::unique_ptr<Matcher> BandMatcher::make_matcher_of(const Band& band, const MatcherParameters& parameters) const {
  auto matcher = make_matcher(width_, band.height, channels_, parameters);
  matcher->want_rows(band.first - band.top, band.last - band.top);
  return matcher;
}

BandMatcher::Desk BandMatcher::make_desk(const Band& band, const MatcherParameters& parameters) const {
  const auto count = static_cast<size_t>(width_) * static_cast<size_t>(band.height);
  return {make_matcher_of(band, parameters), std::vector<int16_t>(count), std::vector<uint8_t>(count),
          std::vector<uint8_t>(count)};
}

void BandMatcher::run(const Band& band, Desk& desk, ImageView<const uint8_t> left,
                      ImageView<const uint8_t> right) const {
  const DisparityViews own{{desk.disparity.data(), width_, band.height},
                           {desk.confidence.data(), width_, band.height},
                           {desk.fraction.data(), width_, band.height}};
  (void)desk.matcher->match(left, right, own);  // sizes were checked for the whole image
}

void BandMatcher::deliver(const Band& band, const Desk& desk, const DisparityViews& out) const {
  const int skip = band.first - band.top;
  copy_rows(desk.disparity, skip, width_, out.disparity, band.first, band.last);
  copy_rows(desk.confidence, skip, width_, out.confidence, band.first, band.last);
  if (out.fraction.data != nullptr) copy_rows(desk.fraction, skip, width_, out.fraction, band.first, band.last);
}

void BandMatcher::ask(const Band& band, ImageView<const uint8_t> left, ImageView<const uint8_t> right) const {
  Helper& helper = *band.helper;
  helper.asked_now = helper.state.load(std::memory_order_acquire) != State::busy;
  if (!helper.asked_now) return;
  const auto call = [&](State state) {
    helper.state.store(state, std::memory_order_release);
    helper.calls.fetch_add(1, std::memory_order_release);
    helper.calls.notify_one();
  };
  call(State::soon);  // it wakes up meanwhile
  copy_image(left, helper.left.data());
  copy_image(right, helper.right.data());
  helper.search = search_;
  helper.parameters = parameters_;
  call(State::asked);
}

void BandMatcher::serve(const Band& band, const std::stop_token& stop) {
  Helper& helper = *band.helper;
  for (uint32_t seen = 0;;) {
    helper.calls.wait(seen, std::memory_order_acquire);
    if (stop.stop_requested()) return;
    seen = helper.calls.load(std::memory_order_acquire);
    for (int looks = 0; looks < patience_ && helper.state.load(std::memory_order_acquire) == State::soon; ++looks)
      hwy::Pause();
    State asked = State::asked;
    if (!helper.state.compare_exchange_strong(asked, State::busy, std::memory_order_acquire)) continue;
    const int64_t before_ns = thread_cpu_ns();  // replay: counted, and no result depends on it
    helper.desk.matcher->tune(helper.parameters);
    helper.desk.matcher->limit_search(helper.search);
    run(band, helper.desk, {helper.left.data(), width_, band.height, channels_},
        {helper.right.data(), width_, band.height, channels_});
    helper_cpu_ns_.fetch_add(thread_cpu_ns() - before_ns, std::memory_order_relaxed);  // replay: likewise
    helper.state.store(State::done, std::memory_order_release);
  }
}

bool BandMatcher::helped(Helper& helper) const {
  if (!helper.asked_now) return false;
  State state = State::asked;
  if (helper.state.compare_exchange_strong(state, State::idle, std::memory_order_acquire)) return false;
  for (int looks = 0; state == State::busy && looks < patience_; ++looks) {
    hwy::Pause();
    state = helper.state.load(std::memory_order_acquire);
  }
  return state == State::done;
}

bool BandMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  if (!fit(left, right, out, width_, height_, channels_)) return false;
  const auto read_by = [](const Band& band, ImageView<const uint8_t> image) {
    return ImageView<const uint8_t>{image.row(band.top), image.width, band.height, image.channels, image.stride};
  };
  for (const Band& band : bands_)
    if (band.helper) ask(band, read_by(band, left), read_by(band, right));
  // The first band is matched in place: below its own rows it reads, and writes nothing that lasts.
  const Band& begin = bands_.front();
  (void)begin.own.matcher->match(read_by(begin, left), read_by(begin, right),
                                 {first_rows(out.disparity, begin.height), first_rows(out.confidence, begin.height),
                                  first_rows(out.fraction, begin.height)});
  for (Band& band : std::span(bands_).subspan(1)) {
    const bool done = helped(*band.helper);
    if (!done) run(band, band.own, read_by(band, left), read_by(band, right));
    deliver(band, done ? band.helper->desk : band.own, out);
  }
  return true;
}

void BandMatcher::tune(const MatcherParameters& parameters) {
  for (Band& band : bands_) band.own.matcher->tune(parameters);
  parameters_ = parameters;
}

void BandMatcher::limit_search(int disparities) {
  search_ = disparities;
  for (Band& band : bands_) band.own.matcher->limit_search(disparities);
}

}  // namespace takt::stereo
