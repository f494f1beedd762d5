// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/stereo_parameters.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <stdexcept>

#include "graph/cli/set_option.hpp"

namespace takt::command {
namespace {

using stereo::MatcherParameters;

int whole(const std::string& text, const std::string& value, int low, int high) {
  const double v = set_number(text, value, low, high);
  if (v != static_cast<int>(v)) throw std::invalid_argument(fmt::format("--set {}: must be a whole number", text));
  return static_cast<int>(v);
}

template <size_t N>
int choice(const std::string& text, const std::string& value, const std::array<const char*, N>& names) {
  const auto found = std::find(names.begin(), names.end(), value);
  if (found == names.end())
    throw std::invalid_argument(fmt::format("--set {}: valid are {}", text, fmt::join(names, " | ")));
  return static_cast<int>(found - names.begin());
}

constexpr std::array kCosts{"gradient", "ssd", "sad", "census", "rss", "mixed"};
constexpr std::array kAggregations{"square", "adaptive_window", "boundary", "adaptive_weight"};
constexpr std::array kCombinations{"min", "max", "mean"};
constexpr std::array kSelections{"winner", "scanline", "semi_global"};
constexpr std::array kSwitch{"false", "true"};

using Setter = std::function<void(const std::string& text, const std::string& value, MatcherParameters& p)>;

const std::map<std::string, Setter>& setters() {
  const auto integer = [](int MatcherParameters::*member, int low, int high) {
    return Setter(
        [=](const std::string& t, const std::string& v, MatcherParameters& p) { p.*member = whole(t, v, low, high); });
  };
  const auto real = [](double MatcherParameters::*member, double low, double high) {
    return Setter([=](const std::string& t, const std::string& v, MatcherParameters& p) {
      p.*member = set_number(t, v, low, high);
    });
  };
  const auto yes_no = [](bool MatcherParameters::*member) {
    return Setter([=](const std::string& t, const std::string& v, MatcherParameters& p) {
      p.*member = choice(t, v, kSwitch) == 1;
    });
  };
  const auto share = [](int MatcherParameters::*member) {  // 0..1 at the node, 0..255 in the library
    return Setter([=](const std::string& t, const std::string& v, MatcherParameters& p) {
      p.*member = static_cast<int>(255 * set_number(t, v, 0, 1) + 0.5);
    });
  };
  using M = MatcherParameters;
  static const std::map<std::string, Setter> all{
      {"disparities", integer(&M::disparities, 1, 512)},
      {"cost", [](auto& t, auto& v, M& p) { p.cost = static_cast<stereo::CostKind>(choice(t, v, kCosts)); }},
      {"intensity_weight", real(&M::intensity_weight, 0, 1)},
      {"c_max", integer(&M::c_max, 0, 255)},
      {"aggregation",
       [](auto& t, auto& v, M& p) { p.aggregation = static_cast<stereo::Aggregation>(choice(t, v, kAggregations)); }},
      {"combination",
       [](auto& t, auto& v, M& p) { p.combination = static_cast<stereo::Combination>(choice(t, v, kCombinations)); }},
      {"n_square", integer(&M::n_square, 1, 31)},
      {"n_min", integer(&M::n_min, 1, 31)},
      {"edge_threshold", real(&M::edge_threshold, 0, 361)},
      {"gamma_distance", real(&M::gamma_distance, 0.1, 100)},
      {"gamma_colour", real(&M::gamma_colour, 0.1, 442)},
      {"selection",
       [](auto& t, auto& v, M& p) { p.selection = static_cast<stereo::Selection>(choice(t, v, kSelections)); }},
      {"p1", integer(&M::p1, 0, 255)},
      {"p2", integer(&M::p2, 0, 255)},
      {"median", yes_no(&M::median)},
      {"subpixel", yes_no(&M::subpixel)},
      {"min_confidence", share(&M::min_confidence)},
      {"uniqueness", share(&M::uniqueness)},
      {"left_right_check", yes_no(&M::left_right_check)}};
  return all;
}

}  // namespace

void set_stereo_parameters(const std::vector<std::string>& texts, MatcherParameters& p) {
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    const auto setter = setters().find(text.substr(0, equals));
    if (setter == setters().end()) {
      std::vector<std::string> names;
      for (const auto& [name, unused] : setters()) names.push_back(name);
      throw std::invalid_argument(fmt::format("--set {}: valid parameters are {}", text, fmt::join(names, ", ")));
    }
    setter->second(text, equals == std::string::npos ? "" : text.substr(equals + 1), p);
  }
}

std::vector<StereoVariant> stereo_variants(int disparities) {
  using namespace stereo;
  const MatcherParameters base;
  const auto with = [&](auto change) {
    MatcherParameters p = base;
    p.disparities = disparities;
    change(p);
    return p;
  };
  const auto quality = [&](auto change) {
    MatcherParameters p = MatcherParameters::quality();
    p.disparities = disparities;
    change(p);
    return p;
  };
  return {
      {"gradient, window 15 (default)", with([](auto&) {})},
      {"thesis: ssd, c_max 50", with([](auto& p) { p.cost = CostKind::ssd; })},
      {"sad, c_max 50", with([](auto& p) { p.cost = CostKind::sad; })},
      {"rss, c_max 50", with([](auto& p) { p.cost = CostKind::rss; })},
      {"mixed, w 0.5", with([](auto& p) { p.cost = CostKind::mixed, p.intensity_weight = 0.5; })},
      {"census, window 9", with([](auto& p) { p.cost = CostKind::census, p.n_square = 9; })},
      {"gradient, no minimum filter", with([](auto& p) { p.n_min = 1; })},
      {"gradient, median", with([](auto& p) { p.median = true; })},
      {"gradient, adaptive window", with([](auto& p) { p.aggregation = Aggregation::adaptive_window; })},
      {"the same, largest",
       with([](auto& p) { p.aggregation = Aggregation::adaptive_window, p.combination = Combination::max; })},
      {"the same, mean",
       with([](auto& p) { p.aggregation = Aggregation::adaptive_window, p.combination = Combination::mean; })},
      {"gradient, boundary guided", with([](auto& p) { p.aggregation = Aggregation::boundary, p.n_min = 1; })},
      {"gradient, adaptive weight", with([](auto& p) { p.aggregation = Aggregation::adaptive_weight, p.n_min = 1; })},
      {"gradient, uniqueness 0.1", with([](auto& p) { p.uniqueness = 26; })},
      {"gradient, left-right check", with([](auto& p) { p.left_right_check = true; })},
      {"gradient, scanline", with([](auto& p) { p.selection = Selection::scanline; })},
      {"census, scanline", quality([](auto& p) { p.selection = Selection::scanline, p.n_square = 5; })},
      {"census, semi-global (quality)", quality([](auto&) {})},
      {"the same, sub-pixel", quality([](auto& p) { p.subpixel = true; })},
      {"quality, uniqueness 0.1", quality([](auto& p) { p.uniqueness = 26; })},
      {"quality, left-right check", quality([](auto& p) { p.left_right_check = true; })},
  };
}

}  // namespace takt::command
