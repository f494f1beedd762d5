// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/evaluate.hpp"

#include <algorithm>

#include "rt/time/clock.hpp"

namespace takt::traffic_signs {
namespace {

constexpr double kHit = 0.5;
constexpr int kPassageFrames = 12;

bool hits(const Sighting& sighting, const ShownSign& shown) {
  return sighting.sign == shown.sign && intersection_over_union(sighting.box, shown.box) >= kHit;
}

ImageView<const uint8_t> view(const cv::Mat3b& image) { return {image.ptr(), image.cols, image.rows, 3}; }

}  // namespace

size_t sign_index(std::span<const SignModel> signs, std::string_view name) {
  return static_cast<size_t>(
      std::find_if(signs.begin(), signs.end(), [&](const SignModel& sign) { return sign.name == name; }) -
      signs.begin());
}

std::vector<ShownSign> shown_in(const SignScene& scene, std::span<const SignModel> signs) {
  std::vector<ShownSign> shown;
  for (const PlacedSign& placed : scene.signs)
    shown.push_back({sign_index(signs, kSignShapes[static_cast<size_t>(placed.sign)].name), placed.box});
  return shown;
}

void score_image(std::span<const ShownSign> shown, std::span<const Sighting> found, Scores& scores) {
  ++scores.images;
  for (const ShownSign& sign : shown) {
    if (sign.sign >= scores.of_class.size()) continue;
    SignScore& score = scores.of_class[sign.sign];
    ++score.shown;
    score.hit += std::any_of(found.begin(), found.end(), [&](const Sighting& s) { return hits(s, sign); });
  }
  bool wrong = false;
  for (const Sighting& sighting : found) {
    if (std::any_of(shown.begin(), shown.end(), [&](const ShownSign& sign) { return hits(sighting, sign); })) continue;
    ++scores.of_class[sighting.sign].false_positives;
    wrong = true;
  }
  scores.images_false += wrong;
}

Scores score_scenes(SignDetector& detector, uint64_t seed, int count) {
  Scores scores;
  scores.of_class.resize(detector.signs().size());
  for (int i = 0; i < count; ++i) {
    const SignScene scene = make_scene({}, seed, static_cast<uint64_t>(i));
    const int64_t start = thread_cpu_ns();
    detector.run(view(scene.image), {}, {}, [] { return true; });
    scores.times_ms.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
    score_image(shown_in(scene, detector.signs()), detector.sightings(), scores);
  }
  return scores;
}

Scores score_passages(const std::vector<SignModel>& signs, uint64_t seed, int count, double budget_s,
                      const TrackParameters& track_parameters) {
  Scores scores;
  scores.of_class.resize(signs.size());
  const SceneParameters p;
  for (int passage = 0; passage < count; ++passage) {
    SignDetector detector(p.width, p.height, signs, {});
    Tracks tracks(track_parameters);
    bool hit = false;
    std::vector<ShownSign> shown;
    std::vector<Sighting> wrong;  // the last place of each false track
    for (int frame = 0; frame < kPassageFrames; ++frame) {
      const SignScene scene = make_passage(p, seed, static_cast<uint64_t>(passage), frame, kPassageFrames);
      const int64_t start = thread_cpu_ns();
      detector.run(view(scene.image), tracks.expected(), {},
                   [&] { return static_cast<double>(thread_cpu_ns() - start) * 1e-9 < budget_s; });
      tracks.update(detector.sightings(), detector.focused());
      scores.times_ms.push_back(static_cast<double>(thread_cpu_ns() - start) / 1e6);
      shown = shown_in(scene, signs);
      for (const Track& track : tracks.tracks()) {
        if (!track.confirmed || track.missed > 0) continue;
        if (hits(track.last, shown[0])) hit = true;
        else if (const auto known = std::find_if(wrong.begin(), wrong.end(),
                                                 [&](const Sighting& w) {
                                                   return w.sign == track.last.sign &&
                                                          intersection_over_union(w.box, track.last.box) > 0;
                                                 });
                 known != wrong.end())
          *known = track.last;
        else wrong.push_back(track.last);
      }
    }
    ++scores.images;
    scores.images_false += !wrong.empty();
    if (shown[0].sign < signs.size()) {
      ++scores.of_class[shown[0].sign].shown;
      scores.of_class[shown[0].sign].hit += hit;
    }
    for (const Sighting& sighting : wrong) ++scores.of_class[sighting.sign].false_positives;
  }
  return scores;
}

}  // namespace takt::traffic_signs
