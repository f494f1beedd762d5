// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/colour_layout.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "nodes/traffic_signs/cascade.hpp"
#include "nodes/traffic_signs/layout_learning.hpp"
#include "nodes/traffic_signs/sign_list.hpp"
#include "rt/file/output_file.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/traffic_signs/signs.hpp"

using namespace takt;
using namespace takt::traffic_signs;
using test::kSigns;

namespace {

ImageView<const uint8_t> view(const cv::Mat3b& image) { return {image.ptr(), image.cols, image.rows, 3}; }

/// Left half red, right half white.
cv::Mat3b half_red() {
  cv::Mat3b image(20, 40, cv::Vec3b(230, 230, 230));
  image(cv::Rect(0, 0, 20, 20)).setTo(cv::Vec3b(0, 0, 190));
  return image;
}

}  // namespace

TEST_CASE("traffic_signs: a layout is read as it was written; mistakes are named with their line") {
  const test::TemporaryFolder folder;
  const ColourLayout layout = read_layout(folder.write("a.layout", "# a sign\nxx.  # top\n\nox.\n"));
  CHECK(layout.columns == 3);
  CHECK(layout.rows() == 2);
  using Cell = ColourLayout::Cell;
  const std::vector<Cell> wanted{Cell::coloured, Cell::coloured, Cell::either,
                                 Cell::plain,    Cell::coloured, Cell::either};
  CHECK(layout.cells == wanted);
  write_layout(layout, folder.path / "b.layout", "for a test");
  CHECK(read_layout(folder.path / "b.layout").cells == wanted);
  const auto error = [&](const std::string& text) -> std::string {
    try {
      read_layout(folder.write("c.layout", text));
    } catch (const CascadeError& error) {
      return error.what();
    }
    return "";
  };
  const auto says = [](const std::string& error, const char* words) { return error.find(words) != std::string::npos; };
  CHECK(says(error("xx\nx\n"), "c.layout:2: the row has 1 cells, the first one 2"));
  CHECK(says(error("x-\n"), "c.layout:1: `-` is unknown; valid are x"));
  CHECK(says(error("# nothing\n"), "at least one row"));
  CHECK(says(error(std::string(65, 'x')), "at most 64"));
  CHECK_THROWS_AS(read_layout(folder.path / "none"), CascadeError);
  CHECK_THROWS_AS(write_layout(layout, folder.path / "no/such", ""), OutputError);
}

TEST_CASE("traffic_signs: a picture fits a layout as far as the colour is where it should be and nowhere else") {
  using Cell = ColourLayout::Cell;
  const cv::Mat3b image = half_red();
  const Box whole{0, 0, 40, 20};
  const auto halves = [](Cell left, Cell right) {  // ten cells each
    ColourLayout layout{2, {}};
    for (int row = 0; row < 10; ++row) layout.cells.insert(layout.cells.end(), {left, right});
    return layout;
  };
  const ColourLayout right_way = halves(Cell::coloured, Cell::plain), wrong_way = halves(Cell::plain, Cell::coloured),
                     everywhere = halves(Cell::coloured, Cell::coloured),
                     does_not_matter = halves(Cell::coloured, Cell::either);
  CHECK(layout_fit(right_way, SignColour::red, view(image), whole) == 1);
  CHECK(layout_fit(wrong_way, SignColour::red, view(image), whole) == -1);
  CHECK(layout_fit(everywhere, SignColour::red, view(image), whole) == 0.5);
  CHECK(layout_fit(does_not_matter, SignColour::red, view(image), whole) == 1);
  CHECK(layout_fit(right_way, SignColour::blue, view(image), whole) == 0);
  CHECK(layout_fit({}, SignColour::red, view(image), whole) == 1);
  CHECK(layout_fit(right_way, SignColour::red, view(image), {0, 0, 20, 20}) == 0);  // solid red
  CHECK(layout_fit({2, {Cell::coloured, Cell::plain}}, SignColour::red, view(image), {0, 0, 20, 20}) ==
        doctest::Approx(0.9));                                                          // one plain cell says little
  CHECK(layout_fit(right_way, SignColour::red, view(image), {-30, -9, 100, 40}) == 1);  // beyond the image
}

