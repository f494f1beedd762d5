// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/param.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

namespace takt {

class Node;

/// A parameter value as it comes from outside, already in the unit the parameter declares (SI).
using ParamValue = std::variant<bool, int64_t, double, std::string>;

/// Instead of a unit: the text names a file or folder that the node reads, relative to the graph; a default first to
/// graph/ of Takt's share folder. It is part of what a record must be replayed with.
inline constexpr std::string_view kPath = "path";

/// As the last argument of a parameter: why no run can set it.
struct Fixed {
  std::string_view why;  ///< in a few words
};
inline constexpr Fixed kSizesMemory{"sizes memory"};
/// It names a file, or what the node is made of.
inline constexpr Fixed kReadAtStart{"read at start"};

/// Name, default, unit, range and meaning of a parameter, declared once as a member of its node and used by the loader,
/// `takt nodes` and the documentation.
class ParamBase {
 public:
  ParamBase(Node* owner, std::string_view name, std::string_view unit, std::string_view doc, Fixed fixed = {});
  ParamBase(const ParamBase&) = delete;
  ParamBase& operator=(const ParamBase&) = delete;
  virtual ~ParamBase() = default;

  std::string_view name() const { return name_; }
  std::string_view unit() const { return unit_; }  ///< "m", "rad", "s", "m/s"..., "px", "1", kPath, else ""
  std::string_view doc() const { return doc_; }
  /// Takes a value, or says what is wrong with it ("is 12, must lie in 1..10"). Before start, and between jobs if live.
  virtual tl::expected<void, std::string> set(const ParamValue& value) = 0;
  virtual ParamValue value() const { return value_text(); }
  virtual std::string value_text() const = 0;
  virtual std::string range_text() const = 0;  ///< "1..512", "sad | ssd", "" if anything goes
  virtual std::string kind() const = 0;        ///< "integer", "number", "flag", "text", "choice"

  /// Why no run can set it, as its node declares it; those of unit kPath are read at the start. Empty: it is live,
  /// unless the node forgot to say so.
  std::string_view fixed() const { return fixed_; }
  /// True if a new value takes effect with the next job: the parameter is not declared fixed, and what setup() read,
  /// Node::changed() reads again. Known after Node::end_setup().
  bool live() const { return live_; }

 protected:
  void use() const { used_ = true; }

 private:
  friend class Node;
  std::string_view name_, unit_, doc_, fixed_;
  mutable bool used_ = false;
  bool live_ = false;
};

template <class T>
struct Range {
  T low, high;
};

/// An integer (int, int64_t), a number (double), a flag (bool) or a text (std::string).
template <class T>
class Param final : public ParamBase {
 public:
  Param(Node* owner, std::string_view name, T value, std::string_view unit, std::string_view doc, Fixed fixed = {})
      : ParamBase(owner, name, unit, doc, fixed), value_(std::move(value)) {}
  Param(Node* owner, std::string_view name, T value, Range<T> range, std::string_view unit, std::string_view doc,
        Fixed fixed = {})
      : ParamBase(owner, name, unit, doc, fixed), value_(std::move(value)), range_(range) {}

  const T& operator()() const {
    use();
    return value_;
  }
  operator const T&() const { return (*this)(); }
  tl::expected<void, std::string> set(const ParamValue& value) override;
  ParamValue value() const override;
  std::string value_text() const override;
  std::string range_text() const override;
  std::string kind() const override;

 private:
  T value_;
  std::optional<Range<T>> range_;
};

/// One word out of a fixed list; operator() gives its index.
class Choice final : public ParamBase {
 public:
  Choice(Node* owner, std::string_view name, std::string_view value, std::vector<std::string_view> words,
         std::string_view doc, Fixed fixed = {});
  size_t operator()() const {
    use();
    return index_;
  }
  std::string_view word() const { return words_[index_]; }
  tl::expected<void, std::string> set(const ParamValue& value) override;
  ParamValue value() const override { return std::string(word()); }
  std::string value_text() const override { return std::string(word()); }
  std::string range_text() const override;
  std::string kind() const override { return "choice"; }

 private:
  std::vector<std::string_view> words_;
  size_t index_ = 0;
};

extern template class Param<int>;
extern template class Param<double>;
extern template class Param<bool>;
extern template class Param<std::string>;

}  // namespace takt
