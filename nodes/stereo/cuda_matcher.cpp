// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/cuda_matcher.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <vector>

#include "nodes/cuda/quicker.hpp"
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

cuda::StereoShape card_shape(int width, int height, int channels, const MatcherParameters& p) {
  return {width,
          height,
          channels,
          p.disparities,
          number_of(p.cost),
          p.truncation(),
          p.n_square,
          p.n_min,
          p.uniqueness,
          p.subpixel,
          p.median,
          p.left_right_check,
          p.selection == Selection::semi_global};
}

bool CudaMatcher::serves(const MatcherParameters& p) {
  return WindowMatcher::serves(p) || SemiGlobalMatcher::serves(p);
}

CudaMatcher::CudaMatcher(int width, int height, int channels, const MatcherParameters& parameters,
                         const cuda::CardUse& use)
    : use_(use),
      width_(width),
      height_(height),
      channels_(channels),
      twin_(make_matcher(width, height, channels, parameters)),
      trust_(use.card.name, use.bound_ns),
      disparities_(parameters.disparities),
      most_disparities_(parameters.disparities),
      min_confidence_(parameters.min_confidence),
      step_once_(parameters.step_once()),
      step_twice_(parameters.step_twice()) {
  if (!serves(parameters))
    throw std::invalid_argument(
        "stereo: a card has square windows with winner takes all, of the costs gradient, ssd, sad and census, and "
        "semi_global of census with n_square 1");
  const cuda::StereoShape shape = card_shape(width, height, channels, parameters);
  std::array<char, cuda::kWhyBytes> why{};
  stereo_ = use.card.cuda->make_stereo(&shape, use.card.index, why.data());
  if (stereo_ == nullptr) throw std::runtime_error(use.card.name + ": " + why.data());
}

CudaMatcher::~CudaMatcher() { use_.card.cuda->free_stereo(stereo_); }

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
  const auto pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  const std::vector<uint8_t> image = cuda::noise(pixels * static_cast<size_t>(channels_));
  std::vector<int16_t> disparity(pixels);
  std::vector<uint8_t> confidence(pixels);
  const DisparityViews out{{disparity.data(), width_, height_}, {confidence.data(), width_, height_}};
  const ImageView<const uint8_t> view(image.data(), width_, height_, channels_);
  return cuda::is_quicker(
      clock, [&] { return match_on_card(view, view, out); }, [&] { (void)twin_->match(view, view, out); });
}

bool CudaMatcher::match(ImageView<const uint8_t> left, ImageView<const uint8_t> right, const DisparityViews& out) {
  if (!fit(left, right, out, width_, height_, channels_)) return false;
  if (trust_.asks() && match_on_card(left, right, out)) return true;
  return twin_->match(left, right, out);
}

bool CudaMatcher::match_on_card(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                                const DisparityViews& out) {
  const cuda::StereoCall call{left.data,           right.data,           left.stride,
                              right.stride,        out.disparity.data,   out.confidence.data,
                              out.fraction.data,   out.disparity.stride, out.confidence.stride,
                              out.fraction.stride, disparities_,         min_confidence_,
                              step_once_,          step_twice_};
  return trust_.done(use_.card.cuda->match(stereo_, &call, use_.bound_ns));
}

}  // namespace takt::stereo
