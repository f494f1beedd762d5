// SPDX-License-Identifier: Apache-2.0
#include "nodes/picture/moment.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "nodes/semantic/reports.hpp"
#include "rt/msg/grid.hpp"

namespace takt::picture {
namespace {

using semantic::text_in;

constexpr int kHeight = 480;
const cv::Scalar kInk(40, 40, 40), kPaper(255, 255, 255), kTypes(150, 90, 20), kObjects(30, 30, 190),
    kValues(40, 120, 30);

void write(cv::Mat& image, const std::string& text, cv::Point at, const cv::Scalar& colour) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv::LINE_AA);
}

/// Where the picture of a map is on it: the smallest square around all that is worth a look.
struct Window {
  double left_m, bottom_m, side_m;
  int side_px;
  cv::Point at(double x_m, double y_m) const {
    const double scale = side_px / side_m;
    return {static_cast<int>(std::lround((x_m - left_m) * scale)),
            static_cast<int>(std::lround(side_px - (y_m - bottom_m) * scale))};
  }
};

Window around(const Moment& moment, int side_px) {
  double left = 1e9, right = -1e9, bottom = 1e9, top = -1e9;
  const auto take = [&](double x_m, double y_m) {
    left = std::min(left, x_m), right = std::max(right, x_m);
    bottom = std::min(bottom, y_m), top = std::max(top, y_m);
  };
  for (const KnownObject& object : moment.objects) take(object.x_m, object.y_m);
  if (moment.robot) take(moment.robot->x_m, moment.robot->y_m);
  const auto cells = moment.cells.view();
  for (int row = 0; row < cells.height; ++row)
    for (int column = 0; column < cells.width; ++column)
      if (cells.at(column, row) != Grid::unknown)
        take(moment.origin_x_m + column * moment.cell_m, moment.origin_y_m + row * moment.cell_m);
  if (left > right) return {-1, -1, 2, side_px};
  constexpr double kMargin_m = 0.5;
  const double side = std::max(right - left, top - bottom) + 2 * kMargin_m;
  return {(left + right - side) / 2, (bottom + top - side) / 2, side, side_px};
}

void draw_cells(const Moment& moment, const Window& window, cv::Mat& image) {
  const auto cells = moment.cells.view();
  if (!cells.data || moment.cell_m <= 0) return;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double metres = window.side_m / window.side_px;
      const int column = static_cast<int>(std::floor((window.left_m + x * metres - moment.origin_x_m) / moment.cell_m));
      const int row = static_cast<int>(
          std::floor((window.bottom_m + (window.side_px - y) * metres - moment.origin_y_m) / moment.cell_m));
      if (!cells.contains(column, row) || cells.at(column, row) == Grid::unknown) continue;
      const int grey = 255 - 255 * std::clamp<int>(cells.at(column, row), 0, 1000) / 1000;
      image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<uint8_t>(grey));
    }
}

/// A column of words with a frame each; the middle of the left and right side of each is where lines end.
class Column {
 public:
  Column(int x_px, int width_px, int height_px) : x_px_(x_px), width_px_(width_px), height_px_(height_px) {}

  /// Its number; the same word is there once.
  size_t add(const std::string& word) {
    const auto found = std::find(words_.begin(), words_.end(), word);
    if (found != words_.end()) return static_cast<size_t>(found - words_.begin());
    words_.push_back(word);
    return words_.size() - 1;
  }
  cv::Point left(size_t i) const { return {x_px_, y_of(i)}; }
  cv::Point right(size_t i) const { return {x_px_ + width_px_, y_of(i)}; }

  void draw(cv::Mat& image, const cv::Scalar& colour) const {
    for (size_t i = 0; i < words_.size(); ++i) {
      const cv::Rect frame(x_px_, y_of(i) - 12, width_px_, 24);
      cv::rectangle(image, frame, kPaper, cv::FILLED);
      cv::rectangle(image, frame, colour, 1, cv::LINE_AA);
      write(image, words_[i], {x_px_ + 6, y_of(i) + 5}, colour);
    }
  }

