// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "graph/view/html_parts.hpp"
#include "graph/view/markup.hpp"

namespace takt::view {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

/// RFC 4648.
std::string base64(std::string_view bytes) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto byte = [&](size_t i) {
    return i < bytes.size() ? static_cast<uint32_t>(static_cast<uint8_t>(bytes[i])) : 0U;
  };
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const uint32_t three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    for (const uint32_t shift : {18U, 12U, 6U, 0U}) text += alphabet[three >> shift & 63U];
    for (size_t missing = i + 3; missing > bytes.size(); --missing) text[text.size() - (missing - bytes.size())] = '=';
  }
  return text;
}

std::vector<std::filesystem::path> png_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (it->path().extension() == ".png") files.push_back(it->path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string figure_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string name = escape(file.filename().string());
  if (!bytes.starts_with(kSignature))
    return fmt::format("<figure><figcaption>{}: is no PNG image that can be read</figcaption></figure>\n", name);
  return fmt::format(
      "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n", name,
      base64(bytes));
}

}  // namespace

std::string images_section(const std::filesystem::path& output) {
  std::string figures;
  for (const auto& file : png_files(output)) figures += figure_of(file);
  if (figures.empty()) return section("Pictures", not_recorded());
  return section("Pictures", "<div class=\"charts\">\n" + figures + "</div>\n");
}

}  // namespace takt::view
