// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/sign_list.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "rt/file/input_file.hpp"

namespace takt::traffic_signs {

std::vector<SignModel> read_signs(const std::filesystem::path& folder) {
  const auto list = folder / "signs.txt";
  if (std::filesystem::exists(list)) require_readable<CascadeError>(list);
  std::ifstream in(list);
  if (!in) throw CascadeError(list.string() + ": cannot be read; a folder of signs holds this list of them");
  std::vector<SignModel> signs;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto fail = [&](const std::string& what) {
      throw CascadeError(list.string() + ":" + std::to_string(number) + ": " + what);
    };
    std::istringstream words(line.substr(0, line.find('#')));
    std::string key, file, colour, layout, rest;
    if (!(words >> key)) continue;
    SignModel sign;
    if (key != "sign") fail("unknown word `" + key + "`; valid is sign");
    if (!(words >> sign.name >> file >> colour >> sign.least_share >> sign.width_m >> sign.height_m) ||
        (words >> layout && words >> rest))
      fail("`sign` takes NAME CASCADE COLOUR SHARE WIDTH HEIGHT [LAYOUT]");
    const auto known = std::find(kColourNames.begin(), kColourNames.end(), colour);
    if (known == kColourNames.end()) fail("colour `" + colour + "` is unknown; valid are any, red, yellow, blue");
    sign.colour = static_cast<SignColour>(known - kColourNames.begin());
    if (!(sign.least_share >= 0 && sign.least_share <= 1)) fail("the share of the colour must lie in 0..1");
    if (!(sign.width_m > 0 && sign.height_m > 0)) fail("width and height must be above 0 m");
    if (std::any_of(signs.begin(), signs.end(), [&](const SignModel& other) { return other.name == sign.name; }))
      fail("sign `" + sign.name + "` is there already; names must differ");
    if (!layout.empty() && sign.colour == SignColour::any) fail("a layout needs a colour other than any");
    sign.cascade = read_cascade(folder / file);
    if (!layout.empty()) sign.layout = read_layout(folder / layout);
    signs.push_back(std::move(sign));
  }
  if (signs.empty()) throw CascadeError(list.string() + ": names no sign");
  return signs;
}

}  // namespace takt::traffic_signs
