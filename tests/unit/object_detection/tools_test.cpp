// SPDX-License-Identifier: Apache-2.0
// What `takt objects` does to a database.
#include <doctest/doctest.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "nodes/object_detection/cut_out.hpp"
#include "nodes/object_detection/object_list.hpp"
#include "nodes/object_detection/tuning.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt::object_detection;

namespace {

constexpr int kViewSide = 16;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// An image of 40 x 30 with a rectangle of 20 x 10 at (12, 8).
cv::Mat rectangle(int type, const cv::Scalar& background, const cv::Scalar& object) {
  cv::Mat image(30, 40, type, background);
  image(cv::Rect(12, 8, 20, 10)) = object;
  return image;
}

ReferenceView plain_view() { return {"", kViewSide, std::vector<uint8_t>(kViewSide * kViewSide * 3, 90), {}}; }

/// Maps of an image with three windows.
ErrorMaps maps(std::vector<float> colour, std::vector<float> orientation, std::vector<float> cooccurrence) {
  return {{}, {std::move(colour), std::move(orientation), std::move(cooccurrence)}};
}

}  // namespace

TEST_CASE("a view is learnt by transparency, from black and from before one colour, and fills its square") {
  const takt::test::TemporaryFolder folder;
  const auto learnt = [&](const cv::Mat& image) {
    cv::imwrite((folder.path / "in.png").string(), image);
    return learn_view(folder.path / "in.png", kViewSide);
  };
  const cv::Scalar colour(10, 20, 200);
  for (const cv::Mat& image : {rectangle(CV_8UC4, {70, 70, 70, 0}, {10, 20, 200, 255}),
                               rectangle(CV_8UC3, {0, 0, 0}, colour), rectangle(CV_8UC3, {120, 125, 130}, colour)}) {
    const ReferenceView view = learnt(image);
    REQUIRE(view.side_px == kViewSide);
    const auto pixel = [&](int x, int y) {
      return cv::Scalar(view.view().at(x, y, 0), view.view().at(x, y, 1), view.view().at(x, y, 2));
    };
    CHECK(pixel(0, 8) == colour);  // 20 x 10 become 16 x 8
    CHECK(pixel(15, 8) == colour);
    CHECK(pixel(8, 4) == colour);
    CHECK(pixel(8, 11) == colour);
    CHECK(pixel(8, 2) == cv::Scalar(0, 0, 0));
    CHECK(pixel(8, 13) == cv::Scalar(0, 0, 0));
  }
  // Already as the database wants it: not a pixel is changed.
  cv::Mat3b ready(kViewSide, kViewSide, cv::Vec3b(0, 0, 0));
  ready(5, 6) = {1, 2, 3};
  CHECK(learnt(ready).pixels == std::vector<uint8_t>(ready.datastart, ready.dataend));
  const auto refused = [&](const cv::Mat& image) { return refusal([&] { learnt(image); }); };
  CHECK(refused(cv::Mat(30, 40, CV_8UC3, cv::Scalar(0, 0, 0))).find("shows no object") != std::string::npos);
  CHECK(refused(cv::Mat(30, 40, CV_8UC4, cv::Scalar(1, 2, 3, 255))).find("has no background") != std::string::npos);
  CHECK(refused(cv::Mat(30, 40, CV_8UC1, cv::Scalar(9))).find("three channels") != std::string::npos);
  CHECK(refusal([&] { learn_view(folder.path / "absent.png", kViewSide); }).find("cannot be read") !=
        std::string::npos);
}

