// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/database.hpp"

#include <algorithm>
#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>

#include "rt/file/input_file.hpp"
#include "rt/image_file/image_file.hpp"

namespace takt::object_detection {
namespace {

constexpr const char* kWords = "valid are object, threshold, view, test_view, background";

class Reader {
 public:
  /// Without `side_px` views have no pixels.
  Reader(const std::filesystem::path& folder, std::optional<int> side_px, TestViews test_views, const std::string& list)
      : folder_(folder), list_(folder / list), side_px_(side_px), test_views_(test_views) {}

  std::vector<DatabaseObject> read() {
    if (std::filesystem::exists(list_)) require_readable<DatabaseError>(list_);
    std::ifstream in(list_);
    if (!in)
      throw DatabaseError(list_.string() +
                          ": cannot be read; an object database is a folder with this list of objects");
    for (std::string line; std::getline(in, line);) {
      ++line_;
      std::istringstream text(line.substr(0, line.find('#')));
      std::vector<std::string> words;
      for (std::string word; text >> word;) words.push_back(word);
      if (!words.empty()) take(words);
    }
    if (objects_.empty()) fail("names no object; write `object NAME` and its views");
    complete();
    return std::move(objects_);
  }
  /// After read().
  const std::vector<std::filesystem::path>& backgrounds() const { return backgrounds_; }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw DatabaseError(list_.string() + ":" + std::to_string(line_) + ": " + what);
  }

  void take(const std::vector<std::string>& words) {
    const std::string& key = words[0];
    if (key != "object" && key != "threshold" && key != "view" && key != "test_view" && key != "background")
      fail("unknown word `" + key + "`; " + kWords);
    if (key != "object" && key != "background" && objects_.empty())
      fail("`" + key + "` stands before the first `object NAME`");
    const size_t most = key == "view" ? 2 + kHistogramStages : key == "threshold" ? 1 + kStages : 2;
    if (words.size() < 2 || (words.size() > most && key != "object"))
      fail("`" + key + "` takes " +
           (key == "view"        ? "a file and at most three thresholds"
            : key == "threshold" ? "one to four thresholds"
            : key == "object"    ? "a name and its attributes"
                                 : "exactly one word"));
    if (key == "object") begin(words);
    else if (key == "threshold") threshold(words);
    else if (key == "view") add_view(words);
    else if (key == "background") backgrounds_.push_back(folder_ / words[1]);
    else if (test_views_ == TestViews::read) objects_.back().test_views.push_back(load(words[1]));
  }

  void begin(const std::vector<std::string>& words) {
    complete();
    DatabaseObject next;
    next.name = words[1];
    for (size_t i = 2; i < words.size(); ++i) {
      const size_t equals = words[i].find('=');
      if (equals == 0 || equals >= words[i].size() - 1)
        fail("`" + words[i] + "` is no attribute; write ATTRIBUTE=VALUE, such as closed=true");
      next.attributes.push_back({words[i].substr(0, equals), words[i].substr(equals + 1)});
    }
    const auto by_name = [](const Attribute& a, const Attribute& b) { return a.name < b.name; };
    std::sort(next.attributes.begin(), next.attributes.end(), by_name);
    for (size_t i = 1; i < next.attributes.size(); ++i)
      if (!by_name(next.attributes[i - 1], next.attributes[i]))
        fail("attribute `" + next.attributes[i].name + "` is given twice");
    for (const DatabaseObject& object : objects_) {
      if (object.name != next.name) continue;
      if (object.attributes == next.attributes)
        fail("object `" + next.label() + "` is there already; names or attribute values must differ");
      if (!std::equal(object.attributes.begin(), object.attributes.end(), next.attributes.begin(),
                      next.attributes.end(), [](const auto& a, const auto& b) { return a.name == b.name; }))
        fail("object `" + next.label() + "` has other attributes than `" + object.label() +
             "`; only their values may differ");
    }
    objects_.push_back(std::move(next));
    threshold_given_ = false;
  }

  /// The object before must have views.
  void complete() const {
    if (!objects_.empty() && objects_.back().views.empty())
      fail("object `" + objects_.back().label() + "` has no view; write `view FILE` below it");
  }

