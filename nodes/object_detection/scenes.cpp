// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace takt::object_detection {
namespace {

/// A mean colour of low saturation, noise of five scales in brightness and, weaker, in colour, and 30 rectangles of
/// any colour that let up to half of it through.
cv::Mat3f generated_background(const SceneParameters& p, cv::RNG& random) {
  const float grey = random.uniform(60.0f, 170.0f);
  cv::Vec3f mean;
  for (int channel = 0; channel < 3; ++channel) mean[channel] = grey + random.uniform(-40.0f, 40.0f);
  cv::Mat3f image(p.height, p.width, mean);
  for (int pitch = 128; pitch >= 8; pitch /= 2) {
    cv::Mat1f light(p.height / pitch + 2, p.width / pitch + 2);
    cv::Mat3f tint(light.size());
    random.fill(light, cv::RNG::NORMAL, 0, 12);
    random.fill(tint, cv::RNG::NORMAL, 0, 6);
    cv::Mat3f octave;
    cv::cvtColor(light, octave, cv::COLOR_GRAY2BGR);
    octave += tint;
    cv::resize(octave, octave, image.size(), 0, 0, cv::INTER_LINEAR);
    image += octave;
  }
  for (int k = 0; k < 30; ++k) {
    const cv::Rect wanted(random.uniform(-40, p.width), random.uniform(-40, p.height), random.uniform(10, 120),
                          random.uniform(10, 120));
    const cv::Vec3f colour(random.uniform(0.0f, 255.0f), random.uniform(0.0f, 255.0f), random.uniform(0.0f, 255.0f));
    const float weight = random.uniform(0.5f, 1.0f);
    const cv::Rect inside = wanted & cv::Rect(0, 0, p.width, p.height);
    for (int y = inside.y; y < inside.br().y; ++y)
      for (int x = inside.x; x < inside.br().x; ++x) image(y, x) = (1 - weight) * image(y, x) + weight * colour;
  }
  return image;
}

cv::Mat3f background(const SceneParameters& p, cv::RNG& random) {
  if (p.background.data == nullptr) return generated_background(p, random);
  cv::Mat3f image(p.height, p.width);
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x)
      image(y, x) = cv::Vec3f(p.background.at(x, y, 0), p.background.at(x, y, 1), p.background.at(x, y, 2));
  return image;
}

/// Colours and mask are scaled apart and divided, so that the black around the object does not darken its rim.
/// Returns the pixels that the object takes.
cv::Mat1b paste(ImageView<const uint8_t> view, const PlacedObject& at, cv::Mat3f& image) {
  cv::Mat3f colours(view.height, view.width);
  cv::Mat1f mask(view.height, view.width);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      colours(y, x) = cv::Vec3f(view.at(x, y, 0), view.at(x, y, 1), view.at(x, y, 2));
      mask(y, x) = colours(y, x) == cv::Vec3f(0, 0, 0) ? 0.0f : 1.0f;
    }
  }
  const int method = at.side < view.width ? cv::INTER_AREA : cv::INTER_LINEAR;
  cv::resize(colours, colours, {at.side, at.side}, 0, 0, method);
  cv::resize(mask, mask, {at.side, at.side}, 0, 0, method);
  cv::Mat1b object;
  cv::compare(mask, 0.5, object, cv::CMP_GT);
  for (int y = 0; y < at.side; ++y)
    for (int x = 0; x < at.side; ++x)
      if (object(y, x) != 0) image(at.y + y, at.x + x) = colours(y, x) / mask(y, x);
  return object;
}

/// Paints a rectangle over the object that begins beyond one of its sides and ends once it hides `share` of its pixels.
/// Returns the share that it hides.
double occlude(const cv::Mat1b& object, const PlacedObject& at, double share, cv::RNG& random, cv::Mat3f& image) {
  constexpr int kBeyond = 6;
  const int from_side = random.uniform(0, 4);  // left, right, above, below
  const bool across = from_side < 2, backwards = from_side % 2 == 1;
  const cv::Vec3f colour(random.uniform(0.0f, 255.0f), random.uniform(0.0f, 255.0f), random.uniform(0.0f, 255.0f));
  const int all = cv::countNonZero(object);
  int hidden = 0, depth = 0;
  for (; hidden < share * all; ++depth) {
    const int line = backwards ? at.side - 1 - depth : depth;
    hidden += cv::countNonZero(across ? object.col(line) : object.row(line));
  }
  cv::Rect part(at.x - kBeyond, at.y - kBeyond, at.side + 2 * kBeyond, at.side + 2 * kBeyond);
  if (across) part.width = depth + kBeyond;
  else part.height = depth + kBeyond;
  if (from_side == 1) part.x = at.x + at.side - depth;
  if (from_side == 3) part.y = at.y + at.side - depth;
  image(part & cv::Rect(0, 0, image.cols, image.rows)) = colour;
  return static_cast<double>(hidden) / all;
}

bool overlap(const PlacedObject& a, const PlacedObject& b) {
  return std::abs(2 * (a.x - b.x) + a.side - b.side) < a.side + b.side &&
         std::abs(2 * (a.y - b.y) + a.side - b.side) < a.side + b.side;
}

void place_objects(std::span<const DatabaseObject> database, const SceneParameters& p, cv::RNG& random,
                   cv::Mat3f& image, std::vector<PlacedObject>& placed) {
  const int wanted = random.uniform(p.fewest_objects, p.most_objects + 1);
  for (int attempt = 0; static_cast<int>(placed.size()) < wanted && attempt < 100; ++attempt) {
    const auto object = static_cast<size_t>(random.uniform(0, static_cast<int>(database.size())));
    const auto& views = database[object].test_views;
    if (views.empty()) throw std::invalid_argument("object `" + database[object].name + "` has no test_view");
    const ReferenceView& view = views[static_cast<size_t>(random.uniform(0, static_cast<int>(views.size())))];
    const int side = static_cast<int>(std::lround(view.side_px * random.uniform(p.scale_min, p.scale_max)));
    PlacedObject at{object, random.uniform(0, p.width - side + 1), random.uniform(0, p.height - side + 1), side};
    if (std::any_of(placed.begin(), placed.end(), [&](const PlacedObject& other) { return overlap(at, other); }))
      continue;
    const cv::Mat1b pixels = paste(view.view(), at, image);
    if (p.occlusion_max > 0) at.occluded = occlude(pixels, at, random.uniform(0.0, p.occlusion_max), random, image);
    placed.push_back(at);
  }
}

}  // namespace

Scene make_scene(std::span<const DatabaseObject> database, const SceneParameters& p, uint64_t seed, uint64_t index) {
  cv::RNG random(seed * 0x9E3779B97F4A7C15ull + index + 1);
  for (int k = 0; k < 8; ++k) random.next();  // neighbouring states part
  Scene scene;
  scene.width = p.width;
  scene.height = p.height;
  cv::Mat3f image = background(p, random);
  place_objects(database, p, random, image, scene.objects);
  cv::Mat3f noise(image.size());
  random.fill(noise, cv::RNG::NORMAL, 0, p.noise_sigma);
  const double light = random.uniform(p.light_min, p.light_max);
  cv::Mat lit;
  cv::Mat(cv::min(image * light, 255.0) + noise).convertTo(lit, CV_8UC3);
  scene.pixels.assign(lit.datastart, lit.dataend);
  return scene;
}

}  // namespace takt::object_detection
