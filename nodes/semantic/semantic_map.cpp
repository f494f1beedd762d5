// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/semantic_map.hpp"

#include <algorithm>
#include <charconv>

namespace takt::semantic {
namespace {

constexpr size_t kUnforeseenTypes = 256;  ///< that a run may add without taking memory

/// Of a grid the rows and columns in which some cell is not `empty`.
template <class T>
void remember_box(StateArchive& archive, std::vector<T>& cells, int columns, T empty) {
  const int rows = static_cast<int>(cells.size()) / columns;
  std::array<int, 4> box{rows, 0, columns, 0};  // first row, one past the last, the same of columns
  const auto row = [&](int r) { return cells.data() + static_cast<ptrdiff_t>(r) * columns; };
  const auto known = [empty](T cell) { return cell != empty; };
  for (int r = 0; r < rows; ++r) {
    const T *const begin = row(r), *const end = begin + columns, *const first = std::find_if(begin, end, known);
    if (first == end) continue;
    const T* last = end;
    while (!known(last[-1])) --last;
    box = {std::min(box[0], r), r + 1, std::min(box[2], static_cast<int>(first - begin)),
           std::max(box[3], static_cast<int>(last - begin))};
  }
  archive(box);
  archive.room(cells.size() * sizeof(T));
  const bool fits = std::min(box[0], box[2]) >= 0 && box[1] <= rows && box[3] <= columns;
  if (!fits) return archive.fail();
  if (archive.loads()) std::fill(cells.begin(), cells.end(), empty);
  if (box[2] >= box[3]) return;
  for (int r = box[0]; r < box[1]; ++r) archive.raw(row(r) + box[2], static_cast<size_t>(box[3] - box[2]) * sizeof(T));
}

}  // namespace

SemanticMap::SemanticMap(const MapParameters& parameters)
    : parameters_(parameters),
      network_(parameters.capacity),
      record_(parameters.capacity.nodes),
      objects_(parameters.capacity.nodes) {
  types_.reserve(kUnforeseenTypes);
  const size_t cells = static_cast<size_t>(parameters.columns) * static_cast<size_t>(parameters.rows);
  first_.assign(cells, kNoNode);
  terrain_.assign(cells, 0);
  occupancy_.assign(cells, navigation::kUnknownCell);
  view_ = {{occupancy_.data(), parameters.columns, parameters.rows},
           parameters.cell_m,
           parameters.origin_x_m,
           parameters.origin_y_m};
}

void SemanticMap::remember(StateArchive& archive) {
  TAKT_STATE(archive, network_, types_);
  if (archive.failed()) return;
  archive.room(record_.size() * sizeof(uint32_t) + objects_.size() * (sizeof(NodeId) + sizeof(Object)));
  archive.raw(record_.data(), network_.end() * sizeof(uint32_t));
  remember_objects(archive);
  remember_box(archive, occupancy_, parameters_.columns, navigation::kUnknownCell);
  remember_box(archive, terrain_, parameters_.columns, Terrain{0});
}

/// In which order those of a cell are linked stands in themselves.
void SemanticMap::remember_objects(StateArchive& archive) {
  if (archive.loads()) std::fill(first_.begin(), first_.end(), kNoNode);
  for (NodeId node = 0; node < network_.end() && !archive.failed(); ++node) {
    if (!network_.exists(node) || network_.kind(node) != Kind::object) continue;
    Object& object = objects_[node];
    archive.raw(&object, sizeof object);
    if (archive.failed() || object.cell >= first_.size()) return archive.fail();
    if (archive.loads() && object.previous == kNoNode) first_[object.cell] = node;
  }
}

// What there can be ---------------------------------------------------------------------------------------------------

tl::expected<NodeId, NetworkError> SemanticMap::add(Kind kind, std::string_view name, size_t record) {
  const auto node = network_.add(kind, name);
  if (node) record_[*node] = static_cast<uint32_t>(record);
  return node;
}

tl::expected<NodeId, NetworkError> SemanticMap::add_attribute(std::string_view name, Attribute attribute) {
  const auto node = add(Kind::attribute, name, attributes_.size());
  if (node) attributes_.push_back(std::move(attribute));
  return node;
}

tl::expected<NodeId, NetworkError> SemanticMap::add_type(std::string_view name) {
  const auto node = add(Kind::type, name, types_.size());
  if (node) types_.emplace_back();
  return node;
}

tl::expected<void, NetworkError> SemanticMap::add_to_type(NodeId type, NodeId attribute, double weight) {
  auto connected = network_.connect(type, attribute);
  if (connected) types_[record_[type]].weights.emplace_back(attribute, weight);
  return connected;
}

tl::expected<NodeId, NetworkError> SemanticMap::add_action(std::string_view name, Action action) {
  const auto node = add(Kind::action, name, actions_.size());
  if (!node) return node;
  std::vector<NodeId> others;
  for (const Role& role : action.roles) others.push_back(role.type);
  for (const auto* clauses : {&action.required, &action.results})
    for (const Clause& clause : *clauses) others.push_back(clause.attribute);
  actions_.push_back(std::move(action));
  for (const NodeId other : others)
    if (const auto connected = network_.connect(*node, other); !connected)
      return tl::make_unexpected(connected.error());
  return node;
}

double SemanticMap::weight(std::span<const NodeId> types, NodeId attribute) const {
  std::optional<double> largest;
  for (const NodeId type : types)
    for (const auto& [node, weight] : types_[record_[type]].weights)
      if (node == attribute) largest = std::max(largest.value_or(weight), weight);
  return largest.value_or(1);
}

tl::expected<NodeId, NetworkError> SemanticMap::type_named(std::string_view name) {
  const NodeId known = network_.find(name);
  if (known == kNoNode) return add_type(name);
  if (network_.kind(known) != Kind::type) return tl::make_unexpected(NetworkError::name_taken);
  return known;
}

// What there is -------------------------------------------------------------------------------------------------------

tl::expected<NodeId, NetworkError> SemanticMap::add_numbered(NodeId type) {
  char name[kLongestName + 12];
  const std::string_view stem = network_.name(type);
  size_t used = stem.copy(name, kLongestName);
  name[used++] = '_';
  for (;;) {
    const char* end = std::to_chars(name + used, std::end(name), ++types_[record_[type]].last_number).ptr;
    const auto node = network_.add(Kind::object, {name, static_cast<size_t>(end - name)});
    if (node || node.error() != NetworkError::name_taken) return node;
  }
}

tl::expected<NodeId, NetworkError> SemanticMap::add_object(NodeId type, double x_m, double y_m, std::string_view name) {
  if (!contains(x_m, y_m)) return tl::make_unexpected(NetworkError::outside);
  const auto node = name.empty() ? add_numbered(type) : network_.add(Kind::object, name);
  if (!node) return node;
  if (const auto connected = network_.connect(*node, type); !connected) {
    network_.remove(*node);
    return tl::make_unexpected(connected.error());
  }
  objects_[*node] = {};
  objects_[*node].x_m = x_m;
  objects_[*node].y_m = y_m;
  link(*node, static_cast<uint32_t>(index(view_.cell_of(x_m, y_m))));
  return node;
}

bool SemanticMap::move(NodeId object, double x_m, double y_m) {
  const navigation::Cell cell = view_.cell_of(x_m, y_m);
  if (!view_.contains(cell)) return false;
  Object& o = objects_[object];
  o.x_m = x_m;
  o.y_m = y_m;
  if (const auto to = static_cast<uint32_t>(index(cell)); to != o.cell) {
    unlink(object);
    link(object, to);
  }
  return true;
}

void SemanticMap::remove(NodeId object) {
  unlink(object);
  network_.remove(object);
}

Value SemanticMap::state(NodeId object, NodeId attribute) const {
  const Object& o = objects_[object];
  for (uint32_t i = 0; i < o.state_count; ++i)
    if (o.states[i].attribute == attribute) return o.states[i].value;
  return {};
}

bool SemanticMap::set_state(NodeId object, NodeId attribute, const Value& value) {
  if (known(value) && !fits(this->attribute(attribute), value)) return false;
  Object& o = objects_[object];
  const auto begin = o.states.begin(), end = begin + o.state_count;
  const auto at = std::find_if(begin, end, [&](const State& s) { return s.attribute == attribute; });
  if (!known(value)) {
    if (at != end) *at = o.states[--o.state_count];
    return true;
  }
  if (at == o.states.end()) return false;
  const auto types = network_.omega(object, Kind::type);
  const bool inherited =
      std::any_of(types.begin(), types.end(), [&](NodeId t) { return network_.connected(t, attribute); });
  if (!inherited && !network_.connect(object, attribute)) return false;
  if (at == end) ++o.state_count;
  *at = {attribute, value};
  return true;
}

bool SemanticMap::possible(const Action& action, std::span<const NodeId> objects) const {
  return std::all_of(action.required.begin(), action.required.end(),
                     [&](const Clause& c) { return state(objects[c.role], c.attribute) == c.value; });
}

void SemanticMap::apply(const Action& action, std::span<const NodeId> objects) {
  for (const Clause& c : action.results) set_state(objects[c.role], c.attribute, c.value);
}

// Where ---------------------------------------------------------------------------------------------------------------

void SemanticMap::take_over(const navigation::OccupancyView& other) {
  const double right_m = other.origin_x_m + other.cells.width * other.cell_m,
               top_m = other.origin_y_m + other.cells.height * other.cell_m;
  const navigation::Cell low = clamped(other.origin_x_m, other.origin_y_m), high = clamped(right_m, top_m);
  for (int row = low.row; row <= high.row; ++row)
    for (int column = low.column; column <= high.column; ++column) {
      const navigation::Cell from = other.cell_of(view_.middle_x_m({column, row}), view_.middle_y_m({column, row}));
      if (!other.contains(from)) continue;
      const int16_t value = other.cells.at(from.column, from.row);
      if (value != navigation::kUnknownCell) occupancy_[index({column, row})] = value;
    }
}

Terrain SemanticMap::terrain(double x_m, double y_m) const {
  const navigation::Cell cell = view_.cell_of(x_m, y_m);
  return view_.contains(cell) ? terrain_[index(cell)] : Terrain{0};
}

void SemanticMap::set_terrain(double x_m, double y_m, Terrain terrain) {
  const navigation::Cell cell = view_.cell_of(x_m, y_m);
  if (view_.contains(cell)) terrain_[index(cell)] = terrain;
}

navigation::Cell SemanticMap::clamped(double x_m, double y_m) const {
  const navigation::Cell cell = view_.cell_of(x_m, y_m);
  return {std::clamp(cell.column, 0, parameters_.columns - 1), std::clamp(cell.row, 0, parameters_.rows - 1)};
}

void SemanticMap::link(NodeId object, uint32_t cell) {
  Object& o = objects_[object];
  o.cell = cell;
  o.previous = kNoNode;
  o.next = first_[cell];
  if (o.next != kNoNode) objects_[o.next].previous = object;
  first_[cell] = object;
}

void SemanticMap::unlink(NodeId object) {
  const Object& o = objects_[object];
  (o.previous != kNoNode ? objects_[o.previous].next : first_[o.cell]) = o.next;
  if (o.next != kNoNode) objects_[o.next].previous = o.previous;
}

std::vector<NodeId> SemanticMap::all(Kind kind) const {
  std::vector<NodeId> nodes;
  for (NodeId id = 0; id < network_.end(); ++id)
    if (network_.exists(id) && network_.kind(id) == kind) nodes.push_back(id);
  return nodes;
}

}  // namespace takt::semantic