  void threshold(const std::vector<std::string>& words) {
    if (threshold_given_) fail("object `" + objects_.back().label() + "` has a threshold already");
    threshold_given_ = true;
    objects_.back().thresholds = thresholds(words, 1);
  }

  /// From that word on.
  Thresholds thresholds(const std::vector<std::string>& words, size_t first) const {
    Thresholds thresholds;
    for (size_t i = first; i < words.size(); ++i)
      if (words[i] != "auto") thresholds[i - first] = number(words[i]);
    return thresholds;
  }

  double number(const std::string& word) const {
    size_t used = 0;
    double value = 0;
    try {
      value = std::stod(word, &used);
    } catch (const std::exception&) {
    }
    if (used != word.size() || !(value > 0 && value <= 1))
      fail("the threshold is `" + word + "`, must be a number above 0 and at most 1, or auto");
    return value;
  }

  void add_view(const std::vector<std::string>& words) {
    ReferenceView view = load(words[1]);
    view.thresholds = thresholds(words, 2);
    objects_.back().views.push_back(std::move(view));
  }

  ReferenceView load(const std::string& name) const {
    ReferenceView view;
    view.file = folder_ / name;
    if (!side_px_) return view;
    cv::Mat image;
    try {
      image = read_values(view.file);
    } catch (const ImageError& problem) {
      fail(std::string("view ") + problem.what());
    }
    if (image.type() != CV_8UC3)
      fail("view " + view.file.string() + " must have three channels of 8 bit (no transparency; background is black)");
    if (image.cols != *side_px_ || image.rows != *side_px_)
      fail("view " + view.file.string() + " is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) +
           " px, must be " + std::to_string(*side_px_) + " x " + std::to_string(*side_px_) + " (parameter reference)");
    view.side_px = *side_px_;
    for (int y = 0; y < image.rows; ++y)
      view.pixels.insert(view.pixels.end(), image.ptr(y), image.ptr(y) + 3 * image.cols);
    if (std::all_of(view.pixels.begin(), view.pixels.end(), [](uint8_t value) { return value == 0; }))
      fail("view " + view.file.string() + " is background, (0, 0, 0), everywhere");
    return view;
  }

  std::filesystem::path folder_, list_;
  std::optional<int> side_px_;
  TestViews test_views_;
  int line_ = 0;
  bool threshold_given_ = false;
  std::vector<DatabaseObject> objects_;
  std::vector<std::filesystem::path> backgrounds_;
};

}  // namespace

std::string DatabaseObject::label() const {
  std::string text = name;
  for (const Attribute& attribute : attributes) text += " " + attribute.name + "=" + attribute.value;
  return text;
}

std::vector<DatabaseObject> read_database(const std::filesystem::path& folder, int side_px, TestViews test_views,
                                          const std::string& list) {
  return Reader(folder, side_px, test_views, list).read();
}

std::vector<Photograph> read_backgrounds(const std::filesystem::path& folder, const std::string& list) {
  Reader reader(folder, std::nullopt, TestViews::skip, list);
  reader.read();
  std::vector<Photograph> photographs;
  for (const auto& file : reader.backgrounds()) photographs.push_back(read_photograph(file));
  return photographs;
}

Photograph read_photograph(const std::filesystem::path& file) {
  cv::Mat image;
  try {
    image = read_image(file, Channels::colour);
  } catch (const ImageError& problem) {
    throw DatabaseError(std::string("background ") + problem.what());
  }
  return {file, image.cols, image.rows, {image.datastart, image.dataend}};
}

std::vector<float> ClassIds::of(const std::vector<DatabaseObject>& database) {
  std::vector<float> ids;
  for (const DatabaseObject& entry : database) {
    const auto known = std::find(labels_.begin(), labels_.end(), entry.label());
    ids.push_back(static_cast<float>(known - labels_.begin()));
    if (known == labels_.end()) labels_.push_back(entry.label());
  }
  return ids;
}

std::vector<DatabaseObject> read_classes(const std::filesystem::path& folder, const std::string& list) {
  return Reader(folder, std::nullopt, TestViews::skip, list).read();
}

}  // namespace takt::object_detection
