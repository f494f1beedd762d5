// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "rt/file/input_file.hpp"

namespace takt::object_3d {
namespace {

class Parser {
 public:
  explicit Parser(std::string name) : name_(std::move(name)) {}

  Training parse(std::istream& text) {
    for (std::string line; std::getline(text, line);) {
      ++line_;
      std::istringstream rest(line.substr(0, line.find('#')));
      std::vector<std::string> words;
      for (std::string word; rest >> word;) words.push_back(word);
      if (!words.empty()) take(words);
    }
    complete();
    if (training_.classes.empty())
      fail("names no class; write `attributes NAME...`, then `class NAME` and its samples");
    return std::move(training_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw TrainingError(fmt::format("{}:{}: {}", name_, line_, what));
  }

  void take(const std::vector<std::string>& words) {
    const std::string& key = words[0];
    if (key == "attributes") name_attributes(words);
    else if (key == "class") begin(words);
    else if (key == "sample") add(words);
    else fail(fmt::format("unknown word `{}`; valid are attributes, class, sample", key));
  }

  void name_attributes(const std::vector<std::string>& words) {
    if (!training_.used.empty()) fail("`attributes` stands there a second time");
    if (words.size() < 2) fail("`attributes` takes at least one name");
    for (size_t i = 1; i < words.size(); ++i) {
      const auto attribute = attribute_of(words[i]);
      if (!attribute) fail(fmt::format("unknown attribute `{}`; valid are {}", words[i], all_names()));
      if (std::find(training_.used.begin(), training_.used.end(), *attribute) != training_.used.end())
        fail(fmt::format("attribute `{}` stands there twice", words[i]));
      training_.used.push_back(*attribute);
    }
  }

  static std::string all_names() {
    std::string names;
    for (size_t i = 0; i < kAttributes; ++i)
      names += (i > 0 ? ", " : "") + std::string(name_of(static_cast<Attribute>(i)));
    return names;
  }

  void begin(const std::vector<std::string>& words) {
    if (training_.used.empty()) fail("`class` stands before `attributes NAME...`");
    if (words.size() != 2) fail("`class` takes exactly one name");
    complete();
    if (std::find(training_.classes.begin(), training_.classes.end(), words[1]) != training_.classes.end())
      fail(fmt::format("class `{}` is there already; names must differ", words[1]));
    training_.classes.push_back(words[1]);
  }

  /// The class before must have a sample.
  void complete() const {
    if (training_.classes.empty()) return;
    if (training_.samples.empty() || training_.samples.back().class_id + 1 != training_.classes.size())
      fail(fmt::format("class `{}` has no sample; write `sample NUMBER...` below it", training_.classes.back()));
  }

  void add(const std::vector<std::string>& words) {
    if (training_.classes.empty()) fail("`sample` stands before the first `class NAME`");
    if (words.size() != training_.used.size() + 1)
      fail(fmt::format("the sample has {} numbers, must have {}, one for each attribute", words.size() - 1,
                       training_.used.size()));
    Sample sample{training_.classes.size() - 1, {}};
    for (size_t i = 0; i < training_.used.size(); ++i)
      sample.attributes[static_cast<size_t>(training_.used[i])] = number(words[i + 1]);
    training_.samples.push_back(sample);
  }

  float number(const std::string& word) const {
    size_t used = 0;
    float value = 0;
    try {
      value = std::stof(word, &used);
    } catch (const std::exception&) {
    }
    if (used != word.size() || !std::isfinite(value)) fail(fmt::format("`{}` is no number", word));
    return value;
  }

  std::string name_;
  int line_ = 0;
  Training training_;
};

}  // namespace

Training parse_training(std::istream& text, const std::string& name) { return Parser(name).parse(text); }

Training read_training(const std::filesystem::path& file) {
  if (std::filesystem::exists(file)) require_readable<TrainingError>(file);
  std::ifstream in(file);
  if (!in)
    throw TrainingError(file.string() +
                        ": cannot be read; training data are a text file, see `takt eval objects3d --write`");
  return parse_training(in, file.string());
}

void write_training(std::ostream& out, const Training& training) {
  out << "attributes";
  for (const Attribute attribute : training.used) out << ' ' << name_of(attribute);
  out << '\n';
  for (size_t c = 0; c < training.classes.size(); ++c) {
    out << "class " << training.classes[c] << '\n';
    for (const Sample& sample : training.samples) {
      if (sample.class_id != c) continue;
      out << "sample";
      for (const Attribute attribute : training.used)
        out << fmt::format(" {:.5g}", value(sample.attributes, attribute));
      out << '\n';
    }
  }
}

}  // namespace takt::object_3d
