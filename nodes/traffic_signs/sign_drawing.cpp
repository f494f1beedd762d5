// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/sign_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace takt::traffic_signs {
namespace {

constexpr int kEdge_px = 192;     // longer edge of the flat picture
constexpr int kOversampling = 4;  // pixels of the turned picture per pixel of the image, each way

const cv::Scalar kRed(35, 25, 190), kWhite(235, 235, 235), kYellow(20, 190, 240), kBlue(170, 80, 10),
    kBlack(25, 25, 25), kHousing(35, 38, 35);

/// A sign seen from the front; lengths are shares of the picture's width and height, from its middle: -1..1.
class Flat {
 public:
  explicit Flat(const SignShape& shape)
      : size_(shape.width_m >= shape.height_m
                  ? cv::Size(kEdge_px, static_cast<int>(kEdge_px * shape.height_m / shape.width_m))
                  : cv::Size(static_cast<int>(kEdge_px * shape.width_m / shape.height_m), kEdge_px)),
        colour_(size_, cv::Vec3b::all(0)),
        opaque_(size_, uint8_t{0}) {}

  using Points = std::vector<cv::Point2d>;
  void polygon(const Points& points, const cv::Scalar& colour) {
    std::vector<cv::Point> scaled;
    for (const cv::Point2d& p : points) scaled.push_back(at(p));
    cv::fillConvexPoly(colour_, scaled, colour);
    cv::fillConvexPoly(opaque_, scaled, 255);
  }
  void disc(const cv::Point2d& centre, double radius, const cv::Scalar& colour) {
    const int r = static_cast<int>(std::lround(radius * std::min(size_.width, size_.height) / 2));
    cv::circle(colour_, at(centre), r, colour, cv::FILLED);
    cv::circle(opaque_, at(centre), r, 255, cv::FILLED);
  }
  void box(double left, double top, double right, double bottom, const cv::Scalar& colour) {
    polygon({{left, top}, {right, top}, {right, bottom}, {left, bottom}}, colour);
  }
  void word(const std::string& text) {
    const double scale = 2.0 * kEdge_px / 192;
    const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 7, nullptr);
    cv::putText(colour_, text, {(size_.width - extent.width) / 2, (size_.height + extent.height) / 2},
                cv::FONT_HERSHEY_SIMPLEX, scale, kWhite, 7);
  }
  void mirror() { cv::flip(colour_, colour_, 1); }

  cv::Mat3b colour() const { return colour_; }
  cv::Mat1b opaque() const { return opaque_; }

 private:
  cv::Point at(const cv::Point2d& p) const {
    return {static_cast<int>(std::lround((p.x + 1) / 2 * (size_.width - 1))),
            static_cast<int>(std::lround((p.y + 1) / 2 * (size_.height - 1)))};
  }
  cv::Size size_;
  cv::Mat3b colour_;
  cv::Mat1b opaque_;
};

