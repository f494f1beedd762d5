// SPDX-License-Identifier: Apache-2.0
#include <tinyxml2.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "nodes/traffic_signs/cascade.hpp"
#include "rt/file/input_file.hpp"
#include "rt/file/output_file.hpp"

namespace takt::traffic_signs {
namespace {

using Element = tinyxml2::XMLElement;

constexpr int kMostStages = 200, kMostStumps = 10000, kMostFeatures = 100000;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file) {}

  Cascade read() {
    require_readable<CascadeError>(file_);
    tinyxml2::XMLDocument document;
    if (document.LoadFile(file_.string().c_str()) != tinyxml2::XML_SUCCESS) {
      fail(document.ErrorLineNum(), std::string("is no XML: ") + document.ErrorName());
    }
    const Element* storage = document.FirstChildElement("opencv_storage");
    if (storage == nullptr) fail(1, "has no <opencv_storage>; a cascade file of OpenCV 2.4 or later is one");
    const Element& root = child(*storage, "cascade");
    expect(root, "stageType", "BOOST");
    expect(root, "featureType", "HAAR");
    Cascade cascade;
    cascade.width = whole(child(root, "width"), 3, Cascade::kLargestWindow_px);
    cascade.height = whole(child(root, "height"), 3, Cascade::kLargestWindow_px);
    for_each(child(root, "features"), kMostFeatures,
             [&](const Element& e) { cascade.features.push_back(feature(e, cascade)); });
    for_each(child(root, "stages"), kMostStages,
             [&](const Element& e) { cascade.stages.push_back(stage(e, cascade)); });
    const Element& announced = child(root, "stageNum");
    if (whole(announced, 1, kMostStages) != static_cast<int>(cascade.stages.size()))
      fail(announced.GetLineNum(),
           "<stageNum> is " + text(announced) + " but <stages> holds " + std::to_string(cascade.stages.size()));
    return cascade;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw CascadeError(file_.string() + ":" + std::to_string(line) + ": " + what);
  }

  const Element& child(const Element& parent, const char* name) const {
    const Element* found = parent.FirstChildElement(name);
    if (found == nullptr) fail(parent.GetLineNum(), "<" + std::string(parent.Name()) + "> has no <" + name + ">");
    return *found;
  }

  static std::string text(const Element& element) { return element.GetText() != nullptr ? element.GetText() : ""; }

  void expect(const Element& parent, const char* name, const char* value) const {
    const Element& element = child(parent, name);
    if (text(element) != value)
      fail(element.GetLineNum(), "<" + std::string(name) + "> is " + text(element) + ", must be " + value);
  }

  template <class Use>
  void for_each(const Element& list, int most, Use use) const {
    int count = 0;
    for (const Element* e = list.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (++count > most)
        fail(e->GetLineNum(),
             "<" + std::string(list.Name()) + "> holds more than " + std::to_string(most) + " entries");
      use(*e);
    }
    if (count == 0) fail(list.GetLineNum(), "<" + std::string(list.Name()) + "> is empty");
  }

  /// Exactly `count` finite numbers, and nothing else, if count is not 0.
  std::vector<double> numbers(const Element& element, size_t count) const {
    std::vector<double> values;
    const std::string all = text(element);
    const char *at = all.data(), *end = at + all.size();
    const auto skip_space = [&] { at += std::strspn(at, " \t\r\n"); };
    for (skip_space(); at != end; skip_space()) {
      double value = 0;
      const auto [rest, error] = std::from_chars(at, end, value);
      if (error != std::errc() || !std::isfinite(value))
        fail(element.GetLineNum(), "<" + std::string(element.Name()) + "> holds `" +
                                       std::string(at, std::strcspn(at, " \t\r\n")) + "`, must be a number");
      values.push_back(value);
      at = rest;
    }
    if (values.size() != count)
      fail(element.GetLineNum(), "<" + std::string(element.Name()) + "> holds " + std::to_string(values.size()) +
                                     " numbers, must be " + std::to_string(count));
    return values;
  }

  int whole(const Element& element, double value, int low, int high) const {
    if (value != std::floor(value) || value < low || value > high)
      fail(element.GetLineNum(), "<" + std::string(element.Name()) + "> holds " + std::to_string(value) +
                                     ", must be a whole number of " + std::to_string(low) + ".." +
                                     std::to_string(high));
    return static_cast<int>(value);
  }
  int whole(const Element& element, int low, int high) const {
    return whole(element, numbers(element, 1)[0], low, high);
  }