 private:
  int y_of(size_t i) const {
    return static_cast<int>((static_cast<double>(i) + 0.5) * height_px_ / static_cast<double>(words_.size()));
  }

  int x_px_, width_px_, height_px_;
  std::vector<std::string> words_;
};

}  // namespace

void Moment::reserve(size_t pixels, size_t most_boxes, size_t most_cells, size_t most_objects, size_t most_characters) {
  said.reserve(most_characters), plan.reserve(most_characters);
  objects.reserve(most_objects);
  attributes.reserve(8 * most_objects);
  left.reserve(pixels);
  boxes.reserve(most_boxes);
  cells.reserve(most_cells);
}

std::span<const ObjectAttribute> Moment::attributes_of(size_t i) const {
  const size_t first = i == 0 ? 0 : objects[i - 1].attributes_end;
  return std::span(attributes).subspan(first, objects[i].attributes_end - first);
}

cv::Mat draw_map(const Moment& moment, int side_px) {
  cv::Mat image(side_px, side_px, CV_8UC3, cv::Scalar::all(150));
  const Window window = around(moment, side_px);
  draw_cells(moment, window, image);
  if (moment.robot) {
    const PlanarPose& r = *moment.robot;
    const auto ahead = [&](double m) {
      return window.at(r.x_m + m * std::cos(r.theta_rad), r.y_m + m * std::sin(r.theta_rad));
    };
    cv::circle(image, window.at(r.x_m, r.y_m), 6, {200, 120, 0}, cv::FILLED, cv::LINE_AA);
    cv::arrowedLine(image, ahead(0), ahead(0.6), {200, 120, 0}, 2, cv::LINE_AA, 0, 0.3);
  }
  for (const KnownObject& object : moment.objects) {
    const cv::Point at = window.at(object.x_m, object.y_m);
    cv::circle(image, at, 4, kObjects, cv::FILLED, cv::LINE_AA);
    write(image, std::string(text_in(object.name.name)), at + cv::Point(7, 4), kObjects);
  }
  return image;
}

cv::Mat draw_network(const Moment& moment, int width_px, int height_px) {
  cv::Mat image(height_px, width_px, CV_8UC3, kPaper);
  const int box = width_px / 4;
  Column types(10, box, height_px), objects((width_px - box) / 2, box, height_px),
      values(width_px - box - 10, box, height_px);
  std::vector<std::pair<size_t, size_t>> is_a, has;
  for (size_t i = 0; i < moment.objects.size(); ++i) {
    const size_t object = objects.add(std::string(text_in(moment.objects[i].name.name)));
    is_a.emplace_back(types.add(std::string(text_in(moment.objects[i].name.type))), object);
    for (const ObjectAttribute& a : moment.attributes_of(i))
      has.emplace_back(object, values.add(std::string(text_in(a.name)) + " = " + std::string(text_in(a.value))));
  }
  for (const auto& [type, object] : is_a)
    cv::line(image, types.right(type), objects.left(object), kInk, 1, cv::LINE_AA);
  for (const auto& [object, value] : has)
    cv::line(image, objects.right(object), values.left(value), kInk, 1, cv::LINE_AA);
  types.draw(image, kTypes);
  objects.draw(image, kObjects);
  values.draw(image, kValues);
  return image;
}

cv::Mat draw_moment(const Moment& moment) {
  std::vector<cv::Mat> parts;
  if (!moment.left.empty()) {
    const auto left = moment.left.view();
    cv::Mat image(left.height, left.width, CV_8UC3);
    const Bgr out{image.data, image.cols, image.rows, 3};
    draw_image(left, out);
    draw_detections(moment.boxes, out);
    cv::resize(image, image, {kHeight * image.cols / image.rows, kHeight}, 0, 0, cv::INTER_AREA);
    parts.push_back(image);
  }
  parts.push_back(draw_map(moment, kHeight));
  parts.push_back(draw_network(moment, kHeight * 5 / 4, kHeight));
  cv::Mat all;
  cv::hconcat(parts, all);
  return all;
}

}  // namespace takt::picture
