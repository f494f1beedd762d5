// SPDX-License-Identifier: Apache-2.0
#include "rt/image_file/image_list.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace takt {
namespace {

constexpr std::array<std::string_view, 9> kImages{".png", ".jpg", ".jpeg", ".pgm", ".ppm",
                                                  ".pnm", ".bmp", ".tif",  ".tiff"};

bool digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool is_image(const std::filesystem::path& file) {
  std::string end = file.extension().string();
  std::transform(end.begin(), end.end(), end.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return std::find(kImages.begin(), kImages.end(), end) != kImages.end();
}

/// A run of digits from `at` on, which moves behind it, without leading zeros.
std::string_view take_number(std::string_view text, size_t& at) {
  while (at < text.size() && text[at] == '0') ++at;
  const size_t from = at;
  while (at < text.size() && digit(text[at])) ++at;
  return text.substr(from, at - from);
}

}  // namespace

bool in_numeric_order(const std::string& a, const std::string& b) {
  size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (digit(a[i]) && digit(b[k])) {
      const std::string_view x = take_number(a, i), y = take_number(b, k);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i, ++k;
    }
  }
  if (i == a.size() && k == b.size()) return a < b;  // 01 and 1: as words
  return i == a.size();
}

ImageList list_images(const std::filesystem::path& folder) {
  ImageList list;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    (is_image(entry.path()) ? list.files : list.others).push_back(entry.path());
  }
  const auto by_name = [](const auto& a, const auto& b) {
    return in_numeric_order(a.filename().string(), b.filename().string());
  };
  std::sort(list.files.begin(), list.files.end(), by_name);
  std::sort(list.others.begin(), list.others.end(), by_name);
  return list;
}

std::string left_out_text(const std::filesystem::path& folder, const ImageList& list) {
  if (list.others.empty()) return "";
  return folder.string() + ": " + std::to_string(list.others.size()) +
         " files that are no images are left out (the first: " + list.others.front().filename().string() + ")";
}

}  // namespace takt