  HaarFeature feature(const Element& element, const Cascade& cascade) const {
    if (const Element* tilted = element.FirstChildElement("tilted"); tilted != nullptr && whole(*tilted, 0, 1) == 1)
      fail(tilted->GetLineNum(), "a tilted feature; only upright ones can be used (train with BASIC or CORE)");
    HaarFeature feature;
    size_t count = 0;
    for_each(child(element, "rects"), static_cast<int>(feature.size()), [&](const Element& e) {
      const std::vector<double> v = numbers(e, 5);
      WeightedRect& r = feature[count++];
      r.x = whole(e, v[0], 0, cascade.width - 1);
      r.y = whole(e, v[1], 0, cascade.height - 1);
      r.width = whole(e, v[2], 1, cascade.width - r.x);
      r.height = whole(e, v[3], 1, cascade.height - r.y);
      r.weight = static_cast<float>(v[4]);
    });
    return feature;
  }

  Stage stage(const Element& element, const Cascade& cascade) const {
    Stage stage;
    stage.threshold = static_cast<float>(numbers(child(element, "stageThreshold"), 1)[0]);
    for_each(child(element, "weakClassifiers"), kMostStumps, [&](const Element& e) {
      const Element& nodes = child(e, "internalNodes");
      const std::vector<double> node = numbers(nodes, 4), leaves = numbers(child(e, "leafValues"), 2);
      if (node[0] != 0 || node[1] != -1)
        fail(nodes.GetLineNum(), "<internalNodes> begins with other than 0 -1: only stumps can be used");
      stage.stumps.push_back({whole(nodes, node[2], 0, static_cast<int>(cascade.features.size()) - 1),
                              static_cast<float>(node[3]), static_cast<float>(leaves[0]),
                              static_cast<float>(leaves[1])});
    });
    return stage;
  }

  std::filesystem::path file_;
};

/// As many digits as a float needs to come back the same.
std::string digits(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  return text;
}

}  // namespace

Cascade read_cascade(const std::filesystem::path& file) { return Reader(file).read(); }

void write_cascade(const Cascade& cascade, const std::filesystem::path& file, const std::string& comment) {
  size_t most = 0;
  for (const Stage& stage : cascade.stages) most = std::max(most, stage.stumps.size());
  std::ostringstream out;
  out << "<?xml version=\"1.0\"?>\n<!-- " << comment << " -->\n<opencv_storage>\n"
      << "<cascade "
         "type_id=\"opencv-cascade-classifier\">\n<stageType>BOOST</stageType>\n<featureType>HAAR</featureType>\n"
      << "<height>" << cascade.height << "</height>\n<width>" << cascade.width << "</width>\n"
      << "<stageParams><boostType>GAB</boostType><maxDepth>1</maxDepth><maxWeakCount>" << most
      << "</maxWeakCount></stageParams>\n<featureParams><maxCatCount>0</maxCatCount></featureParams>\n<stageNum>"
      << cascade.stages.size() << "</stageNum>\n<stages>\n";
  for (const Stage& stage : cascade.stages) {
    out << "<_><maxWeakCount>" << stage.stumps.size() << "</maxWeakCount><stageThreshold>" << digits(stage.threshold)
        << "</stageThreshold><weakClassifiers>\n";
    for (const Stump& s : stage.stumps)
      out << "<_><internalNodes>0 -1 " << s.feature << ' ' << digits(s.threshold) << "</internalNodes><leafValues>"
          << digits(s.below) << ' ' << digits(s.otherwise) << "</leafValues></_>\n";
    out << "</weakClassifiers></_>\n";
  }
  out << "</stages>\n<features>\n";
  for (const HaarFeature& feature : cascade.features) {
    out << "<_><rects>";
    for (const WeightedRect& r : feature)
      if (r.weight != 0)
        out << "<_>" << r.x << ' ' << r.y << ' ' << r.width << ' ' << r.height << ' ' << digits(r.weight) << "</_>";
    out << "</rects><tilted>0</tilted></_>\n";
  }
  out << "</features></cascade>\n</opencv_storage>\n";
  require_written(write_file(file, out.str()));
}

}  // namespace takt::traffic_signs
