// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace takt {

/// Whether `a` comes before `b` where runs of digits are numbers: frame2.png before frame10.png. Any thread.
bool in_numeric_order(const std::string& a, const std::string& b);

/// The pictures of a folder and what else lies there.
struct ImageList {
  std::vector<std::filesystem::path> files;   ///< in_numeric_order() of their names
  std::vector<std::filesystem::path> others;  ///< files that are no pictures by their names: left out
};

/// PNG, JPEG, PGM, PPM, PNM, BMP and TIFF, by the ends of their names in any case. Folders inside are no files.
///
///     const ImageList left = list_images("drive/image_l");
///
/// Throws std::filesystem::filesystem_error, which names the folder. Any thread.
ImageList list_images(const std::filesystem::path& folder);

/// "FOLDER: 3 files that are no images are left out (the first: notes.txt)"; empty if there are none.
std::string left_out_text(const std::filesystem::path& folder, const ImageList& list);

}  // namespace takt