Flat::Points ring(int corners, double first_angle, double radius) {
  Flat::Points points;
  for (int i = 0; i < corners; ++i) {
    const double angle = first_angle + 2 * std::numbers::pi * i / corners;
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return points;
}

/// An arrow that comes from below and bends to the right.
void bent_arrow(Flat& flat) {
  flat.disc({0, 0}, 1, kWhite);
  flat.disc({0, 0}, 0.94, kBlue);
  flat.box(-0.38, -0.22, -0.10, 0.62, kWhite);
  flat.box(-0.38, -0.22, 0.25, 0.06, kWhite);
  flat.polygon({{0.15, -0.48}, {0.68, -0.08}, {0.15, 0.32}}, kWhite);
}

void traffic_light(Flat& flat, cv::RNG& random) {
  flat.box(-1, -1, 1, 1, kHousing);
  const cv::Scalar lit[] = {{70, 60, 255}, {60, 210, 255}, {170, 240, 60}};
  const int on = random.uniform(0, 4);  // 3: red and yellow
  for (int i = 0; i < 3; ++i) {
    const bool shines = i == on || (on == 3 && i < 2);
    flat.disc({0, -0.64 + 0.64 * i}, 0.70, shines ? lit[i] : lit[i] * 0.22);
  }
}

Flat draw(const SignShape& shape, cv::RNG& random) {
  Flat flat(shape);
  switch (shape.sign) {
    case SignClass::yield:
      flat.polygon({{-1, -1}, {1, -1}, {0, 1}}, kRed);
      flat.polygon({{-0.66, -0.78}, {0.66, -0.78}, {0, 0.56}}, kWhite);
      break;
    case SignClass::stop:
      flat.polygon(ring(8, std::numbers::pi / 8, 1.08), kWhite);
      flat.polygon(ring(8, std::numbers::pi / 8, 1.00), kRed);
      flat.word("STOP");
      break;
    case SignClass::priority:
      flat.polygon(ring(4, 0, 1), kBlack);
      flat.polygon(ring(4, 0, 0.96), kWhite);
      flat.polygon(ring(4, 0, 0.68), kYellow);
      break;
    case SignClass::arrow_left:
    case SignClass::arrow_right:
      bent_arrow(flat);
      if (shape.sign == SignClass::arrow_left) flat.mirror();
      break;
    case SignClass::one_way:
      flat.box(-1, -1, 1, 1, kWhite);
      flat.box(-0.97, -0.92, 0.97, 0.92, kBlue);
      flat.box(-0.85, -0.26, 0.50, 0.26, kWhite);
      flat.polygon({{0.42, -0.70}, {0.86, 0}, {0.42, 0.70}}, kWhite);
      if (random.uniform(0, 2) == 1) flat.mirror();
      break;
    case SignClass::traffic_light: traffic_light(flat, random); break;
  }
  return flat;
}

/// Where the four corners of a turned rectangle lie, seen from four times its longer edge away.
std::array<cv::Point2f, 4> turned_corners(const SignShape& shape, cv::RNG& random) {
  const double degree = std::numbers::pi / 180;
  const double yaw = random.uniform(-35.0, 35.0) * degree, pitch = random.uniform(-12.0, 12.0) * degree,
               roll = random.uniform(-6.0, 6.0) * degree;
  const double away = 4 * std::max(shape.width_m, shape.height_m);
  std::array<cv::Point2f, 4> corners;
  for (size_t i = 0; i < 4; ++i) {
    const double u = (i == 1 || i == 2 ? 0.5 : -0.5) * shape.width_m, v = (i >= 2 ? 0.5 : -0.5) * shape.height_m;
    const double x = u * std::cos(roll) - v * std::sin(roll), y = u * std::sin(roll) + v * std::cos(roll);
    const double depth = away + x * std::sin(yaw) + y * std::sin(pitch);
    corners[i] =
        cv::Point2f(static_cast<float>(x * std::cos(yaw) / depth), static_cast<float>(y * std::cos(pitch) / depth));
  }
  return corners;
}

}  // namespace

cv::Rect2f draw_sign(cv::Mat3f& image, SignClass sign, const cv::Rect2f& area, cv::RNG& random) {
  const SignShape& shape = kSignShapes[static_cast<size_t>(sign)];
  const Flat flat = draw(shape, random);
  auto corners = turned_corners(shape, random);
  const auto [left, right] =
      std::minmax_element(corners.begin(), corners.end(), [](auto& a, auto& b) { return a.x < b.x; });
  const auto [top, bottom] =
      std::minmax_element(corners.begin(), corners.end(), [](auto& a, auto& b) { return a.y < b.y; });
  const cv::Point2f low(left->x, top->y);
  const cv::Size2f extent(right->x - left->x, bottom->y - top->y);
  const float scale = std::min(area.width / extent.width, area.height / extent.height);
  const cv::Point2f middle = (area.tl() + area.br()) / 2;
  const cv::Rect2f box(middle.x - scale * extent.width / 2, middle.y - scale * extent.height / 2, scale * extent.width,
                       scale * extent.height);
  const cv::Rect patch(cv::Point(cvFloor(box.x) - 1, cvFloor(box.y) - 1),
                       cv::Point(cvCeil(box.br().x) + 1, cvCeil(box.br().y) + 1));
  for (cv::Point2f& corner : corners)
    corner = ((corner - low) * scale + box.tl() - cv::Point2f(patch.tl())) * kOversampling;
  const auto w = static_cast<float>(flat.colour().cols), h = static_cast<float>(flat.colour().rows);
  const std::array<cv::Point2f, 4> from{{{0, 0}, {w, 0}, {w, h}, {0, h}}};
  const cv::Mat turn = cv::getPerspectiveTransform(from.data(), corners.data());
  cv::Mat colour, opaque;
  cv::warpPerspective(flat.colour(), colour, turn, patch.size() * kOversampling, cv::INTER_LINEAR,
                      cv::BORDER_REPLICATE);
  cv::warpPerspective(flat.opaque(), opaque, turn, patch.size() * kOversampling, cv::INTER_LINEAR);
  cv::resize(colour, colour, patch.size(), 0, 0, cv::INTER_AREA);
  cv::resize(opaque, opaque, patch.size(), 0, 0, cv::INTER_AREA);
  const float fading = random.uniform(0.0f, 0.35f), grey = random.uniform(90.0f, 170.0f),
              light = random.uniform(0.7f, 1.1f);
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

}  // namespace takt::traffic_signs
