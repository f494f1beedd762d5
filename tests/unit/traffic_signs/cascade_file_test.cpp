// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <fstream>
#include <opencv2/objdetect.hpp>
#include <sstream>

#include "nodes/traffic_signs/cascade.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/traffic_signs/random_cascade.hpp"

using namespace takt;
using namespace takt::traffic_signs;

namespace {

/// A cascade file with one mistake in it; the error that reading it gives.
class Mistake {
 public:
  Mistake() {
    write_cascade(test::random_cascade(1, 20, 16, 2), file_, "for a test");
    std::stringstream text;
    text << std::ifstream(file_).rdbuf();
    right_ = text.str();
  }
  std::string error(const std::string& from, const std::string& to) const {
    std::string text = right_;
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
    std::ofstream(file_) << text;
    try {
      read_cascade(file_);
    } catch (const CascadeError& error) {
      return std::string(error.what()).substr(file_.string().size());
    }
    return "";
  }

 private:
  test::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path / "cascade.xml";
  std::string right_;
};

}  // namespace

TEST_CASE("traffic_signs: a cascade comes back from its file as it was, and OpenCV reads it") {
  const test::TemporaryFolder folder;
  const auto file = folder.path / "cascade.xml";
  const Cascade written = test::random_cascade(7, 24, 18, 5);
  write_cascade(written, file, "for a test");
  const Cascade read = read_cascade(file);
  CHECK(read.width == 24);
  CHECK(read.height == 18);
  REQUIRE(read.features.size() == written.features.size());
  for (size_t i = 0; i < read.features.size(); ++i)
    for (size_t k = 0; k < 3; ++k) {
      const WeightedRect &a = read.features[i][k], &b = written.features[i][k];
      CHECK((a.x == b.x && a.y == b.y && a.width == b.width && a.height == b.height && a.weight == b.weight));
    }
  REQUIRE(read.stages.size() == 5);
  for (size_t s = 0; s < 5; ++s) {
    CHECK(read.stages[s].threshold == written.stages[s].threshold);
    REQUIRE(read.stages[s].stumps.size() == written.stages[s].stumps.size());
    for (size_t i = 0; i < read.stages[s].stumps.size(); ++i) {
      const Stump &a = read.stages[s].stumps[i], &b = written.stages[s].stumps[i];
      CHECK((a.feature == b.feature && a.threshold == b.threshold && a.below == b.below && a.otherwise == b.otherwise));
    }
  }
  cv::CascadeClassifier theirs;
  REQUIRE(theirs.load(file.string()));
  CHECK(theirs.getOriginalWindowSize() == cv::Size(24, 18));
}

TEST_CASE("traffic_signs: a mistake in a cascade file is named with its line and what is valid") {
  const Mistake mistake;
  const auto says = [](const std::string& error, const char* words) { return error.find(words) != std::string::npos; };
  CHECK(mistake.error("<width>20", "<width>20").empty());
  CHECK(mistake.error("<width>20", "<width>2") == ":8: <width> holds 2.000000, must be a whole number of 3..128");
  CHECK(says(mistake.error("BOOST", "TREE"), ":5: <stageType> is TREE, must be BOOST"));
  CHECK(says(mistake.error("HAAR", "LBP"), ":6: <featureType> is LBP, must be HAAR"));
  CHECK(says(mistake.error("0 -1 ", "1 2 "), "only stumps"));
  CHECK(says(mistake.error("<stageNum>2", "<stageNum>3"), "<stageNum> is 3 but <stages> holds 2"));
  CHECK(says(mistake.error("<tilted>0", "<tilted>1"), "a tilted feature"));
  CHECK(says(mistake.error("<leafValues>", "<leafValues>x "), "holds `x`, must be a number"));
  CHECK(says(mistake.error("<leafValues>", "<leafValues>1 "), "holds 3 numbers, must be 2"));
  CHECK(says(mistake.error("<internalNodes>0 -1 ", "<internalNodes>0 -1 40"), "must be a whole number of 0..39"));
  CHECK(says(mistake.error("</features>", ""), "is no XML"));
  CHECK(says(mistake.error("<features>", "<feature>") + mistake.error("opencv_storage", "storage"), "is no XML"));
  CHECK_THROWS_WITH_AS(read_cascade("/nonexistent.xml"), doctest::Contains("/nonexistent.xml: cannot be read"),
                       CascadeError);
}
