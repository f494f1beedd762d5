// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/sign_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace takt::traffic_signs {
namespace {

cv::RNG stream(uint64_t seed, uint64_t index) {
  cv::RNG random(seed * 0x9E3779B97F4A7C15ull + index + 1);
  for (int k = 0; k < 8; ++k) random.next();  // neighbouring states part
  return random;
}

/// Noise of octaves from a quarter of the image down to 2 px.
cv::Mat3f texture(cv::Size size, cv::RNG& random) {
  const float grey = random.uniform(40.0f, 220.0f);
  cv::Vec3f mean;
  for (int channel = 0; channel < 3; ++channel) mean[channel] = grey + random.uniform(-35.0f, 35.0f);
  cv::Mat3f image(size, mean);
  const double strength = random.uniform(4.0, 24.0);
  for (int pitch = std::max(size.width / 4, 4); pitch >= 2; pitch /= 2) {
    cv::Mat3f coarse(size.height / pitch + 2, size.width / pitch + 2), octave;
    random.fill(coarse, cv::RNG::NORMAL, 0, strength);
    cv::resize(coarse, octave, size, 0, 0, cv::INTER_LINEAR);
    image += octave;
  }
  return image;
}

cv::Scalar any_colour(cv::RNG& random) {
  const auto level = [&] { return random.uniform(0.0, 255.0); };
  if (random.uniform(0, 3) == 0) return cv::Scalar::all(level());
  return {level(), level(), level()};
}

void add_shape(cv::Mat3f& image, cv::RNG& random) {
  const int largest = std::max(8, std::min(image.cols, image.rows) / 2);
  const cv::Point at(random.uniform(-largest / 2, image.cols), random.uniform(-largest / 2, image.rows));
  const cv::Size size(random.uniform(4, largest), random.uniform(4, largest));
  const cv::Scalar colour = any_colour(random);
  const bool lets_through = random.uniform(0, 3) == 0;
  const cv::Mat3f before = lets_through ? image.clone() : cv::Mat3f();
  switch (random.uniform(0, 6)) {
    case 0:
    case 1: cv::rectangle(image, {at, size}, colour, cv::FILLED); break;
    case 2:  // framed
      cv::rectangle(image, {at, size}, colour, cv::FILLED);
      cv::rectangle(image, {at, size}, any_colour(random), random.uniform(1, 6));
      break;
    case 3: {
      std::vector<cv::Point> corners;
      for (int i = random.uniform(3, 6); i > 0; --i)
        corners.push_back(at + cv::Point(random.uniform(0, size.width), random.uniform(0, size.height)));
      cv::fillPoly(image, std::vector<std::vector<cv::Point>>{corners}, colour, cv::LINE_AA);
      break;
    }
    case 4:
      cv::ellipse(image, {cv::Point2f(at), cv::Size2f(size), random.uniform(0.0f, 180.0f)}, colour,
                  random.uniform(0, 2) == 0 ? cv::FILLED : random.uniform(1, 8), cv::LINE_AA);
      break;
    default: {
      const int pitch = random.uniform(3, 24), thick = random.uniform(1, pitch);
      const bool upright = random.uniform(0, 2) == 0;
      for (int along = 0; along < (upright ? size.width : size.height); along += pitch)
        cv::rectangle(image,
                      upright ? cv::Rect(at.x + along, at.y, thick, size.height)
                              : cv::Rect(at.x, at.y + along, size.width, thick),
                      colour, cv::FILLED);
    }
  }
  if (lets_through) cv::addWeighted(image, 0.5, before, 0.5, 0, image);
}

cv::Mat3f background(cv::Size size, int shapes, cv::RNG& random) {
  cv::Mat3f image = texture(size, random);
  for (; shapes > 0; --shapes) add_shape(image, random);
  return image;
}

/// Light, motion, blur and noise of a camera.
cv::Mat3b exposed(cv::Mat3f image, const SceneParameters& p, cv::RNG& random) {
  const double light = random.uniform(p.light_min, p.light_max), fall = random.uniform(-0.33, 0.33);
  cv::Vec3f of_colour;
  for (int channel = 0; channel < 3; ++channel)
    of_colour[channel] = static_cast<float>(light * (1 + random.uniform(-p.cast_max, p.cast_max)));
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      image(y, x) =
          image(y, x).mul(of_colour) * static_cast<float>(1 + fall * (static_cast<double>(x) / image.cols - 0.5));
  const int moved = cvFloor(random.uniform(0.0, p.motion_max + 1));
  if (moved > 1) cv::blur(image, image, random.uniform(0, 2) == 0 ? cv::Size(moved, 1) : cv::Size(1, moved));
  const double blur = random.uniform(0.0, p.blur_max);
  if (blur > 0.2) cv::GaussianBlur(image, image, {}, blur);
  cv::Mat3f noise(image.size());
  random.fill(noise, cv::RNG::NORMAL, 0, p.noise_sigma);
  cv::Mat3b bytes;
  cv::Mat(cv::min(image, 255.0) + noise).convertTo(bytes, CV_8U);
  return bytes;
}

bool apart(const Box& a, const Box& b) {
  constexpr int kGap_px = 6;
  return a.x + a.width + kGap_px < b.x || b.x + b.width + kGap_px < a.x || a.y + a.height + kGap_px < b.y ||
         b.y + b.height + kGap_px < a.y;
}

}  // namespace

