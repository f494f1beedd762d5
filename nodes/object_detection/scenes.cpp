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
cv::Mat3f background(const SceneParameters& p, cv::RNG& random) {
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

/// Colours and mask are scaled apart and divided, so that the black around the object does not darken its rim.
void paste(ImageView<const uint8_t> view, const PlacedObject& at, cv::Mat3f& image) {
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
  for (int y = 0; y < at.side; ++y)
    for (int x = 0; x < at.side; ++x)
      if (mask(y, x) > 0.5f) image(at.y + y, at.x + x) = colours(y, x) / mask(y, x);
}

bool overlap(const PlacedObject& a, const PlacedObject& b) {
  return std::abs(2 * (a.x - b.x) + a.side - b.side) < a.side + b.side &&
         std::abs(2 * (a.y - b.y) + a.side - b.side) < a.side + b.side;
}

void place_objects(std::span<const DatabaseObject> database, const SceneParameters& p, cv::RNG& random,
                   cv::Mat3f& image, std::vector<PlacedObject>& placed) {
  const int wanted = random.uniform(0, p.most_objects + 1);
  for (int attempt = 0; static_cast<int>(placed.size()) < wanted && attempt < 100; ++attempt) {
    const auto object = static_cast<size_t>(random.uniform(0, static_cast<int>(database.size())));
    const auto& views = database[object].test_views;
    if (views.empty()) throw std::invalid_argument("object `" + database[object].name + "` has no test_view");
    const ReferenceView& view = views[static_cast<size_t>(random.uniform(0, static_cast<int>(views.size())))];
    const int side = static_cast<int>(std::lround(view.side_px * random.uniform(p.scale_min, p.scale_max)));
    const PlacedObject at{object, random.uniform(0, p.width - side + 1), random.uniform(0, p.height - side + 1), side};
    if (std::any_of(placed.begin(), placed.end(), [&](const PlacedObject& other) { return overlap(at, other); }))
      continue;
    paste(view.view(), at, image);
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
