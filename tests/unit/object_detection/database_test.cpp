// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/database.hpp"

#include <doctest/doctest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt::object_detection;

namespace {

const std::filesystem::path kShipped = takt::test::graph_folder() / "objects";

struct Folder : takt::test::TemporaryFolder {
  Folder() { image("good.png", cv::Mat(8, 8, CV_8UC3, cv::Scalar(10, 20, 200))); }
  void image(const std::string& name, const cv::Mat& pixels) const { cv::imwrite((path / name).string(), pixels); }
  void list(const std::string& text) const { write("objects.txt", text); }
  std::string error(const std::string& text) const {
    list(text);
    try {
      read_database(path, 8, TestViews::read);
    } catch (const DatabaseError& problem) {
      return problem.what();
    }
    return "no error";
  }
};

void check_says(const std::string& text, const std::string& part) {
  INFO(text);
  CHECK(text.find(part) != std::string::npos);
}

}  // namespace

TEST_CASE("objects in order, with their views and thresholds") {
  const Folder folder;
  folder.list(
      "# two objects\nobject cup\nthreshold 0.5\nview good.png\nview good.png 0.25 auto 0.7 # stricter\n\n"
      "object bottle\nthreshold auto 0.4\nview good.png\ntest_view good.png\n");
  const auto objects = read_database(folder.path, 8, TestViews::read);
  REQUIRE(objects.size() == 2);
  CHECK(objects[0].name == "cup");
  CHECK(objects[0].thresholds == Thresholds{0.5});
  REQUIRE(objects[0].views.size() == 2);
  CHECK(objects[0].views[0].thresholds == Thresholds{});
  CHECK(objects[0].views[1].thresholds == Thresholds{0.25, std::nullopt, 0.7});
  CHECK(objects[0].views[0].view().at(7, 7, 2) == 200);
  CHECK(objects[1].thresholds == Thresholds{std::nullopt, 0.4});
  CHECK(objects[1].test_views.size() == 1);
  CHECK(read_database(folder.path, 8, TestViews::skip)[1].test_views.empty());
}

TEST_CASE("an object has an entry for each look, told apart by attribute values") {
  const Folder folder;
  folder.list(
      "object bottle size=large closed=true\nview good.png\nobject bottle closed=false size=large\nview good.png\n");
  const auto entries = read_database(folder.path, 8, TestViews::skip);
  REQUIRE(entries.size() == 2);
  CHECK(entries[0].attributes == std::vector<Attribute>{{"closed", "true"}, {"size", "large"}});
  CHECK(entries[0].label() == "bottle closed=true size=large");
  CHECK(entries[1].label() == "bottle closed=false size=large");
  CHECK(read_database(kShipped, 48, TestViews::skip)[0].label() == "red_box");
}

TEST_CASE("classes are the entries with their attributes, whether their images are there or not") {
  const Folder folder;
  folder.write("objects.txt",
               "object cup level=full\nview none.png\nobject ball\nview none.png 0.5\ntest_view none.png\n");
  const auto classes = read_classes(folder.path);
  REQUIRE(classes.size() == 2);
  CHECK(classes[0].label() == "cup level=full");
  CHECK(classes[1].name == "ball");
  CHECK_THROWS_AS(read_database(folder.path, 8, TestViews::skip), DatabaseError);
}

TEST_CASE("mistakes name file and line and what is valid") {
  const Folder folder;
  check_says(folder.error("object cup\nviews good.png\n"),
             "objects.txt:2: unknown word `views`; valid are object, threshold");
  check_says(folder.error("view good.png\n"), "objects.txt:1: `view` stands before");
  check_says(folder.error("object cup\n\nview absent.png\n"), "objects.txt:3: view ");
  check_says(folder.error("object cup\nview absent.png\n"), "absent.png: cannot be read");
  check_says(folder.error("object cup\nview objects.txt\n"), "is no image");
  check_says(folder.error("object cup\nobject can\nview good.png\n"), "objects.txt:2: object `cup` has no view");
  check_says(folder.error("object cup\nview good.png\nobject can\n"), "objects.txt:3: object `can` has no view");
  check_says(folder.error("object cup\nview good.png\nobject cup\n"), "objects.txt:3: object `cup` is there already");
  check_says(folder.error("object cup\nthreshold 1.5\n"), "objects.txt:2: the threshold is `1.5`, must be");
  check_says(folder.error("object cup\nthreshold 0\n"), "must be a number above 0");
  check_says(folder.error("object cup\nthreshold nan\n"), "must be a number above 0");
  check_says(folder.error("object cup\nthreshold 0.4x\n"), "`0.4x`");
  check_says(folder.error("object cup\nthreshold auto\nthreshold 0.4\n"),
             "objects.txt:3: object `cup` has a threshold already");
  check_says(folder.error("object\n"), "objects.txt:1: `object` takes a name and its attributes");
  check_says(folder.error("object cup red\n"), "objects.txt:1: `red` is no attribute; write ATTRIBUTE=VALUE");
  check_says(folder.error("object cup full=\n"), "`full=` is no attribute");
  check_says(folder.error("object cup full=yes full=no\n"), "attribute `full` is given twice");
  check_says(folder.error("object cup full=yes\nview good.png\nobject cup full=yes\n"),
             "objects.txt:3: object `cup full=yes` is there already");
  check_says(folder.error("object cup full=yes\nview good.png\nobject cup empty=no\n"),
             "object `cup empty=no` has other attributes than `cup full=yes`; only their values may differ");
  check_says(folder.error("object cup\nview good.png 0.4 0.5 0.6 0.7\n"), "a file and at most three thresholds");
  check_says(folder.error("object cup\nthreshold\n"), "`threshold` takes one to four thresholds");
  check_says(folder.error("object cup\nthreshold auto 0.3 2\n"), "objects.txt:2: the threshold is `2`, must be");
  check_says(folder.error("# nothing\n"), "names no object");
  folder.image("large.png", cv::Mat(9, 8, CV_8UC3, cv::Scalar(1, 2, 3)));
  check_says(folder.error("object cup\nview large.png\n"), "is 8 x 9 px, must be 8 x 8 (parameter reference)");
  folder.image("grey.png", cv::Mat(8, 8, CV_8UC1, cv::Scalar(9)));
  check_says(folder.error("object cup\nview grey.png\n"), "three channels of 8 bit");
  folder.image("black.png", cv::Mat(8, 8, CV_8UC3, cv::Scalar(0, 0, 0)));
  check_says(folder.error("object cup\nview black.png\n"), "background, (0, 0, 0), everywhere");
  std::filesystem::remove(folder.path / "objects.txt");
  try {
    read_database(folder.path, 8, TestViews::skip);
    FAIL("an absent list must be refused");
  } catch (const DatabaseError& problem) {
    check_says(problem.what(), "objects.txt: cannot be read");
  }
}
