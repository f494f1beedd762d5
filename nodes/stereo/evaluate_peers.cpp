// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/evaluate_peers.hpp"

#include <ctime>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace takt::stereo {
namespace {

cv::Mat padded(ImageView<const uint8_t> view, int left, bool grey) {
  const cv::Mat in(view.height, view.width, CV_8UC(view.channels), const_cast<uint8_t*>(view.data),
                   static_cast<size_t>(view.stride));
  cv::Mat out = in;
  if (grey && view.channels == 3) cv::cvtColor(in, out, cv::COLOR_BGR2GRAY);
  cv::copyMakeBorder(out, out, 0, 0, left, 0, cv::BORDER_REPLICATE);
  return out;
}

double thread_time_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

bool is_semi_global(Peer peer) { return peer == Peer::semi_global || peer == Peer::semi_global_equal_light; }

cv::Ptr<cv::StereoMatcher> make(Peer peer, int range, int channels) {
  if (is_semi_global(peer))
    return cv::StereoSGBM::create(0, range, 5, 8 * channels * 25, 32 * channels * 25, 1,
                                  peer == Peer::semi_global ? 63 : 0, 0, 0, 0, cv::StereoSGBM::MODE_SGBM_3WAY);
  auto matcher = cv::StereoBM::create(range, 15);
  if (peer == Peer::block_matching_unfiltered) {
    matcher->setTextureThreshold(0);
    matcher->setUniquenessRatio(0);
  }
  return matcher;
}

}  // namespace

const char* to_string(Peer peer) {
  switch (peer) {
    case Peer::block_matching: return "stereo_bm_15";
    case Peer::block_matching_unfiltered: return "stereo_bm_15_unfiltered";
    case Peer::semi_global: return "stereo_sgbm_3way_5";
    case Peer::semi_global_equal_light: break;
  }
  return "stereo_sgbm_3way_5_cap_0";
}

DisparityImage run_peer(Peer peer, ImageView<const uint8_t> left, ImageView<const uint8_t> right, int disparities,
                        double* time_ms) {
  if (left.width != right.width || left.height != right.height || left.channels != right.channels || disparities < 1)
    throw std::invalid_argument("the left and the right image must have one size, and the search range at least 1 px");
  const int range = (disparities + 15) / 16 * 16;
  const bool grey = !is_semi_global(peer);
  const cv::Mat l = padded(left, range, grey), r = padded(right, range, grey);
  cv::Mat fixed;
  const auto matcher = make(peer, range, left.channels);
  const double start = thread_time_ms();
  matcher->compute(l, r, fixed);
  if (time_ms != nullptr) *time_ms = thread_time_ms() - start;
  DisparityImage out{left.width, left.height,
                     std::vector<float>(static_cast<size_t>(left.width) * static_cast<size_t>(left.height), -1.0f)};
  for (int y = 0; y < left.height; ++y)
    for (int x = 0; x < left.width; ++x) {
      const int16_t d = fixed.at<int16_t>(y, x + range);
      if (d >= 0) out.at(x, y) = static_cast<float>(d) / 16;
    }
  return out;
}

}  // namespace takt::stereo
