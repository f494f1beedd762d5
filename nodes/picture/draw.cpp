// SPDX-License-Identifier: Apache-2.0
#include "nodes/picture/draw.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace takt::picture {
namespace {

constexpr int16_t kOccupied = 1000;

void set(Bgr out, int x, int y, Colour c) {
  if (!out.contains(x, y)) return;
  out.at(x, y, 0) = c.b;
  out.at(x, y, 1) = c.g;
  out.at(x, y, 2) = c.r;
}

void fill(Bgr out, int x0, int y0, int width, int height, Colour c) {
  for (int y = y0; y < y0 + height; ++y)
    for (int x = x0; x < x0 + width; ++x) set(out, x, y, c);
}

void line(Bgr out, double x0, double y0, double x1, double y1, Colour c) {
  const int steps = std::max(1, static_cast<int>(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    const int x = static_cast<int>(std::lround(x0 + share * (x1 - x0))),
              y = static_cast<int>(std::lround(y0 + share * (y1 - y0)));
    fill(out, x, y, 2, 2, c);
  }
}

}  // namespace

Colour heat(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  const auto ramp = [&](double centre) {
    return static_cast<uint8_t>(std::lround(255 * std::clamp(1.5 - std::abs(4 * s - centre), 0.0, 1.0)));
  };
  return {ramp(1), ramp(2), ramp(3)};
}

void draw_disparity(ImageView<const int16_t> map, int disparities, Bgr out) {
  const double range = std::max(1, disparities - 1);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const int16_t d = map.at(x, y);
      set(out, x, y, d < 0 ? Colour{0, 0, 0} : heat(d / range));
    }
}

void draw_grid(ImageView<const int16_t> cells, int scale, Bgr out) {
  for (int row = 0; row < cells.height; ++row)
    for (int column = 0; column < cells.width; ++column) {
      const int16_t v = cells.at(column, row);
      const auto grey = static_cast<uint8_t>(v < 0 ? 128 : 255 - 255 * std::min(v, kOccupied) / kOccupied);
      fill(out, column * scale, (cells.height - 1 - row) * scale, scale, scale, {grey, grey, grey});
    }
}

void draw_image(ImageView<const uint8_t> image, Bgr out) {
  const int green = image.channels == 3 ? 1 : 0, red = image.channels == 3 ? 2 : 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) set(out, x, y, {image.at(x, y), image.at(x, y, green), image.at(x, y, red)});
}

void draw_mask(ImageView<const uint8_t> mask, Bgr out) {
  constexpr Colour kGreen{0, 220, 0};
  const auto ground = [&](int x, int y) { return !mask.contains(x, y) || mask.at(x, y) != 0; };
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) == 0 || !out.contains(x, y)) continue;
      const bool inside = ground(x - 1, y) && ground(x + 1, y) && ground(x, y - 1) && ground(x, y + 1);
      const auto half = [&](int channel, uint8_t of) { return static_cast<uint8_t>((out.at(x, y, channel) + of) / 2); };
      set(out, x, y, inside ? Colour{half(0, kGreen.b), half(1, kGreen.g), half(2, kGreen.r)} : kGreen);
    }
}

void draw_detections(std::span<const Detection> boxes, Bgr out) {
  static constexpr std::array<Colour, 6> kOfClass{
      {{60, 60, 255}, {255, 140, 40}, {60, 230, 60}, {255, 70, 220}, {40, 220, 255}, {240, 240, 60}}};
  cv::Mat image(out.height, out.width, CV_8UC3, out.data, static_cast<size_t>(out.stride));
  for (const Detection& box : boxes) {
    const Colour c = kOfClass[static_cast<size_t>(std::clamp(box.class_id, 0.0f, 1e6f)) % kOfClass.size()];
    const cv::Scalar colour(c.b, c.g, c.r), black(0, 0, 0);
    const cv::Rect2f frame(box.x_px, box.y_px, box.width_px, box.height_px);
    cv::rectangle(image, frame, colour, 2);
    const std::string number = std::to_string(std::lround(box.class_id));
    const cv::Point foot(cv::Point2f(box.x_px + 4, box.y_px + 18));
    cv::putText(image, number, foot, cv::FONT_HERSHEY_SIMPLEX, 0.55, black, 4);  // legible on any ground
    cv::putText(image, number, foot, cv::FONT_HERSHEY_SIMPLEX, 0.55, colour, 1);
  }
}

double draw_track(std::span<const TrackPoint> track, Bgr out) {
  fill(out, 0, 0, out.width, out.height, {255, 255, 255});
  double left = -1, right = 1, bottom = -1, top = 1;
  for (const TrackPoint& p : track) {
    left = std::min(left, p.right_m), right = std::max(right, p.right_m);
    bottom = std::min(bottom, p.forward_m), top = std::max(top, p.forward_m);
  }
  const double margin = 20,
               scale = std::min((out.width - 2 * margin) / (right - left), (out.height - 2 * margin) / (top - bottom));
  const double middle_x = 0.5 * (left + right), middle_y = 0.5 * (bottom + top);
  const auto px = [&](double x) { return out.width / 2.0 + (x - middle_x) * scale; };
  const auto py = [&](double y) { return out.height / 2.0 - (y - middle_y) * scale; };
  double spacing = 1;  // 1, 10, 100 ... m: lines at least 30 px apart
  while (spacing * scale < 30) spacing *= 10;
  for (double x = std::floor(left / spacing) * spacing; x <= right + spacing; x += spacing)
    for (int y = 0; y < out.height; ++y) set(out, static_cast<int>(std::lround(px(x))), y, {220, 220, 220});
  for (double y = std::floor(bottom / spacing) * spacing; y <= top + spacing; y += spacing)
    for (int x = 0; x < out.width; ++x) set(out, x, static_cast<int>(std::lround(py(y))), {220, 220, 220});
  for (size_t i = 1; i < track.size(); ++i) {
    const TrackPoint &a = track[i - 1], &b = track[i];
    line(out, px(a.right_m), py(a.forward_m), px(b.right_m), py(b.forward_m),
         b.measured ? Colour{160, 60, 0} : Colour{0, 0, 220});
  }
  if (!track.empty())
    fill(out, static_cast<int>(px(track[0].right_m)) - 4, static_cast<int>(py(track[0].forward_m)) - 4, 9, 9,
         {0, 160, 0});
  return spacing;
}

}  // namespace takt::picture
