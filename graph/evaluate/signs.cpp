// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "graph/cli/outcome.hpp"
#include "graph/evaluate/evaluations.hpp"
#include "hal/settings/json.hpp"
#include "nodes/traffic_signs/evaluate.hpp"
#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"

namespace takt::command {
namespace {

using namespace traffic_signs;
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kPad_px = 24;  // around a crop, so that a window with its margin fits

/// Names of the recordings' classes in the list of signs.
const std::map<std::string, std::string> kNames{
    {"priority_road", "priority"}, {"turn_right_ahead", "arrow_right"}, {"turn_left_ahead", "arrow_left"}};

size_t recorded_sign(const std::vector<SignModel>& signs, const std::string& name) {
  const auto other = kNames.find(name);
  return sign_index(signs, other != kNames.end() ? other->second : name);
}

/// A file with commas, whose first line names the columns; what it lacks is told with its line.
class Table {
 public:
  explicit Table(fs::path file) : file_(std::move(file)) {
    require_readable<std::invalid_argument>(file_);
    std::ifstream in(file_);
    for (std::string line; std::getline(in, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      std::istringstream cells(line);
      auto& row = rows_.emplace_back();
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    }
    if (rows_.empty()) fail(0, "is empty; its first line names the columns");
  }
  size_t rows() const { return rows_.size() - 1; }
  const fs::path& file() const { return file_; }
  /// The first of these names that is a column.
  size_t column(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (const auto found = std::find(rows_[0].begin(), rows_[0].end(), name); found != rows_[0].end())
        return static_cast<size_t>(found - rows_[0].begin());
    fail(0, fmt::format("has no column `{}`; its columns are {}", *names.begin(), fmt::join(rows_[0], ", ")));
  }
  const std::string& text(size_t row, size_t column) const {
    const auto& cells = rows_[row + 1];
    if (column >= cells.size()) fail(row + 1, fmt::format("lacks `{}`", rows_[0][column]));
    return cells[column];
  }
  int number(size_t row, size_t column) const {
    const std::string& cell = text(row, column);
    int value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc() || end != cell.data() + cell.size())
      fail(row + 1, fmt::format("`{}` is `{}`, must be a whole number", rows_[0][column], cell));
    return value;
  }
  /// The image of a row, relative to the table, else to `folder`; none if it lies elsewhere than in `folder`.
  std::optional<fs::path> image(size_t row, size_t column, const fs::path& folder) const {
    const std::string& name = text(row, column);
    for (const fs::path& from : {file_.parent_path(), folder}) {
      if (!fs::exists(from / name)) continue;
      const fs::path below = fs::canonical(from / name).lexically_relative(fs::canonical(folder));
      return *below.begin() == ".." ? std::nullopt : std::optional(from / name);
    }
    fail(row + 1, fmt::format("there is no image `{}`, neither beside this file nor in {}", name, folder.string()));
  }

 private:
  [[noreturn]] void fail(size_t row, const std::string& what) const {
    throw std::invalid_argument(fmt::format("{}:{}: {}", file_.string(), row + 1, what));
  }

  fs::path file_;
  std::vector<std::vector<std::string>> rows_;
};

std::vector<Sighting> search(const std::vector<SignModel>& signs, const cv::Mat3b& image) {
  SignDetector detector(image.cols, image.rows, signs, {});
  detector.run({image.ptr(), image.cols, image.rows, 3}, {}, {}, [] { return true; });
  return {detector.sightings().begin(), detector.sightings().end()};
}

/// The trivial guess to compare with: of each image that the sign which is shown most fills its middle.
Sighting in_the_middle(size_t sign, const cv::Size& size) {
  return {sign, {size.width / 10, size.height / 10, size.width * 8 / 10, size.height * 8 / 10}, 1};
}

/// That sign: the one that most of these are, 0 if they are none.
size_t most_frequent(const std::vector<SignModel>& signs, const std::vector<size_t>& shown) {
  std::vector<size_t> count(signs.size() + 1);
  for (const size_t sign : shown) ++count[sign];
  return static_cast<size_t>(std::max_element(count.begin(), count.end() - 1) - count.begin());
}

/// Scores of what is found and of the guess.
struct Judged {
  size_t guess;
  Scores found, guessed;
  Judged(size_t sign, size_t signs) : guess(sign) {
    found.of_class.resize(signs);
    guessed.of_class.resize(signs);
  }
};

/// Scores by track, several images of one sign: it is hit if it is in one of them.
class TrackScores {
 public:
  explicit TrackScores(size_t signs) { scores_.of_class.resize(signs); }
  void add(const ShownSign& shown, const std::string& track, std::span<const Sighting> found) {
    Scores image;
    image.of_class.resize(scores_.of_class.size());
    score_image({&shown, 1}, found, image);
    for (size_t sign = 0; sign < image.of_class.size(); ++sign)
      scores_.of_class[sign].false_positives += image.of_class[sign].false_positives;
    ++scores_.images;
    scores_.images_false += image.images_false;
    if (shown.sign < image.of_class.size()) hit_[{shown.sign, track}] |= image.of_class[shown.sign].hit > 0;
  }
  Scores total() const {
    Scores total = scores_;
    for (const auto& [track, hit] : hit_) {
      ++total.of_class[track.first].shown;
      total.of_class[track.first].hit += hit;
    }
    return total;
  }