TEST_CASE("views and thresholds are put where they belong; comments and the rest of the list stay") {
  const takt::test::TemporaryFolder folder;
  const auto list = folder.path / "objects.txt";
  ObjectList made(folder.path);
  made.add("cup", plain_view(), false);
  made.add("bottle closed=true", plain_view(), false);
  made.add("bottle closed=true", plain_view(), true);
  made.save(kViewSide);
  CHECK(text_of(list) ==
        "object cup\nview cup/0.png\n\nobject bottle closed=true\nview bottle_closed=true/0.png\n"
        "test_view bottle_closed=true/1.png\n");
  folder.write("objects.txt", "# ours\n" + text_of(list));
  ObjectList changed(folder.path);
  changed.add("cup", plain_view(), false);
  changed.set_thresholds("cup", {0.5, std::nullopt, 0.25});
  changed.set_thresholds("cup", {0.5, std::nullopt, 0.375});
  changed.save(kViewSide);
  CHECK(text_of(list).find("# ours\nobject cup\nthreshold 0.5 auto 0.375\nview cup/0.png\nview cup/1.png\n\nobject") ==
        0);
  const auto read = read_database(folder.path, kViewSide, TestViews::read);
  REQUIRE(read.size() == 2);
  CHECK(read[0].views.size() == 2);
  CHECK(read[0].thresholds == Thresholds{0.5, std::nullopt, 0.375});
  CHECK(read[1].test_views.size() == 1);
  CHECK(refusal([&] { changed.set_thresholds("can", {}); }).find("has no object `can`") != std::string::npos);
}

TEST_CASE("a list that could not be read is never put in the place of one that can") {
  const takt::test::TemporaryFolder folder;
  ObjectList good(folder.path);
  good.add("cup", plain_view(), false);
  good.save(kViewSide);
  const std::string before = text_of(folder.path / "objects.txt");
  ObjectList bad(folder.path);
  bad.set_thresholds("cup", {1.5});
  CHECK(refusal([&] { bad.save(kViewSide); }).find("the threshold is `1.5`") != std::string::npos);
  ObjectList wrong_size(folder.path);
  wrong_size.add("can", plain_view(), false);
  CHECK(refusal([&] { wrong_size.save(kViewSide + 1); }).find("px, must be") != std::string::npos);
  CHECK(text_of(folder.path / "objects.txt") == before);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path))
    CHECK((entry.path().filename() == "objects.txt" || entry.path().filename() == "cup"));  // nothing else is left
}

TEST_CASE("thresholds: above what the object has where it is, the last one between with and without") {
  const std::vector<ErrorMaps> with{maps({0.3f, 0.9f, 0.9f}, {0.2f, 0.9f, 0.9f}, {0.25f, 0.8f, 0.9f}),
                                    maps({0.9f, 0.2f, 0.9f}, {0.9f, 0.4f, 0.9f}, {0.9f, 0.35f, 0.9f})};
  // The first passes the first two stages in a window; the second nowhere, though its last error is small.
  const std::vector<ErrorMaps> without{maps({0.3f, 0.9f, 0.9f}, {0.3f, 0.9f, 0.9f}, {0.65f, 0.1f, 0.9f}),
                                       maps({0.9f, 0.9f, 0.9f}, {0.2f, 0.2f, 0.2f}, {0.1f, 0.1f, 0.1f})};
  const Tuning tuning = tune(with, without, 0);
  CHECK(tuning.thresholds[0] == doctest::Approx(0.33));
  CHECK(tuning.thresholds[1] == doctest::Approx(0.44));
  CHECK(tuning.thresholds[2] == doctest::Approx(0.5));  // between 0.35 and 0.65
  CHECK(tuning.chosen.detected == 1);
  CHECK(tuning.chosen.false_positive == 0);
  REQUIRE(tuning.roc.size() == 4);  // steps at 0.25, 0.35, 0.65
  CHECK(tuning.roc[0].detected == 0);
  CHECK(tuning.roc[1].detected == 0.5);
  CHECK(tuning.roc[2].detected == 1);
  CHECK(tuning.roc[3].false_positive == 0.5);
  CHECK(tune(with, {}, 0.5).thresholds[1] == doctest::Approx(0.22));  // the worse half may be lost
  CHECK(refusal([] { tune({}, {}, 0); }).find("no image shows the object") != std::string::npos);
}
