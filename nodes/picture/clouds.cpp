// SPDX-License-Identifier: Apache-2.0
#include "nodes/picture/clouds.hpp"

#include <algorithm>

#include "rt/msg/point.hpp"

namespace takt::picture {
namespace {

constexpr int kPanel = 480, kMargin = 12;
constexpr double kLeftOut = 0.01;  // of the points, at either end of an axis: far ones would make all others small

struct Range {
  float low = 0, high = 0;
};

Range range_of(std::span<const Point> points, float Point::*axis) {
  std::vector<float> values;
  for (const Point& p : points) values.push_back(p.*axis);
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return values.empty() ? Range{} : Range{at(kLeftOut), at(1 - kLeftOut)};
}

void draw(cv::Mat panel, const cloud::CloudView& cloud, const Range& across, const Range& upwards, float Point::*up,
          float px_per_m) {
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const float u = kPanel / 2.0f + (cloud.points[i].x - (across.low + across.high) / 2) * px_per_m;
    const float v = kPanel / 2.0f - (cloud.points[i].*up - (upwards.low + upwards.high) / 2) * px_per_m;
    if (!(u >= 0 && u < kPanel - 1 && v >= 0 && v < kPanel - 1)) continue;
    const Colour c = cloud.coloured() ? cloud.colours[i] : Colour{200, 200, 200};
    panel(cv::Rect(static_cast<int>(u), static_cast<int>(v), 2, 2)).setTo(cv::Scalar(c.b, c.g, c.r));
  }
}

}  // namespace

cv::Mat draw_clouds(std::span<const cloud::CloudView> clouds) {
  cv::Mat image(2 * kPanel, static_cast<int>(clouds.size()) * kPanel, CV_8UC3, cv::Scalar::all(0));
  if (clouds.empty()) return image;
  const Range x = range_of(clouds[0].points, &Point::x), y = range_of(clouds[0].points, &Point::y),
              z = range_of(clouds[0].points, &Point::z);
  const float widest_m = std::max({x.high - x.low, y.high - y.low, z.high - z.low, 1e-6f});
  const float px_per_m = (kPanel - 2 * kMargin) / widest_m;
  for (int i = 0; i < static_cast<int>(clouds.size()); ++i) {
    const cloud::CloudView& cloud = clouds[static_cast<size_t>(i)];
    draw(image(cv::Rect(i * kPanel, 0, kPanel, kPanel)), cloud, x, y, &Point::y, px_per_m);
    draw(image(cv::Rect(i * kPanel, kPanel, kPanel, kPanel)), cloud, x, z, &Point::z, px_per_m);
  }
  return image;
}

}  // namespace takt::picture
