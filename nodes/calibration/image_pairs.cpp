// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/image_pairs.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "rt/image_file/image_file.hpp"

namespace takt::calibration {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument(what); }

/// A file name with one `*`.
class Pattern {
 public:
  explicit Pattern(const std::string& text) : text_(text), star_(text.find('*')) {
    if (star_ == std::string::npos || text.find('*', star_ + 1) != std::string::npos)
      refuse(fmt::format("pattern \"{}\" must be a file name with one *, for instance left*.jpg", text));
  }
  /// What a name has in place of the star; nothing if it does not match.
  std::optional<std::string> match(std::string_view name) const {
    const std::string_view text = text_, before = text.substr(0, star_), after = text.substr(star_ + 1);
    if (name.size() < before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
      return std::nullopt;
    return std::string(name.substr(before.size(), name.size() - before.size() - after.size()));
  }
  std::string fill(const std::string& part) const { return text_.substr(0, star_) + part + text_.substr(star_ + 1); }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  size_t star_;
};

using Files = std::map<std::string, fs::path>;

Files matching(const fs::path& folder, const Pattern& pattern) {
  Files files;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed))
    if (const auto part = pattern.match(at->path().filename().string())) files[*part] = at->path();
  if (failed) refuse(fmt::format("{}: {}", folder.string(), failed.message()));
  if (files.empty()) refuse(fmt::format("{}: no file is named like {}", folder.string(), pattern.text()));
  return files;
}

void check_partners(const Files& files, const Files& others, const Pattern& pattern) {
  for (const auto& [part, file] : files)
    if (!others.contains(part))
      refuse(
          fmt::format("{}: its partner {} is missing; each view needs both images", file.string(), pattern.fill(part)));
}

}  // namespace

std::vector<ImagePair> find_pairs(const fs::path& folder, const std::string& left_pattern,
                                  const std::string& right_pattern) {
  const Pattern left(left_pattern), right(right_pattern);
  const Files left_files = matching(folder, left), right_files = matching(folder, right);
  check_partners(left_files, right_files, right);
  check_partners(right_files, left_files, left);
  std::vector<ImagePair> pairs;
  for (const auto& [part, file] : left_files) pairs.push_back({part, file, right_files.at(part)});
  return pairs;
}

std::vector<GreyPair> read_pairs(const std::vector<ImagePair>& files) {
  std::vector<GreyPair> pairs;
  cv::Size size;
  const auto read = [&](const fs::path& file) {
    cv::Mat image;
    try {
      image = read_image(file, Channels::grey);
    } catch (const ImageError& problem) {
      refuse(problem.what());
    }
    if (size.empty()) size = image.size();
    if (image.size() != size)
      refuse(fmt::format("{}: {} x {} px, but {} has {} x {}; all images must be of one size", file.string(),
                         image.cols, image.rows, files.front().left.string(), size.width, size.height));
    return image;
  };
  for (const ImagePair& file : files) {
    cv::Mat left = read(file.left);
    pairs.push_back({std::move(left), read(file.right)});
  }
  return pairs;
}

}  // namespace takt::calibration
