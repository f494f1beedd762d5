// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "graph/command/eval_command.hpp"
#include "graph/command/prepare.hpp"
#include "nodes/traffic_signs/evaluate.hpp"

namespace takt::command {
namespace {

using namespace traffic_signs;
using Json = nlohmann::ordered_json;

constexpr int kPad_px = 24;  // around a crop, so that a window with its margin fits

/// Names of the recordings' classes in the list of signs.
const std::map<std::string, std::string> kNames{
    {"priority_road", "priority"}, {"turn_right_ahead", "arrow_right"}, {"turn_left_ahead", "arrow_left"}};

size_t recorded_sign(const std::vector<SignModel>& signs, const std::string& name) {
  const auto other = kNames.find(name);
  return sign_index(signs, other != kNames.end() ? other->second : name);
}

/// Rows of a file with commas, without its first.
std::vector<std::vector<std::string>> table(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::invalid_argument(file.string() + ": cannot be read");
  std::vector<std::vector<std::string>> rows;
  std::string line;
  for (std::getline(in, line); std::getline(in, line);) {
    std::istringstream cells(line);
    auto& row = rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
  }
  return rows;
}

std::vector<Sighting> search(const std::vector<SignModel>& signs, const cv::Mat3b& image) {
  SignDetector detector(image.cols, image.rows, signs, {});
  detector.run({image.ptr(), image.cols, image.rows, 3}, {}, {}, [] { return true; });
  return {detector.sightings().begin(), detector.sightings().end()};
}

/// Crops of German signs: a track counts as hit if one of its frames is; of other classes nothing may be found. The
/// drawings that cascades learn from were made looking at tracks of even number; those of odd number are held out.
std::array<Scores, 2> score_crops(const std::vector<SignModel>& signs, const std::filesystem::path& data) {
  std::array<Scores, 2> halves;
  std::array<std::map<std::pair<std::string, std::string>, bool>, 2> hit;
  for (Scores& half : halves) half.of_class.resize(signs.size());
  for (const auto& row : table(data / "gtsrb_labels.csv")) {
    const std::string track = std::filesystem::path(row.at(0)).filename().string().substr(0, 5);
    const auto odd = static_cast<size_t>(std::stoi(track) % 2);
    const cv::Mat3b crop = cv::imread((data / row.at(0)).string());
    cv::Mat3b image;
    cv::copyMakeBorder(crop, image, kPad_px, kPad_px, kPad_px, kPad_px, cv::BORDER_REPLICATE);
    const ShownSign shown{recorded_sign(signs, row.at(2)),
                          {kPad_px + crop.cols / 10, kPad_px + crop.rows / 10, crop.cols * 8 / 10, crop.rows * 8 / 10}};
    Scores frame;
    frame.of_class.resize(signs.size());
    score_image({&shown, 1}, search(signs, image), frame);
    for (size_t sign = 0; sign < signs.size(); ++sign)
      halves[odd].of_class[sign].false_positives += frame.of_class[sign].false_positives;
    ++halves[odd].images;
    if (shown.sign < signs.size()) hit[odd][{row.at(2), track}] |= frame.of_class[shown.sign].hit > 0;
  }
  for (size_t odd = 0; odd < 2; ++odd)
    for (const auto& [track, found] : hit[odd]) {
      SignScore& score = halves[odd].of_class[recorded_sign(signs, track.first)];
      ++score.shown;
      score.hit += found;
    }
  return halves;
}

Scores sum(Scores a, const Scores& b) {
  a.images += b.images;
  for (size_t sign = 0; sign < a.of_class.size(); ++sign) {
    a.of_class[sign].shown += b.of_class[sign].shown;
    a.of_class[sign].hit += b.of_class[sign].hit;
    a.of_class[sign].false_positives += b.of_class[sign].false_positives;
  }
  return a;
}

Scores score_photographs(const std::vector<SignModel>& signs, const std::filesystem::path& data) {
  std::map<std::string, std::vector<ShownSign>> images;
  for (const auto& row : table(data / "scenes_boxes.csv"))
    images[row.at(0)].push_back(
        {recorded_sign(signs, row.at(1)),
         {std::stoi(row.at(2)), std::stoi(row.at(3)), std::stoi(row.at(4)), std::stoi(row.at(5))}});
  Scores scores;
  scores.of_class.resize(signs.size());
  for (const auto& [file, shown] : images)
    score_image(shown, search(signs, cv::imread((data / file).string())), scores);
  return scores;
}

Json to_json(const std::vector<SignModel>& signs, const Scores& scores) {
  Json rows = Json::array();
  for (size_t sign = 0; sign < signs.size(); ++sign) {
    const SignScore& s = scores.of_class[sign];
    rows.push_back(
        {{"sign", signs[sign].name}, {"shown", s.shown}, {"hit", s.hit}, {"false_positives", s.false_positives}});
  }
  Json out{{"images", scores.images}, {"signs", rows}};
  if (auto times = scores.times_ms; !times.empty()) {
    std::sort(times.begin(), times.end());
    out["p50_ms"] = times[times.size() / 2];
    out["p99_ms"] = times[times.size() * 99 / 100];
    out["max_ms"] = times.back();
  }
  return out;
}

void print(const char* title, const Json& part) {
  std::printf("%s\n%-14s %6s %6s %8s %16s %14s\n", title, "  sign", "shown", "hit", "hit %", "false positives",
              "% of images");
  for (const Json& row : part["signs"]) {
    const int shown = row["shown"], hit = row["hit"], wrong = row["false_positives"];
    std::printf("  %-12s %6d %6d %8s %16d %14.1f\n", row["sign"].get<std::string>().c_str(), shown, hit,
                shown > 0 ? fmt::format("{:.1f}", 100.0 * hit / shown).c_str() : "-", wrong,
                100.0 * wrong / part["images"].get<int>());
  }
  if (part.contains("p50_ms"))
    std::printf("  CPU ms per image: p50 %.1f, p99 %.1f, max %.1f\n", part["p50_ms"].get<double>(),
                part["p99_ms"].get<double>(), part["max_ms"].get<double>());
}

int evaluate(const EvalSignsOptions& o) {
  try {
    cv::setNumThreads(1);
    const auto signs = read_signs(o.signs.empty() ? shipped("graph/signs") : o.signs);
    const SceneParameters p;
    SignDetector detector(p.width, p.height, signs, {});
    Json out{{"seed", o.seed}};
    out["scenes"] = to_json(signs, score_scenes(detector, o.seed + 1000, o.scenes));  // apart from what was learnt from
    out["passages"] = to_json(signs, score_passages(signs, o.seed + 1000, o.passages, o.budget_ms * 1e-3));
    std::filesystem::path data = o.data;
    if (const char* root = std::getenv("TAKT_DATA"); data.empty() && root != nullptr)
      data = std::filesystem::path(root) / "traffic_signs";
    if (!data.empty()) {
      const auto [seen, held_out] = score_crops(signs, data);
      out["gtsrb_tracks"] = to_json(signs, sum(seen, held_out));
      out["gtsrb_tracks_held_out"] = to_json(signs, held_out);
      out["photographs"] = to_json(signs, score_photographs(signs, data));
    }
    if (o.json) {
      std::printf("%s\n", out.dump(2).c_str());
      return kOk;
    }
    print("generated scenes, each on its own, no budget", out["scenes"]);
    print(fmt::format("generated passages of 12 frames, budget {:g} ms, tracked", o.budget_ms).c_str(),
          out["passages"]);
    if (data.empty()) std::printf("no recordings: give --data, or set TAKT_DATA\n");
    else {
      print("GTSRB by track, all", out["gtsrb_tracks"]);
      print("GTSRB by track, odd ones: held out while the drawings were made", out["gtsrb_tracks_held_out"]);
      print("photographs", out["photographs"]);
    }
    return kOk;
  } catch (const std::exception& error) {
    return refuse(error.what(), kBadInput);
  }
}

}  // namespace

void add_eval_signs(CLI::App& eval, EvalSignsOptions& o, int& exit_code) {
  CLI::App* app =
      eval.add_subcommand("signs", "traffic signs found on generated scenes and passages, and on recordings");
  app->add_option("--signs", o.signs, "folder with signs.txt (default graph/signs)");
  app->add_option("--data", o.data, "recordings (default traffic_signs below TAKT_DATA)");
  app->add_option("--seed", o.seed, "of scenes and passages (default 1)");
  app->add_option("--scenes", o.scenes, "default 150")->check(CLI::Range(1, 100000));
  app->add_option("--passages", o.passages, "default 70")->check(CLI::Range(1, 100000));
  app->add_option("--budget", o.budget_ms, "ms for each image of a passage (default 36)")->check(CLI::PositiveNumber);
  app->add_flag("--json", o.json, "one JSON object on stdout");
  app->callback([&] { exit_code = evaluate(o); });
}

}  // namespace takt::command
