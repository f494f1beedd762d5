// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/state_archive.hpp>: core, experimental.
// What a node carries from one job to the next, so that a replay can begin in the middle of a record:
//
//   void remember(StateArchive& state) override { TAKT_STATE(state, pose_, window_, last_stamp_ns_); }
//
// One list serves all directions: it is saved, loaded, measured, and told by name.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

/// Members that make up the state of a node, or of a part of one.
#define TAKT_STATE(state, ...) (state).of(#__VA_ARGS__, __VA_ARGS__)

namespace takt {

/// Goes through the members that an object remembers. Known are: what can be copied as bytes and has no pointers in it,
/// strings, std::vector, deque, array, pair, optional, map, set, unique_ptr (there in both, or in neither), matrices of
/// Eigen, and whatever has a `void remember(StateArchive&)` itself or as a function beside it. What follows from setup
/// and parameters, or is made anew in each job, is left out. One thread.
class StateArchive {
 public:
  /// How many bytes save() takes at most: elements of a container count with its capacity.
  static StateArchive measuring() { return StateArchive(Way::measure); }
  /// Without allocating. Too little room: failed().
  static StateArchive saving(std::span<std::byte> to) {
    StateArchive state(Way::save);
    state.to_ = to;
    return state;
  }
  /// Into an object that was set up as the one that was saved. Bytes that do not fit: failed(), and the object is to be
  /// thrown away.
  static StateArchive loading(std::span<const std::byte> from) {
    StateArchive state(Way::load);
    state.from_ = from;
    return state;
  }
  /// A member, as text; those of parts are "grid_.cells_".
  using Tell = std::function<void(const std::string& name, const std::string& value)>;
  static StateArchive telling(Tell tell) {
    StateArchive state(Way::tell);
    state.tell_ = std::move(tell);
    return state;
  }

  bool loads() const { return way_ == Way::load; }
  /// Something did not fit.
  bool failed() const { return failed_; }
  void fail() { failed_ = true; }
  /// Passed so far.
  size_t bytes() const { return bytes_; }
  /// All bytes were used.
  bool at_end() const { return from_.empty(); }
  /// Of the types that were passed: states of another one cannot be loaded. After measuring, of an object as set up.
  uint64_t layout() const { return layout_; }

  /// Room for more than the capacities say: of containers that get theirs in a job.
  void room(size_t bytes) { bytes_ += way_ == Way::measure ? bytes : 0; }

  template <class... T>
  void of(std::string_view names, T&... members) {
    (named(next_name(names), members), ...);
  }
  template <class T>
  void operator()(T& value) {
    pass(value);
  }
  /// `size` bytes at `data`.
  void raw(void* data, size_t size) {
    note(size);
    if (way_ == Way::tell) return tell_bytes(data, size);
    move(data, size);
  }

 private:
  enum class Way : uint8_t { measure, save, load, tell };
  explicit StateArchive(Way way) : way_(way) {}

  static std::string_view next_name(std::string_view& names);
  void note(size_t what) { layout_ = (layout_ ^ what) * 0x100000001b3U; }
  void move(void* data, size_t size);
  void tell_bytes(const void* data, size_t size);
  void tell(const std::string& value);
  /// Of a container: as many as it has, or is to get. At least `least` bytes follow for each.
  size_t count(size_t size, size_t least);

  template <class T>
  void named(std::string_view name, T& member) {
    if (way_ != Way::tell) return pass(member);
    const size_t before = path_.size();
    path_ += (path_.empty() ? "" : ".") + std::string(name);
    pass(member);
    path_.resize(before);
  }

  template <class T>
  static constexpr bool kPlain = std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>;

  template <class T>
  void pass(T& value) {
    static_assert(!std::is_const_v<T>, "a const member is not remembered: it follows from setup");
    if constexpr (requires { value.remember(*this); }) value.remember(*this);
    else if constexpr (requires { remember(*this, value); }) remember(*this, value);
    else if constexpr (std::is_arithmetic_v<T>) number(value);
    else if constexpr (requires {
                         typename T::PlainObject;
                         value.rows();
                       })
      matrix(value);
    else container(value);
  }
  template <class T>
  void number(T& value) {
    note(sizeof(T));
    if (way_ == Way::tell) return tell(std::is_same_v<T, bool> ? (value ? "true" : "false") : std::to_string(value));
    if constexpr (std::is_same_v<T, bool>) {
      uint8_t byte = value ? 1 : 0;
      move(&byte, sizeof byte);
      if (byte > 1) return fail();
      value = byte == 1;
    } else {
      move(&value, sizeof value);
    }
  }
  template <class T>
  void matrix(T& value) {
    using Scalar = typename T::Scalar;
    if constexpr (T::SizeAtCompileTime < 0) {
      Size size{value.rows(), value.cols()};
      move_size(size);
      if (loads() && !failed_) value.resize(size[0], size[1]);
    }
    note(sizeof(Scalar));
    if (way_ == Way::tell) return tell_bytes(value.data(), static_cast<size_t>(value.size()) * sizeof(Scalar));
    if (!failed_) move(value.data(), static_cast<size_t>(value.size()) * sizeof(Scalar));
  }
  using Size = std::array<std::ptrdiff_t, 2>;
  /// Of a matrix; what cannot be one, or does not fit into the bytes that are left, fails.
  void move_size(Size& size);

