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
