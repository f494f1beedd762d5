// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/cuda_matcher.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <vector>

#include "nodes/stereo/post_process.hpp"
#include "nodes/stereo/semi_global_matcher.hpp"
#include "nodes/stereo/window_matcher.hpp"

namespace takt::stereo {
namespace {

int32_t number_of(CostKind cost) {
  switch (cost) {
    case CostKind::ssd: return 1;
    case CostKind::sad: return 2;
    case CostKind::census: return 3;
    default: return 0;
  }
}

}  // namespace

bool CudaMatcher::serves(const MatcherParameters& p) {
  return WindowMatcher::serves(p) || SemiGlobalMatcher::serves(p);
}

CudaMatcher::CudaMatcher(int width, int height, int channels, const MatcherParameters& parameters,
                         const cuda::Card& card, int64_t bound_ns)
    : card_(card),
      bound_ns_(bound_ns),
      width_(width),
      height_(height),
      channels_(channels),
      twin_(make_matcher(width, height, channels, parameters)),
      late_(card.name + " was later than " + std::to_string(bound_ns / 1000) + " us"),
      failed_(card.name + " has failed, and is not asked again"),
      disparities_(parameters.disparities),
      most_disparities_(parameters.disparities),
      min_confidence_(parameters.min_confidence),
      step_once_(parameters.step_once()),
      step_twice_(parameters.step_twice()) {
  if (!serves(parameters))
    throw std::invalid_argument(
        "stereo: a card has square windows with winner takes all, of the costs gradient, ssd, sad and census, and "
        "semi_global of census with n_square 1");
  const cuda::StereoShape shape{width,
                                height,
                                channels,
                                parameters.disparities,
                                number_of(parameters.cost),
                                parameters.truncation(),
                                parameters.n_square,
                                parameters.n_min,
                                parameters.uniqueness,
                                parameters.subpixel,
                                parameters.median,
                                parameters.left_right_check,
                                parameters.selection == Selection::semi_global};
  std::array<char, cuda::kWhyBytes> why{};
  stereo_ = card.cuda->make_stereo(&shape, card.index, why.data());
  if (stereo_ == nullptr) throw std::runtime_error(card.name + ": " + why.data());
}

CudaMatcher::~CudaMatcher() { card_.cuda->free_stereo(stereo_); }

void CudaMatcher::limit_search(int disparities) {
  disparities_ = std::clamp(disparities, 1, most_disparities_);
  twin_->limit_search(disparities);
}

void CudaMatcher::tune(const MatcherParameters& parameters) {
  min_confidence_ = parameters.min_confidence;
  step_once_ = parameters.step_once();
  step_twice_ = parameters.step_twice();
  twin_->tune(parameters);
}

void CudaMatcher::want_rows(int first, int last) { twin_->want_rows(first, last); }

bool CudaMatcher::is_quicker(const Clock& clock) {
  constexpr int kTimes = 5;
  const auto pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  std::vector<uint8_t> image(pixels * static_cast<size_t>(channels_));
  uint32_t state = 1;
  for (uint8_t& level : image) level = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  std::vector<int16_t> disparity(pixels);
  std::vector<uint8_t> confidence(pixels);
  const DisparityViews out{{disparity.data(), width_, height_}, {confidence.data(), width_, height_}};
  const auto shortest = [&](auto&& match) {
    int64_t best = std::numeric_limits<int64_t>::max();
    for (int i = 0; i < kTimes; ++i) {
      const int64_t begun_ns = clock.now_ns();
      if (!match(ImageView<const uint8_t>(image.data(), width_, height_, channels_))) break;
      best = std::min(best, clock.now_ns() - begun_ns);
    }
    return best;
  };
  const auto card = shortest([&](auto view) { return match_on_card(view, view, out); });
  return card < shortest([&](auto view) { return twin_->match(view, view, out); });
}

bool CudaMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  if (!fit(left, right, out, width_, height_, channels_)) return false;
  if (!given_up_ && pause_ == 0 && match_on_card(left, right, out)) return true;
  if (pause_ > 0) --pause_;
  return twin_->match(left, right, out);
}

bool CudaMatcher::match_on_card(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                                const DisparityViews& out) {
  const cuda::StereoCall call{left.data,           right.data,           left.stride,
                              right.stride,        out.disparity.data,   out.confidence.data,
                              out.fraction.data,   out.disparity.stride, out.confidence.stride,
                              out.fraction.stride, disparities_,         min_confidence_,
                              step_once_,          step_twice_};
  switch (card_.cuda->match(stereo_, &call, bound_ns_)) {
    case cuda::Outcome::done:
      late_in_row_ = 0;
      trouble_ = &none_;
      return true;
    case cuda::Outcome::late:
      trouble_ = &late_;
      if (++late_in_row_ >= kMostLate) {
        late_in_row_ = 0;
        pause_ = kPause;
      }
      return false;
    case cuda::Outcome::failed: break;
  }
  trouble_ = &failed_;
  given_up_ = true;
  return false;
}

}  // namespace takt::stereo
