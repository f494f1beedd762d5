// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/epipolar.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace takt::calibration {

RectifiedPair rectify(stereo::Rectifier& rectifier, const GreyPair& pair, const Board& board) {
  RectifiedPair out;
  out.images = {cv::Mat(pair.left.size(), CV_8U), cv::Mat(pair.right.size(), CV_8U)};
  const auto view = [](const cv::Mat& m) {
    return ImageView<uint8_t>{m.data, m.cols, m.rows, 1, static_cast<ptrdiff_t>(m.step)};
  };
  if (!rectifier.rectify(view(pair.left), view(pair.right), view(out.images.left), view(out.images.right)))
    throw std::logic_error("a pair of another size than its calibration");
  out.left = find_corners(out.images.left, board);
  out.right = find_corners(out.images.right, board);
  if (out.left.empty() || out.right.empty()) out.left.clear(), out.right.clear();
  else order_like(out.left, out.right);
  return out;
}

std::optional<EpipolarError> epipolar_error(std::span<const RectifiedPair> pairs) {
  EpipolarError out;
  std::vector<double> errors;
  for (const RectifiedPair& pair : pairs) {
    out.pairs += pair.left.empty() ? 0 : 1;
    for (size_t i = 0; i < pair.left.size(); ++i)
      errors.push_back(std::abs(static_cast<double>(pair.left[i].y - pair.right[i].y)));
  }
  if (errors.empty()) return std::nullopt;
  std::sort(errors.begin(), errors.end());
  out.mean_px = std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  out.median_px = errors[errors.size() / 2];
  out.p95_px = errors[errors.size() * 95 / 100];
  return out;
}

}  // namespace takt::calibration