  template <class T>
  void container(std::optional<T>& value) {
    bool there = value.has_value();
    number(there);
    if (failed_) return;
    if (loads() && there && !value) {
      if constexpr (std::is_default_constructible_v<T>) value.emplace();
      else fail();
    }
    if (loads() && !there) value.reset();
    if (way_ == Way::measure && !value) bytes_ += sizeof(T);
    else if (value && !failed_) pass(*value);
  }
  template <class T>
  void container(std::unique_ptr<T>& value) {
    bool there = value != nullptr;
    number(there);
    if (there != (value != nullptr)) return fail();
    if (value != nullptr && !failed_) pass(*value);
  }
  template <class A, class B>
  void container(std::pair<A, B>& value) {
    pass(value.first), pass(value.second);
  }
  template <class T, size_t N>
  void container(std::array<T, N>& value) {
    elements(std::span<T>(value));
  }
  template <class T>
  void container(std::vector<T>& value) {
    static_assert(!std::is_same_v<T, bool>, "std::vector<bool> is not known: use uint8_t");
    const size_t all = count(value.size(), kPlain<T> ? sizeof(T) : 1);
    if (loads() && !failed_) {
      if constexpr (std::is_default_constructible_v<T>) value.resize(all);
      else if (all != value.size()) return fail();
    }
    elements(std::span<T>(value));
    if (way_ == Way::measure) bytes_ += (value.capacity() - value.size()) * sizeof(T);
  }
  void container(std::string& value) {
    const size_t all = count(value.size(), 1);
    if (way_ == Way::tell) return tell("\"" + value + "\"");
    if (loads() && !failed_) value.resize(all);
    if (!failed_) move(value.data(), value.size());
    if (way_ == Way::measure) bytes_ += value.capacity() - value.size();
  }
  template <class T>
  void container(std::deque<T>& value) {
    const size_t all = count(value.size(), 1);
    if (loads() && !failed_) value.resize(all);
    for (T& element : value)
      if (!failed_ && way_ != Way::tell) pass(element);
  }
  template <class K, class V, class C>
  void container(std::map<K, V, C>& value) {
    size_t all = count(value.size(), 1);
    if (way_ == Way::tell) return;
    if (!loads()) {
      for (auto& [key, element] : value) {
        K copy = key;
        pass(copy), pass(element);
      }
      return;
    }
    value.clear();
    for (; all > 0 && !failed_; --all) {
      std::pair<K, V> entry{};
      pass(entry.first), pass(entry.second);
      value.insert_or_assign(value.end(), std::move(entry.first), std::move(entry.second));
    }
  }
  template <class K, class C>
  void container(std::set<K, C>& value) {
    size_t all = count(value.size(), 1);
    if (way_ == Way::tell) return;
    if (!loads()) {
      for (K key : value) pass(key);
      return;
    }
    value.clear();
    for (; all > 0 && !failed_; --all) {
      K key{};
      pass(key);
      value.insert(value.end(), std::move(key));
    }
  }
  template <class T>
  void container(T& value) {
    static_assert(kPlain<T>, "give this type a `void remember(StateArchive&)`: it cannot be copied as bytes");
    static_assert(
        !requires {
          value.data();
          value.size();
        },
        "a view is not remembered: what it points to may be");
    raw(&value, sizeof value);
  }
  template <class T>
  void elements(std::span<T> all) {
    if constexpr (kPlain<T> && !requires(T & one, StateArchive & s) { one.remember(s); }) {
      if (!failed_) raw(all.data(), all.size_bytes());
    } else {
      for (T& element : all)
        if (!failed_ && way_ != Way::tell) pass(element);
    }
  }

  const Way way_;
  bool failed_ = false;
  size_t bytes_ = 0;
  uint64_t layout_ = 0xcbf29ce484222325U;
  std::span<std::byte> to_;
  std::span<const std::byte> from_;
  Tell tell_;
  std::string path_;
};

}  // namespace takt
