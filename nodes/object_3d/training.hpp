// SPDX-License-Identifier: Apache-2.0
// What classifiers learn from: attribute vectors of known classes, in a plain file.
#pragma once
#include <filesystem>
#include <iosfwd>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/object_3d/attributes.hpp"

namespace takt::object_3d {

struct Sample {
  size_t class_id = 0;  ///< index in Training::classes
  Attributes attributes{};
};

struct Training {
  std::vector<Attribute> used;  ///< those that the file names; the others are 0 in every sample
  std::vector<std::string> classes;
  std::vector<Sample> samples;  ///< those of a class one after the other
};

/// What cannot be used: "FILE:LINE: what is wrong; what is valid".
struct TrainingError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A line holds one of
///
///     attributes NAME...     what the numbers of a sample are, in their order; once, before the first class
///     class NAME             begins a class; its index is the class id of its objects
///     sample NUMBER...       one object of the class
///
/// or nothing; # begins a comment. Throws TrainingError.
Training read_training(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in errors.
Training parse_training(std::istream& text, const std::string& name);

/// What read_training reads, five digits a number.
void write_training(std::ostream& out, const Training& training);

}  // namespace takt::object_3d
