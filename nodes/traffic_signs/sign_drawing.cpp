// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/sign_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "nodes/traffic_signs/flat_sign.hpp"

namespace takt::traffic_signs {
namespace {

using Quad = std::array<cv::Point2f, 4>;

/// Where the corners of a turned picture lie, seen from four times its longer edge away.
Quad turned_corners(cv::Size size, cv::RNG& random) {
  const double degree = std::numbers::pi / 180;
  const double yaw = random.uniform(-35.0, 35.0) * degree, pitch = random.uniform(-12.0, 12.0) * degree,
               roll = random.uniform(-10.0, 10.0) * degree;
  const double away = 4.0 * std::max(size.width, size.height);
  Quad corners;
  for (size_t i = 0; i < 4; ++i) {
    const double u = (i == 1 || i == 2 ? 0.5 : -0.5) * size.width, v = (i >= 2 ? 0.5 : -0.5) * size.height;
    const double x = u * std::cos(roll) - v * std::sin(roll), y = u * std::sin(roll) + v * std::cos(roll);
    const double depth = away + x * std::sin(yaw) + y * std::sin(pitch);
    corners[i] =
        cv::Point2f(static_cast<float>(x * std::cos(yaw) / depth), static_cast<float>(y * std::cos(pitch) / depth));
  }
  return corners;
}

cv::Mat turn_of(cv::Size size, const Quad& to) {
  const auto w = static_cast<float>(size.width), h = static_cast<float>(size.height);
  const Quad from{{{0, 0}, {w, 0}, {w, h}, {0, h}}};
  return cv::getPerspectiveTransform(from.data(), to.data());
}

/// The box around what is opaque, after the turn.
cv::Rect2f box_around(const cv::Mat1b& opaque, const cv::Mat& turn) {
  std::vector<cv::Point2f> ends, turned;
  for (int y = 0; y < opaque.rows; ++y) {
    int first = 0, behind = opaque.cols;
    while (first < behind && opaque(y, first) == 0) ++first;
    while (behind > first && opaque(y, behind - 1) == 0) --behind;
    if (first == behind) continue;
    ends.emplace_back(static_cast<float>(first), static_cast<float>(y));
    ends.emplace_back(static_cast<float>(behind), static_cast<float>(y + 1));
  }
  cv::perspectiveTransform(ends, turned, turn);
  const auto [west, east] =
      std::minmax_element(turned.begin(), turned.end(), [](auto& a, auto& b) { return a.x < b.x; });
  const auto [north, south] =
      std::minmax_element(turned.begin(), turned.end(), [](auto& a, auto& b) { return a.y < b.y; });
  return {west->x, north->y, east->x - west->x, south->y - north->y};
}

/// Puts a flat picture, turned, into the image.
cv::Rect2f place(cv::Mat3f& image, const FlatSign& flat, const cv::Rect2f& area, cv::RNG& random) {
  Quad corners = turned_corners(flat.colour.size(), random);
  const cv::Rect2f near = box_around(flat.opaque, turn_of(flat.colour.size(), corners));
  const float scale = std::min(area.width / near.width, area.height / near.height);
  const cv::Size2f size = near.size() * scale;
  const cv::Rect2f box((area.tl() + area.br()) / 2 - cv::Point2f(size.width, size.height) / 2, size);
  const cv::Rect patch(cv::Point(cvFloor(box.x) - 1, cvFloor(box.y) - 1),
                       cv::Point(cvCeil(box.br().x) + 1, cvCeil(box.br().y) + 1));
  const int oversampling = std::clamp(kFlatEdge_px / std::max(patch.width, patch.height), 1, 4);  // each way
  for (cv::Point2f& corner : corners)
    corner = ((corner - near.tl()) * scale + box.tl() - cv::Point2f(patch.tl())) * oversampling;
  const cv::Mat turn = turn_of(flat.colour.size(), corners);
  cv::Mat colour, opaque;
  cv::warpPerspective(flat.colour, colour, turn, patch.size() * oversampling, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::warpPerspective(flat.opaque, opaque, turn, patch.size() * oversampling, cv::INTER_LINEAR);
  cv::resize(colour, colour, patch.size(), 0, 0, cv::INTER_AREA);
  cv::resize(opaque, opaque, patch.size(), 0, 0, cv::INTER_AREA);
  const float fading = random.uniform(0.0f, 0.35f), grey = random.uniform(90.0f, 170.0f),
              light = random.uniform(0.45f, 1.15f);
  const cv::Rect inside = patch & cv::Rect({}, image.size());
  for (int y = inside.y; y < inside.br().y; ++y)
    for (int x = inside.x; x < inside.br().x; ++x) {
      const cv::Point at(x - patch.x, y - patch.y);
      const cv::Vec3f own =
          light * ((1 - fading) * cv::Vec3f(colour.at<cv::Vec3b>(at)) + fading * cv::Vec3f::all(grey));
      const float share = static_cast<float>(opaque.at<uint8_t>(at)) / 255;
      image(y, x) = (1 - share) * image(y, x) + share * own;
    }
  return box;
}

}  // namespace

cv::Rect2f draw_sign(cv::Mat3f& image, SignClass sign, const cv::Rect2f& area, cv::RNG& random) {
  return place(image, draw_flat(sign, random), area, random);
}

void draw_decoy(cv::Mat3f& image, const cv::Rect2f& area, cv::RNG& random) {
  place(image, draw_flat_decoy(random), area, random);
}

}  // namespace takt::traffic_signs