SignScene make_scene(const SceneParameters& p, uint64_t seed, uint64_t index) {
  cv::RNG random = stream(seed, index);
  SignScene scene;
  cv::Mat3f image = background({p.width, p.height}, random.uniform(p.shapes_min, p.shapes_max), random);
  for (int decoys = random.uniform(0, p.most_decoys + 1); decoys > 0; --decoys) {
    const auto edge = static_cast<float>(random.uniform(p.longest_min, p.longest_max));
    const cv::Point2f at{random.uniform(0.0f, static_cast<float>(p.width) - edge),
                         random.uniform(0.0f, static_cast<float>(p.height) - edge)};
    draw_decoy(image, {at, cv::Size2f(edge, edge)}, random);
  }
  const int wanted = random.uniform(0, p.most_signs + 1);
  for (int attempt = 0; static_cast<int>(scene.signs.size()) < wanted && attempt < 50; ++attempt) {
    const SignShape& shape = kSignShapes[static_cast<size_t>(random.uniform(0, static_cast<int>(kSignShapes.size())))];
    const double scale = random.uniform(p.longest_min, p.longest_max) / std::max(shape.width_m, shape.height_m);
    const cv::Size2f size(static_cast<float>(scale * shape.width_m), static_cast<float>(scale * shape.height_m));
    const cv::Rect2f area(random.uniform(4.0f, static_cast<float>(p.width) - size.width - 4),
                          random.uniform(4.0f, static_cast<float>(p.height) - size.height - 4), size.width,
                          size.height);
    const Box planned{cvFloor(area.x), cvFloor(area.y), cvCeil(size.width), cvCeil(size.height)};
    if (!std::all_of(scene.signs.begin(), scene.signs.end(), [&](auto& other) { return apart(planned, other.box); }))
      continue;
    const cv::Rect2f box = draw_sign(image, shape.sign, area, random);
    scene.signs.push_back({shape.sign, {cvRound(box.x), cvRound(box.y), cvRound(box.width), cvRound(box.height)}});
  }
  scene.image = exposed(image, p, random);
  return scene;
}

SignScene make_passage(const SceneParameters& p, uint64_t seed, uint64_t index, int frame, int frames) {
  cv::RNG random = stream(seed, index);
  const cv::Mat3f far = background({p.width, p.height}, random.uniform(p.shapes_min, p.shapes_max), random);
  const SignShape& shape = kSignShapes[index % kSignShapes.size()];
  const double share = static_cast<double>(frame) / std::max(1, frames - 1);
  const double edge = p.longest_min * std::pow(p.longest_max / p.longest_min, share);
  const double aside = random.uniform(0.8, 1.7) * (random.uniform(0, 2) == 0 ? -1 : 1), up = random.uniform(0.2, 1.2);
  const cv::Point2d middle(p.width / 2.0, p.height / 2.0);
  SignScene scene;
  cv::Mat3f image;
  cv::warpAffine(far, image, cv::getRotationMatrix2D(middle, 0, 1 + 0.5 * share), far.size(), cv::INTER_LINEAR,
                 cv::BORDER_REFLECT);
  const double scale = edge / std::max(shape.width_m, shape.height_m);
  const cv::Size2d size(scale * shape.width_m, scale * shape.height_m);
  const cv::Point2d centre = middle + edge * cv::Point2d(aside, -up);
  cv::RNG look = stream(seed + 1, index);  // the same in all frames
  const cv::Rect2f box =
      draw_sign(image, shape.sign, cv::Rect2d({centre.x - size.width / 2, centre.y - size.height / 2}, size), look);
  scene.signs.push_back({shape.sign, {cvRound(box.x), cvRound(box.y), cvRound(box.width), cvRound(box.height)}});
  cv::RNG camera = stream(seed + 2 + static_cast<uint64_t>(frame), index);
  scene.image = exposed(image, p, camera);
  return scene;
}

cv::Mat1b make_positive(SignClass sign, uint64_t seed, uint64_t index) {
  cv::RNG random = stream(seed, index);
  const SignShape& shape = kSignShapes[static_cast<size_t>(sign)];
  const cv::Size window(shape.window_width, shape.window_height);
  const double larger = std::exp2(random.uniform(0.0, 2.0));
  const cv::Size taken(cvRound(larger * window.width), cvRound(larger * window.height));
  cv::Mat3f image = background(taken, random.uniform(0, 4), random);
  const double scale = random.uniform(0.92, 1.08) * (1 - 2 * kMargin);
  const cv::Size2f size(static_cast<float>(scale * taken.width), static_cast<float>(scale * taken.height));
  const auto offset = [&](int extent, float used) {
    return (static_cast<float>(extent) - used) / 2 + static_cast<float>(extent) * random.uniform(-0.04f, 0.04f);
  };
  const float x = offset(taken.width, size.width), y = offset(taken.height, size.height);
  draw_sign(image, sign, {x, y, size.width, size.height}, random);
  const int shorter = std::min(taken.width, taken.height);
  SceneParameters camera;
  camera.blur_max = 0.06 * shorter;
  camera.motion_max = 0.08 * shorter;
  cv::Mat grey;
  cv::cvtColor(exposed(image, camera, random), grey, cv::COLOR_BGR2GRAY);
  cv::Mat1b scaled;
  cv::resize(grey, scaled, window, 0, 0, cv::INTER_LINEAR_EXACT);
  return scaled;
}

}  // namespace takt::traffic_signs
