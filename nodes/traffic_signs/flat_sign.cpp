// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/flat_sign.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace takt::traffic_signs {
namespace {

using Points = std::vector<cv::Point2d>;

const cv::Scalar kRed(35, 25, 190), kWhite(235, 235, 235), kYellow(25, 170, 235), kBlue(165, 80, 15),
    kBlack(25, 25, 25), kHousing(35, 38, 35);

/// The colour as one of many paints, new or faded.
cv::Scalar paint(const cv::Scalar& bgr, cv::RNG& random) {
  const double light = random.uniform(0.75, 1.1);
  cv::Scalar out;
  for (int channel = 0; channel < 3; ++channel) out[channel] = bgr[channel] * light * random.uniform(0.94, 1.06);
  return out;
}

cv::Point2d mean(const Points& points) {
  cv::Point2d sum;
  for (const cv::Point2d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// The same shape `factor` times as large about its mean.
Points scaled(const Points& points, double factor) {
  const cv::Point2d centre = mean(points);
  Points out;
  for (const cv::Point2d& p : points) out.push_back(centre + factor * (p - centre));
  return out;
}

Points ring(int corners, double first_angle, double radius) {
  Points points;
  for (int i = 0; i < corners; ++i) {
    const double angle = first_angle + 2 * std::numbers::pi * i / corners;
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return points;
}

/// Places are shares of half the picture's width and height from its middle, -1..1; lengths of half its shorter edge.
class Canvas {
 public:
  explicit Canvas(double width_m, double height_m)
      : half_(width_m / std::max(width_m, height_m) * kFlatEdge_px / 2,
              height_m / std::max(width_m, height_m) * kFlatEdge_px / 2),
        sign_{cv::Mat3b(cvRound(2 * half_.y), cvRound(2 * half_.x), cv::Vec3b::all(0)),
              cv::Mat1b(cvRound(2 * half_.y), cvRound(2 * half_.x), uint8_t{0})} {}

  /// `rounding`: radius of the corners; their outlines stay where they are.
  void polygon(const Points& points, const cv::Scalar& colour, double rounding = 0) {
    Points corners;
    for (const cv::Point2d& p : points) corners.push_back(at(p));
    const int radius = length(rounding);
    if (radius > 0) corners = scaled(corners, 1 - radius / inner_radius(corners));
    const std::vector<cv::Point> pixels(corners.begin(), corners.end());
    paint_both(colour, [&](cv::Mat picture, const cv::Scalar& value) {
      cv::fillPoly(picture, std::vector<std::vector<cv::Point>>{pixels}, value);
      if (radius > 0) cv::polylines(picture, pixels, true, value, 2 * radius);
    });
  }
  void box(double left, double top, double right, double bottom, const cv::Scalar& colour) {
    polygon({{left, top}, {right, top}, {right, bottom}, {left, bottom}}, colour);
  }
  void disc(const cv::Point2d& centre, double radius, const cv::Scalar& colour) {
    paint_both(colour, [&](cv::Mat picture, const cv::Scalar& value) {
      cv::circle(picture, at(centre), length(radius), value, cv::FILLED);
    });
  }
  void stroke(const Points& points, double width, const cv::Scalar& colour) {
    std::vector<cv::Point> pixels;
    for (const cv::Point2d& p : points) pixels.emplace_back(at(p));
    cv::polylines(sign_.colour, pixels, false, colour, std::max(1, length(width)));
  }
  void word(const std::string& text, double scale, int thickness, const cv::Scalar& colour) {
    const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, nullptr);
    const cv::Size size = sign_.colour.size();
    cv::putText(sign_.colour, text, {(size.width - extent.width) / 2, (size.height + extent.height) / 2},
                cv::FONT_HERSHEY_SIMPLEX, scale, colour, thickness);
  }
  /// Codes of cv::flip: 0 upside down, 1 left to right.
  void mirror(int code) {
    cv::flip(sign_.colour, sign_.colour, code);
    cv::flip(sign_.opaque, sign_.opaque, code);
  }
  /// For signs that are round.
  void turn(double angle_deg) {
    const cv::Point2f middle(static_cast<float>(half_.x), static_cast<float>(half_.y));
    cv::Mat3b turned;
    cv::warpAffine(sign_.colour, turned, cv::getRotationMatrix2D(middle, angle_deg, 1), sign_.colour.size());
    sign_.colour = turned;
  }
  FlatSign& sign() { return sign_; }

 private:
  cv::Point2d at(const cv::Point2d& p) const { return {(p.x + 1) * half_.x - 0.5, (p.y + 1) * half_.y - 0.5}; }
  int length(double share) const { return cvRound(share * std::min(half_.x, half_.y)); }
  static double inner_radius(const Points& corners) {
    const cv::Point2d centre = mean(corners);
    double least = kFlatEdge_px;
    for (size_t i = 0; i < corners.size(); ++i) {
      const cv::Point2d edge = corners[(i + 1) % corners.size()] - corners[i];
      least = std::min(least, std::abs(edge.cross(centre - corners[i])) / cv::norm(edge));
    }
    return least;
  }
  template <class Draw>
  void paint_both(const cv::Scalar& colour, Draw draw) {
    draw(sign_.colour, colour);
    draw(sign_.opaque, cv::Scalar::all(255));
  }

  cv::Point2d half_;
  FlatSign sign_;
};

const Points kTriangle{{-1, -1}, {1, -1}, {0, 1}};  // on its tip
const Points kDiamond = ring(4, 0, 1);

/// Where it is round, blue with a white rim.
void blue_disc(Canvas& canvas, cv::RNG& random) {
  const double age = random.uniform(0.5, 1.0), rim = random.uniform(0.88, 0.98);
  canvas.disc({0, 0}, 1, paint(kWhite, random) * age);
  canvas.disc({0, 0}, rim, paint(kBlue, random));
}

/// The head of an arrow to the right at `tip`: two strokes, or a triangle whose back may be notched.
void arrow_head(Canvas& canvas, const cv::Point2d& tip, bool strokes, double width, const cv::Scalar& white,
                cv::RNG& random) {
  const double half = random.uniform(0.28, 0.46);
  const double back = strokes ? half : random.uniform(0.38, 0.62), notch = random.uniform(0.0, 0.2);
  if (strokes) canvas.stroke({tip + cv::Point2d(-back, -half), tip, tip + cv::Point2d(-back, half)}, width, white);
  else
    canvas.polygon(
        {tip, tip + cv::Point2d(-back, -half), tip + cv::Point2d(notch - back, 0), tip + cv::Point2d(-back, half)},
        white);
}

/// An arrow that comes from below and bends to the right: sharply or in a wide arc, slender or bold.
void bent_arrow(Canvas& canvas, cv::RNG& random) {
  const cv::Scalar white = paint(kWhite, random);
  const double width = random.uniform(0.14, 0.30), radius = random.uniform(0.12, 0.45);
  const cv::Point2d corner{random.uniform(-0.45, -0.20), random.uniform(-0.36, -0.08)};
  const cv::Point2d tip(random.uniform(0.45, 0.75), corner.y);
  const bool strokes = random.uniform(0, 2) == 1;
  constexpr int kArcSteps = 8;
  Points shaft{{corner.x, random.uniform(0.45, 0.70)}};
  for (int i = 0; i <= kArcSteps; ++i) {
    const double angle = std::numbers::pi / 2 * i / kArcSteps;
    shaft.push_back(corner + radius * cv::Point2d(1 - std::cos(angle), 1 - std::sin(angle)));
  }
  shaft.emplace_back(std::max(tip.x - (strokes ? width / 2 : 0.35), shaft.back().x), corner.y);
  canvas.stroke(shaft, width, white);
  arrow_head(canvas, tip, strokes, width, white, random);
}

void straight_arrow(Canvas& canvas, cv::RNG& random) {
  const cv::Scalar white = paint(kWhite, random);
  const double width = random.uniform(0.14, 0.30);
  const cv::Point2d tip(random.uniform(0.55, 0.75), 0);
  canvas.stroke({{-0.6, 0}, {tip.x - 0.3, 0}}, width, white);
  arrow_head(canvas, tip, random.uniform(0, 2) == 1, width, white, random);
}

void yield(Canvas& canvas, cv::RNG& random) {
  const cv::Scalar white = paint(kWhite, random);
  const double rounding = random.uniform(0.02, 0.12), rim = random.uniform(0.90, 1.0),
               inner = random.uniform(0.58, 0.76);
  canvas.polygon(kTriangle, white, rounding);
  canvas.polygon(scaled(kTriangle, rim), paint(kRed, random), rounding);
  canvas.polygon(scaled(kTriangle, inner), white, 0.3 * rounding);
}

void stop(Canvas& canvas, cv::RNG& random) {
  const cv::Scalar white = paint(kWhite, random);
  const double rim = random.uniform(0.98, 1.05), letters = random.uniform(1.8, 2.1);
  canvas.polygon(ring(8, std::numbers::pi / 8, 1.08), white);
  canvas.polygon(ring(8, std::numbers::pi / 8, rim), paint(kRed, random));
  canvas.word("STOP", letters, random.uniform(6, 10), white);
}

void priority(Canvas& canvas, cv::RNG& random) {
  const double rounding = random.uniform(0.04, 0.16), inner = random.uniform(0.56, 0.68),
               line = random.uniform(0.0, 0.05), border = random.uniform(0.15, 1.0), rim = random.uniform(0.92, 0.99);
  const cv::Scalar white = paint(kWhite, random);
  canvas.polygon(kDiamond, white * border, rounding);
  canvas.polygon(scaled(kDiamond, rim), white, rounding);
  canvas.polygon(scaled(kDiamond, inner), kBlack, 0.3 * rounding);
  canvas.polygon(scaled(kDiamond, inner - line), paint(kYellow, random), 0.3 * rounding);
}

void blue_board(Canvas& canvas, cv::RNG& random) {
  canvas.box(-1, -1, 1, 1, paint(kWhite, random));
  canvas.box(-0.97, -0.92, 0.97, 0.92, paint(kBlue, random));
}

void one_way(Canvas& canvas, cv::RNG& random) {
  const cv::Scalar white = paint(kWhite, random);
  blue_board(canvas, random);
  const double half = random.uniform(0.20, 0.32), neck = random.uniform(0.36, 0.50), head = random.uniform(0.60, 0.78);
  canvas.box(-0.85, -half, neck + 0.05, half, white);
  canvas.polygon({{neck, -head}, {0.88, 0}, {neck, head}}, white);
  if (random.uniform(0, 2) == 1) canvas.word("Einbahnstrasse", 0.45, 1, kBlack);
  if (random.uniform(0, 2) == 1) canvas.mirror(1);
}

void traffic_light(Canvas& canvas, cv::RNG& random) {
  canvas.box(-1, -1, 1, 1, paint(kHousing, random));
  const cv::Scalar lit[] = {{70, 60, 255}, {60, 210, 255}, {170, 240, 60}};
  const int on = random.uniform(0, 4);  // 3: red and yellow
  const double radius = random.uniform(0.62, 0.76), off = random.uniform(0.12, 0.30);
  for (int i = 0; i < 3; ++i) {
    const bool shines = i == on || (on == 3 && i < 2);
    canvas.disc({0, -0.64 + 0.64 * i}, radius, shines ? lit[i] : lit[i] * off);
  }
}

/// Spots, stickers and a shadow's edge.
void wear(cv::Mat3b& picture, cv::RNG& random) {
  const auto anywhere = [&] {
    return cv::Point2f{random.uniform(0.0f, static_cast<float>(picture.cols)),
                       random.uniform(0.0f, static_cast<float>(picture.rows))};
  };
  for (int spots = random.uniform(-2, 4); spots > 0; --spots) {
    const cv::Point2f centre = anywhere();
    const cv::Size2f size{random.uniform(6.0f, 48.0f), random.uniform(6.0f, 48.0f)};
    const cv::RotatedRect spot(centre, size, random.uniform(0.0f, 180.0f));
    cv::Mat3b spotted = picture.clone();
    cv::ellipse(spotted, spot, paint({95, 110, 120}, random), cv::FILLED);
    const double strength = random.uniform(0.2, 0.8);
    cv::addWeighted(spotted, strength, picture, 1 - strength, 0, picture);
  }
  if (random.uniform(0, 4) != 0) return;
  const double angle = random.uniform(0.0, 2 * std::numbers::pi);
  const cv::Point2f through = anywhere();
  const cv::Point2f along(static_cast<float>(2 * kFlatEdge_px * std::cos(angle)),
                          static_cast<float>(2 * kFlatEdge_px * std::sin(angle))),
      across(-along.y, along.x);
  const std::vector<cv::Point> half{through + along, through - along, through - along + across,
                                    through + along + across};
  cv::Mat1b shaded(picture.size(), uint8_t{0});
  cv::fillConvexPoly(shaded, half, 255);
  cv::Mat(picture * random.uniform(0.4, 0.8)).copyTo(picture, shaded);
}

}  // namespace

FlatSign draw_flat(SignClass sign, cv::RNG& random) {
  const SignShape& shape = kSignShapes[static_cast<size_t>(sign)];
  Canvas canvas(shape.width_m, shape.height_m);
  switch (sign) {
    case SignClass::yield: yield(canvas, random); break;
    case SignClass::stop: stop(canvas, random); break;
    case SignClass::priority: priority(canvas, random); break;
    case SignClass::arrow_left:
    case SignClass::arrow_right:
      blue_disc(canvas, random);
      bent_arrow(canvas, random);
      if (sign == SignClass::arrow_left) canvas.mirror(1);
      break;
    case SignClass::one_way: one_way(canvas, random); break;
    case SignClass::traffic_light: traffic_light(canvas, random); break;
  }
  wear(canvas.sign().colour, random);
  return canvas.sign();
}

FlatSign draw_flat_decoy(cv::RNG& random) {
  const int kind = random.uniform(0, 6);
  const bool wide = kind == 3;
  Canvas canvas(wide ? 0.8 : 0.9, wide ? 0.3 : kind < 2 ? 0.8 : 0.9);
  switch (kind) {
    case 0: canvas.polygon(kTriangle, paint(kRed, random), 0.06); break;
    case 1:  // a warning
      yield(canvas, random);
      canvas.disc({0, -0.3}, random.uniform(0.05, 0.25), kBlack);
      canvas.mirror(0);
      break;
    case 2:
      blue_disc(canvas, random);
      if (random.uniform(0, 2) == 1) {
        bent_arrow(canvas, random);
        canvas.turn(45 * random.uniform(1, 8));
      } else {
        straight_arrow(canvas, random);
        canvas.turn(45 * random.uniform(0, 8));
      }
      break;
    case 3:
      blue_board(canvas, random);
      for (int bars = random.uniform(0, 6); bars > 0; --bars) {
        const double left = random.uniform(-0.9, 0.7), top = random.uniform(-0.9, 0.6),
                     right = random.uniform(left + 0.05, 0.9), bottom = random.uniform(top + 0.1, 0.9);
        canvas.box(left, top, right, bottom, paint(kWhite, random));
      }
      break;
    case 4:  // a limit, or no entry
      canvas.disc({0, 0}, 1, paint(kRed, random));
      if (random.uniform(0, 2) == 1) canvas.disc({0, 0}, random.uniform(0.6, 0.85), paint(kWhite, random));
      else canvas.box(-0.75, -0.2, 0.75, 0.2, paint(kWhite, random));
      break;
    default: canvas.polygon(kDiamond, paint(random.uniform(0, 2) == 1 ? kYellow : kWhite, random), 0.1);
  }
  wear(canvas.sign().colour, random);
  return canvas.sign();
}

}  // namespace takt::traffic_signs
