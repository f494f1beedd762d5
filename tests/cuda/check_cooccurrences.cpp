// SPDX-License-Identifier: Apache-2.0
// Co-occurrences on the card against the definition (nodes/object_detection/reference.hpp): images of patches, views
// cut out of them.
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "nodes/object_detection/reference.hpp"
#include "tests/cuda/check.hpp"

using namespace takt;
using namespace takt::object_detection;

namespace {

struct Scene {
  int width, height, side;
  PairBins bins;
  std::vector<uint8_t> bgr;
  ImageView<const uint8_t> view() const { return {bgr.data(), width, height, 3}; }
};

Scene draw(std::mt19937& random) {
  const auto among = [&](auto... values) {
    const int all[] = {values...};
    return all[random() % (sizeof all / sizeof *all)];
  };
  Scene scene{among(70, 97, 200), among(66, 131), among(5, 17, 48, 64), {among(5, 20), among(1, 5, 25)}, {}};
  if (random() % 8 == 0) scene.width = 300, scene.height = 260, scene.side = 255;
  const int patch = among(1, 5, 40);
  std::vector<uint8_t> levels(3 * 4096);
  for (uint8_t& level : levels) level = static_cast<uint8_t>(random());
  for (int y = 0; y < scene.height; ++y)
    for (int x = 0; x < scene.width; ++x)
      for (int c = 0; c < 3; ++c)
        scene.bgr.push_back(levels[static_cast<size_t>(3 * ((x / patch * 37 + y / patch * 101) % 4096) + c)]);
  return scene;
}

/// The views of an object: histograms of places in the image. Their colours in rising order, counts in the order of
/// pair_bin() of these.
struct Object {
  std::vector<uint8_t> colours;
  std::vector<std::vector<uint32_t>> whole;  ///< over all colours
  std::vector<uint32_t> rows;
  size_t bins = 0;
};

Object draw_object(const Scene& scene, std::mt19937& random) {
  Object object;
  for (size_t views = 1 + random() % 3; views > 0; --views)
    object.whole.push_back(cooccurrence_window_reference(
        scene.view(), static_cast<int>(random() % static_cast<unsigned>(scene.width - scene.side + 1)),
        static_cast<int>(random() % static_cast<unsigned>(scene.height - scene.side + 1)), scene.side, scene.bins));
  const auto bin = [&](int a, int b, int k) {
    return pair_bin(std::min(a, b), std::max(a, b), k, scene.bins.colours, scene.bins.distances);
  };
  for (int a = 0; a < scene.bins.colours; ++a) {
    bool has = false;
    for (const auto& view : object.whole)
      for (int b = 0; b < scene.bins.colours; ++b)
        for (int k = 1; k <= scene.bins.distances; ++k) has = has || view[bin(a, b, k)] > 0;
    if (has) object.colours.push_back(static_cast<uint8_t>(a));
  }
  object.bins = pair_bins(static_cast<int>(object.colours.size()), scene.bins.distances);
  for (const auto& view : object.whole)
    for (size_t a = 0; a < object.colours.size(); ++a)
      for (size_t b = a; b < object.colours.size(); ++b)
        for (int k = 1; k <= scene.bins.distances; ++k)
          object.rows.push_back(view[bin(object.colours[a], object.colours[b], k)]);
  return object;
}

uint32_t missing_by_definition(const std::vector<uint32_t>& window, const std::vector<uint32_t>& view) {
  uint32_t missing = 0;
  for (size_t i = 0; i < view.size(); ++i) missing += view[i] > window[i] ? view[i] - window[i] : 0;
  return missing;
}

}  // namespace

namespace takt::test {

size_t check_cooccurrences(const cuda::Table& card, unsigned seed) {
  std::mt19937 random(seed);
  const Scene scene = draw(random);
  std::vector<Object> objects;
  for (size_t left = 1 + random() % 3; left > 0; --left) objects.push_back(draw_object(scene, random));
  std::vector<cuda::CooccurrenceObject> shapes;
  int most_views = 0;
  for (const Object& object : objects) {
    shapes.push_back({static_cast<int32_t>(object.colours.size()), static_cast<int32_t>(object.whole.size()),
                      object.colours.data(), object.rows.data(), static_cast<ptrdiff_t>(object.bins)});
    most_views = std::max(most_views, shapes.back().views);
  }
  constexpr int kWindows = 12;
  const cuda::CooccurrenceShape shape{scene.width,
                                      scene.height,
                                      scene.side,
                                      scene.bins.colours,
                                      scene.bins.distances,
                                      kWindows,
                                      static_cast<int32_t>(shapes.size()),
                                      shapes.data()};
  const std::string name = std::to_string(scene.width) + "x" + std::to_string(scene.height) + " windows of " +
                           std::to_string(scene.side) + ", " + std::to_string(scene.bins.colours) + " colours, " +
                           std::to_string(scene.bins.distances) + " distances";
  char why[cuda::kWhyBytes] = "";
  cuda::CooccurrencesOnCard* on_card = card.make_cooccurrences(&shape, 0, why);
  if (on_card == nullptr) return std::printf("%s: %s\n", name.c_str(), why), 1;
  size_t wrong = 0;
  for (const int count : {kWindows, 1, 0}) {
    std::vector<cuda::CardWindow> windows;
    std::vector<cuda::CardQuestion> questions;
    std::vector<std::vector<uint32_t>> histograms;
    for (int i = 0; i < count; ++i) {
      windows.push_back({static_cast<int32_t>(random() % static_cast<unsigned>(scene.width - scene.side + 1)),
                         static_cast<int32_t>(random() % static_cast<unsigned>(scene.height - scene.side + 1))});
      histograms.push_back(
          cooccurrence_window_reference(scene.view(), windows.back().x, windows.back().y, scene.side, scene.bins));
      for (int32_t object = 0; object < shape.objects; ++object)
        if (random() % 4 != 0) questions.push_back({i, object});
    }
    std::vector<uint32_t> missing(questions.size() * static_cast<size_t>(most_views), 7);
    const cuda::CooccurrenceCall call{scene.bgr.data(), 3 * scene.width,
                                      windows.data(),   count,
                                      questions.data(), static_cast<int32_t>(questions.size()),
                                      missing.data()};
    if (card.find_missing(on_card, &call, 2'000'000'000) != cuda::Outcome::done)
      wrong += std::printf("%s: not done\n", name.c_str()) > 0;
    for (size_t q = 0; q < questions.size(); ++q) {
      const Object& object = objects[static_cast<size_t>(questions[q].object)];
      for (size_t view = 0; view < object.whole.size(); ++view) {
        const uint32_t expected = missing_by_definition(histograms[static_cast<size_t>(questions[q].window)],
                                                        object.whole[view]),
                       found = missing[q * static_cast<size_t>(most_views) + view];
        if (found != expected && wrong++ == 0)
          std::printf("%s: window %d, object %d, view %zu misses %u, not %u\n", name.c_str(), questions[q].window,
                      questions[q].object, view, found, expected);
      }
    }
  }
  card.free_cooccurrences(on_card);
  return wrong;
}

}  // namespace takt::test
