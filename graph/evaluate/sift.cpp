// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <map>
#include <opencv2/imgproc.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "nodes/sift/sift_match.hpp"
#include "rt/image_file/image_file.hpp"
#include "rt/image_file/image_list.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using sift::Features, sift::Match, sift::Matcher;
using Json = nlohmann::ordered_json;

/// Reference views have 48 px, and SIFT finds little on so few: they and the images are doubled.
constexpr int kScale = 2;

double ms_since(int64_t begin) { return static_cast<double>(thread_cpu_ns() - begin) * 1e-6; }

cv::Mat larger(const cv::Mat& image) {
  cv::Mat out;
  cv::resize(image, out, {}, kScale, kScale, cv::INTER_CUBIC);
  return out;
}

/// Everything that one kind of thing is known by.
struct Known {
  std::string name;
  std::vector<Features> views;
};

struct Scores {
  size_t images = 0, shown = 0;       ///< shown: things that an image really shows
  size_t hits = 0, false_alarms = 0;  ///< false alarms: things found that it does not show
  size_t questions = 0, keypoints = 0, matches = 0, inliers = 0;
  std::vector<double> features_ms, match_ms;  ///< CPU time per image; per image and all views of all things
};

/// The best of a thing's views.
Match best_match(const Matcher& matcher, const Known& known, const Features& image) {
  Match best;
  for (const Features& view : known.views) {
    const Match match = matcher.match(view, image);
    if (match.inliers > best.inliers || (match.inliers == best.inliers && match.matches > best.matches)) best = match;
  }
  return best;
}

std::vector<Match> ask_all(Matcher& matcher, const std::vector<Known>& known, const cv::Mat& image, Scores& scores) {
  int64_t begin = thread_cpu_ns();
  const Features features = matcher.features(larger(image));
  scores.features_ms.push_back(ms_since(begin));
  begin = thread_cpu_ns();
  std::vector<Match> all;
  for (const Known& one : known) all.push_back(best_match(matcher, one, features));
  scores.match_ms.push_back(ms_since(begin));
  ++scores.images;
  scores.keypoints += features.keypoints.size();
  for (const Match& match : all) ++scores.questions, scores.matches += match.matches, scores.inliers += match.inliers;
  return all;
}

/// Scenes of `takt eval objects`: is each object of the database in the image?
Scores measure_generated(const EvalSiftOptions& o) {
  using namespace object_detection;
  const auto database = read_database(o.database.empty() ? shipped("graph/objects") : o.database, 48, TestViews::read);
  Matcher matcher;
  std::vector<Known> known;
  for (const DatabaseObject& object : database) {
    known.push_back({object.name, {}});
    for (const ReferenceView& view : object.views)
      known.back().views.push_back(matcher.features(
          larger(cv::Mat(view.side_px, view.side_px, CV_8UC3, const_cast<uint8_t*>(view.pixels.data())))));
  }
  Scores scores;
  for (int i = 0; i < o.frames; ++i) {
    const Scene scene = make_scene(database, {}, o.seed, static_cast<uint64_t>(i));
    const cv::Mat image(scene.height, scene.width, CV_8UC3, const_cast<uint8_t*>(scene.pixels.data()));
    const auto answers = ask_all(matcher, known, image, scores);
    for (size_t k = 0; k < known.size(); ++k) {
      const bool there =
          std::any_of(scene.objects.begin(), scene.objects.end(), [&](const auto& p) { return p.object == k; });
      scores.shown += there;
      scores.hits += there && answers[k].found;
      scores.false_alarms += !there && answers[k].found;
    }
  }
  return scores;
}

/// FOLDER/CLASS/TRACK_FRAME.png, a picture of one thing each: the last frame of each class's first track is what the
/// class is known by, the last frames of its other tracks are asked about, each against all classes. Right: the class
/// with most inliers, and found.
Scores measure_pictures(const EvalSiftOptions& o) {
  std::map<std::string, std::map<std::string, std::filesystem::path>> last;  // by class and track
  for (const auto& folder : std::filesystem::directory_iterator(o.data)) {
    if (!folder.is_directory()) continue;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      const std::string name = file.path().stem().string();
      auto& frame = last[folder.path().filename().string()][name.substr(0, name.find('_'))];
      if (frame.empty() || in_numeric_order(frame.filename().string(), file.path().filename().string()))
        frame = file.path();
    }
  }
  if (last.size() < 2)
    throw std::runtime_error(o.data.string() + ": must hold a folder of pictures for each of two classes or more");
  const auto read = [](const std::filesystem::path& file) { return read_image(file, Channels::colour); };
  Matcher matcher;
  std::vector<Known> known;
  for (const auto& [name, tracks] : last)
    known.push_back({name, {matcher.features(larger(read(tracks.begin()->second)))}});
  Scores scores;
  for (const auto& [name, tracks] : last)
    for (auto track = std::next(tracks.begin()); track != tracks.end(); ++track) {
      const auto answers = ask_all(matcher, known, read(track->second), scores);
      const auto best = std::max_element(answers.begin(), answers.end(),
                                         [](const Match& a, const Match& b) { return a.inliers < b.inliers; });
      const bool right = known[static_cast<size_t>(best - answers.begin())].name == name;
      ++scores.shown;
      scores.hits += best->found && right;
      scores.false_alarms += best->found && !right;
    }
  return scores;
}

Json to_json(const Scores& s) {
  const auto per = [](size_t sum, size_t count) {
    return count == 0 ? 0.0 : static_cast<double>(sum) / static_cast<double>(count);
  };
  return {{"images", s.images},
          {"shown", s.shown},
          {"hits", s.hits},
          {"hits_pct", 100 * per(s.hits, s.shown)},
          {"false_alarms", s.false_alarms},
          {"keypoints_per_image", per(s.keypoints, s.images)},
          {"matches_per_question", per(s.matches, s.questions)},
          {"inliers_per_question", per(s.inliers, s.questions)},
          {"features_ms", quantile(s.features_ms, 0.5)},
          {"match_ms", quantile(s.match_ms, 0.5)}};
}

void print(const Json& j) {
  const auto number = [&](const char* key) { return j[key].get<double>(); };
  std::printf("SIFT, ratio 0.75, homography with 8 inliers: %.0f of %.0f found (%.1f %%), %.0f false in %.0f images\n",
              number("hits"), number("shown"), number("hits_pct"), number("false_alarms"), number("images"));
  std::printf("%.0f keypoints an image; best view of a thing: %.1f matches, %.1f inliers (mean)\n",
              number("keypoints_per_image"), number("matches_per_question"), number("inliers_per_question"));
  std::printf("CPU an image (median): %.1f ms keypoints, %.1f ms matching and homographies\n", number("features_ms"),
              number("match_ms"));
}

}  // namespace

int evaluate(const EvalSiftOptions& options) {
  cv::setNumThreads(1);
  cv::setRNGSeed(static_cast<int>(options.seed));
  const Json out = to_json(options.data.empty() ? measure_generated(options) : measure_pictures(options));
  if (options.json) std::printf("%s\n", out.dump(2).c_str());
  else print(out);
  return kOk;
}

}  // namespace takt::command