 private:
  Scores scores_;
  std::map<std::pair<size_t, std::string>, bool> hit_;
};

/// A rate in percent; null of nothing.
Json percent(int part, int whole) { return whole > 0 ? Json(100.0 * part / whole) : Json(nullptr); }

void add_rates(Json& out, const Scores& scores) {
  int shown = 0, hit = 0;
  for (const SignScore& score : scores.of_class) shown += score.shown, hit += score.hit;
  out["hits_pct"] = percent(hit, shown);
  out["false_pct"] = percent(scores.images_false, scores.images);
}

Json to_json(const std::vector<SignModel>& signs, const Scores& scores) {
  Json rows = Json::array();
  for (size_t sign = 0; sign < signs.size(); ++sign) {
    const SignScore& s = scores.of_class[sign];
    rows.push_back(
        {{"sign", signs[sign].name}, {"shown", s.shown}, {"hit", s.hit}, {"false_positives", s.false_positives}});
  }
  Json out;
  add_rates(out, scores);
  out["images"] = scores.images;
  out["signs"] = rows;
  if (auto times = scores.times_ms; !times.empty()) {
    std::sort(times.begin(), times.end());
    out["p50_ms"] = times[times.size() / 2];
    out["p99_ms"] = times[times.size() * 99 / 100];
    out["max_ms"] = times.back();
  }
  return out;
}

Json to_json(const std::vector<SignModel>& signs, const Judged& judged) {
  Json out = to_json(signs, judged.found);
  out["baseline"] = {{"name", "each image holds " + signs[judged.guess].name + " in its middle"}};
  add_rates(out["baseline"], judged.guessed);
  return out;
}

/// What stands before the last _ of a crop's name; crops of one class and track show one sign.
std::string track_of(const fs::path& crop) {
  const std::string name = crop.stem().string();
  return name.substr(0, name.rfind('_'));
}

/// The drawings that cascades learn from were made looking at GTSRB's tracks of even number; others are held out.
bool held_out(const std::string& track) { return track.empty() || (track.back() - '0') % 2 != 0; }

/// Crops of signs with a border of 10 %, by track; of classes that the list does not have nothing may be found.
Json judge_crops(const std::vector<SignModel>& signs, const EvalSignsOptions& o) {
  const Table table(o.labels);
  const size_t file = table.column({"file"}), name = table.column({"name", "class"});
  std::vector<std::pair<fs::path, size_t>> crops;
  std::vector<size_t> shown;
  for (size_t row = 0; row < table.rows(); ++row) {
    const auto image = table.image(row, file, o.crops);
    if (!image) continue;
    crops.emplace_back(*image, recorded_sign(signs, table.text(row, name)));
    shown.push_back(crops.back().second);
  }
  if (crops.empty()) throw std::invalid_argument(o.labels.string() + " names no image in " + o.crops.string());
  const size_t guess = most_frequent(signs, shown);
  TrackScores all(signs.size()), unseen(signs.size()), guessed(signs.size());
  for (const auto& [path, sign] : crops) {
    const cv::Mat3b crop = read_image(path, Channels::colour);
    cv::Mat3b image;
    cv::copyMakeBorder(crop, image, kPad_px, kPad_px, kPad_px, kPad_px, cv::BORDER_REPLICATE);
    Box box = in_the_middle(sign, crop.size()).box;
    box.x += kPad_px, box.y += kPad_px;
    const auto found = search(signs, image);
    const std::string track = track_of(path);
    all.add({sign, box}, track, found);
    if (held_out(track)) unseen.add({sign, box}, track, found);
    const Sighting middle{guess, box, 1};
    guessed.add({sign, box}, track, {&middle, 1});
  }
  Judged judged(guess, signs.size());
  judged.found = all.total();
  judged.guessed = guessed.total();
  Json out = to_json(signs, judged);
  out["held_out"] = to_json(signs, unseen.total());
  return out;
}

/// Images with boxes around all signs of the list's classes.
Json judge_scenes(const std::vector<SignModel>& signs, const EvalSignsOptions& o) {
  const Table table(o.boxes);
  const size_t file = table.column({"file"}), name = table.column({"class", "name"});
  const size_t x = table.column({"x"}), y = table.column({"y"}), w = table.column({"w", "width"}),
               h = table.column({"h", "height"});
  std::map<fs::path, std::vector<ShownSign>> images;
  std::vector<size_t> shown;
  for (size_t row = 0; row < table.rows(); ++row) {
    const auto image = table.image(row, file, o.scenes);
    if (!image) continue;
    shown.push_back(recorded_sign(signs, table.text(row, name)));
    images[*image].push_back(
        {shown.back(), {table.number(row, x), table.number(row, y), table.number(row, w), table.number(row, h)}});
  }
  if (images.empty()) throw std::invalid_argument(o.boxes.string() + " names no image in " + o.scenes.string());
  Judged judged(most_frequent(signs, shown), signs.size());
  for (const auto& [path, there] : images) {
    const cv::Mat3b image = read_image(path, Channels::colour);
    score_image(there, search(signs, image), judged.found);
    const Sighting middle = in_the_middle(judged.guess, image.size());
    score_image(there, {&middle, 1}, judged.guessed);
  }
  return to_json(signs, judged);
}

/// Scenes each on its own; passages below them.
Json judge_generated(const std::vector<SignModel>& signs, const EvalSignsOptions& o) {
  const SceneParameters p;
  const uint64_t seed = o.seed + 1000;  // apart from what was learnt from
  SignDetector detector(p.width, p.height, signs, {});
  std::vector<std::vector<ShownSign>> scenes;
  std::vector<size_t> shown;
  for (int i = 0; i < o.count; ++i) {
    scenes.push_back(shown_in(make_scene(p, seed, static_cast<uint64_t>(i)), signs));
    for (const ShownSign& sign : scenes.back()) shown.push_back(sign.sign);
  }
  Judged judged(most_frequent(signs, shown), signs.size());
  judged.found = score_scenes(detector, seed, o.count);
  const Sighting middle = in_the_middle(judged.guess, {p.width, p.height});
  for (const auto& there : scenes) score_image(there, {&middle, 1}, judged.guessed);
  Json out = to_json(signs, judged);
  out["seed"] = o.seed;
  TrackParameters tracks;
  tracks.confirm = o.confirm;
  out["passages"] = to_json(signs, score_passages(signs, seed, o.passages, o.budget_ms * 1e-3, tracks));
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
  const auto rates = [](const Json& of) {
    const auto text = [](const Json& rate) { return rate.is_null() ? "-" : fmt::format("{:.1f}", rate.get<double>()); };
    return fmt::format("hits {} %, false in {} % of the images", text(of["hits_pct"]), text(of["false_pct"]));
  };
  std::printf("  all: %s\n", rates(part).c_str());
  if (part.contains("baseline"))
    std::printf("  if %s: %s\n", part["baseline"]["name"].get<std::string>().c_str(), rates(part["baseline"]).c_str());
  if (part.contains("p50_ms"))
    std::printf("  CPU ms per image: p50 %.1f, p99 %.1f, max %.1f\n", part["p50_ms"].get<double>(),
                part["p99_ms"].get<double>(), part["max_ms"].get<double>());
}

}  // namespace

int evaluate(const EvalSignsOptions& o) {
  cv::setNumThreads(1);
  const auto signs = read_signs(o.signs.empty() ? shipped("graph/signs") : o.signs);
  const Json out = !o.crops.empty()    ? judge_crops(signs, o)
                   : !o.scenes.empty() ? judge_scenes(signs, o)
                                       : judge_generated(signs, o);
  if (o.json) {
    std::printf("%s\n", out.dump(2).c_str());
    return kOk;
  }
  print(!o.crops.empty()    ? "crops, by track"
        : !o.scenes.empty() ? "photographs"
                            : "generated scenes, each on its own, no budget",
        out);
  if (out.contains("held_out"))
    print("the same, tracks of odd number alone: held out while signs were drawn", out["held_out"]);
  if (out.contains("passages"))
    print(fmt::format("generated passages of 12 frames, budget {:g} ms, tracked", o.budget_ms).c_str(),
          out["passages"]);
  return kOk;
}

}  // namespace takt::command