TEST_CASE("traffic_signs: the strength of a colour is the same in light and shade, less where it has faded") {
  CHECK(strength(SignColour::red, {20, 20, 200}) == doctest::Approx(0.9));
  CHECK(strength(SignColour::red, {4, 4, 40}) == doctest::Approx(0.9));
  CHECK(strength(SignColour::red, {100, 90, 200}) == doctest::Approx(0.5));
  CHECK(strength(SignColour::red, {200, 20, 100}) == 0);
  CHECK(strength(SignColour::yellow, {40, 160, 200}) == doctest::Approx(0.6));
  CHECK(strength(SignColour::blue, {200, 100, 50}) == doctest::Approx(0.5));
  CHECK(strength(SignColour::blue, {0, 0, 0}) == 0);
  CHECK(strength(SignColour::any, {0, 0, 200}) == 0);
}

TEST_CASE("traffic_signs: a learnt layout fits other drawings of its sign, and no patch of the colour") {
  for (const SignShape& shape : kSignShapes) {
    if (shape.colour == SignColour::any) {
      CHECK(learn_layout(shape.sign, 1).columns == 0);
      continue;
    }
    const ColourLayout layout = learn_layout(shape.sign, 1);
    cv::RNG random(77);
    double sum = 0;
    constexpr int kDrawings = 40;
    for (int i = 0; i < kDrawings; ++i) {
      cv::Mat3f image(60, 60, cv::Vec3f::all(110));
      const cv::Rect2f drawn = draw_sign(image, shape.sign, {5, 5, 50, 50}, random);
      cv::Mat3b bytes;
      image.convertTo(bytes, CV_8U);
      const Box box{cvRound(drawn.x), cvRound(drawn.y), cvRound(drawn.width), cvRound(drawn.height)};
      sum += layout_fit(layout, shape.colour, view(bytes), box);
    }
    CHECK_MESSAGE(sum / kDrawings > 0.2, shape.name);
    const cv::Vec3b patch = shape.colour == SignColour::red      ? cv::Vec3b(0, 0, 190)
                            : shape.colour == SignColour::yellow ? cv::Vec3b(0, 190, 190)
                                                                 : cv::Vec3b(170, 0, 0);
    const auto plain = std::count(layout.cells.begin(), layout.cells.end(), ColourLayout::Cell::plain);
    CHECK(layout_fit(layout, shape.colour, view(cv::Mat3b(60, 60, patch)), {0, 0, 60, 60}) ==
          doctest::Approx(std::max(0.0, 1 - 0.1 * static_cast<double>(plain))));
    if (shape.sign == SignClass::yield || shape.sign == SignClass::priority || shape.sign == SignClass::one_way)
      CHECK_MESSAGE(plain >= 10, shape.name);
  }
}

TEST_CASE(
    "traffic_signs: every coloured sign that is shipped has a layout, and an arrow to the left is none to the right") {
  const auto signs = read_signs(kSigns);
  for (const SignModel& sign : signs) CHECK((sign.layout.columns > 0) == (sign.colour != SignColour::any));
  cv::RNG random(5);
  double right = 0, left = 0;
  for (int i = 0; i < 20; ++i) {
    cv::Mat3f image(60, 60, cv::Vec3f::all(110));
    draw_sign(image, SignClass::arrow_right, {5, 5, 50, 50}, random);
    cv::Mat3b bytes;
    image.convertTo(bytes, CV_8U);
    const auto fit = [&](SignClass sign) {
      const SignModel& model = signs[static_cast<size_t>(sign)];
      return layout_fit(model.layout, model.colour, view(bytes), {5, 5, 50, 50});
    };
    right += fit(SignClass::arrow_right);
    left += fit(SignClass::arrow_left);
  }
  CHECK(right > left);
}
