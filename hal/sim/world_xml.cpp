// SPDX-License-Identifier: Apache-2.0
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "hal/settings/units.hpp"
#include "hal/sim/world.hpp"
#include "rt/file/input_file.hpp"

namespace takt::sim {
namespace {

using Element = tinyxml2::XMLElement;

constexpr size_t kLongestName = 31, kMostRoles = 4, kMostAttributes = 8;  // what messages hold

/// "a, b" of the names in a list.
template <class List, class Name>
std::string listed(const List& list, const Name& name) {
  std::string all;
  for (const auto& item : list) all.append(all.empty() ? "" : ", ").append(name(item));
  return all.empty() ? "(none)" : all;
}
template <class List>
std::string names(const List& list) {
  return listed(list, [](const auto& item) { return item.name; });
}
template <class List>
auto named(const List& list, const std::string& name) {
  return std::find_if(list.begin(), list.end(), [&](const auto& item) { return item.name == name; });
}

struct Loader {
  std::string id, file;
  World world;
  std::optional<DeviceError> error;

  void fail(const Element* at, const std::string& what, const std::string& fix) {
    if (!error) error = DeviceError{id, file + ":" + std::to_string(at->GetLineNum()) + ": " + what, fix};
  }
  std::string text(const Element* e, const char* name, bool required, std::string fallback = "") {
    if (const char* value = e->Attribute(name)) return value;
    if (required)
      fail(e, std::string("<") + e->Name() + "> lacks `" + name + "`", std::string("add ") + name + "=\"...\"");
    return fallback;
  }
  double quantity(const Element* e, const char* name, Dimension dimension,
                  std::optional<double> fallback = std::nullopt) {
    const char* value = e->Attribute(name);
    if (value == nullptr) {
      if (!fallback)
        fail(e, std::string("<") + e->Name() + "> lacks `" + name + "`", std::string("add ") + name + "=\"...\"");
      return fallback.value_or(0.0);
    }
    if (const auto parsed = parse_quantity(value, dimension)) return *parsed;
    fail(e,
         std::string("`") + name + "` is \"" + value + "\", which is no value in " + std::string(unit_names(dimension)),
         "give a number and its unit");
    return fallback.value_or(0.0);
  }
  /// A text that messages carry: of an object, a type, an attribute, a value, an action.
  std::string word(const Element* e, const char* name) {
    std::string value = text(e, name, true);
    if (value.empty() || value.size() > kLongestName)
      fail(e, std::string("`") + name + "` has " + std::to_string(value.size()) + " letters", "use 1 to 31");
    return value;
  }
  bool flag(const Element* e, const char* name, bool fallback) {
    bool value = fallback;
    if (e->Attribute(name) != nullptr && e->QueryBoolAttribute(name, &value) != tinyxml2::XML_SUCCESS) {
      fail(e, std::string("`") + name + "` must be true or false", "correct the value");
    }
    return value;
  }
  Material material(const Element* e, const char* name, Material fallback) {
    const std::string value = text(e, name, false);
    if (value.empty() || material_from(value, fallback)) return fallback;
    fail(e, std::string("unknown material \"") + value + "\"", "known: " + std::string(material_names()));
    return fallback;
  }
  void unknown(const Element* e, const std::string& known) {
    fail(e, std::string("unknown element <") + e->Name() + ">", "known here: " + known);
  }

  void client(const Element* e) {
    Client c;
    c.name = text(e, "name", true);
    if (named(world.clients, c.name) != world.clients.end())
      fail(e, "client `" + c.name + "` exists already", "choose another name");
    c.x_m = quantity(e, "x", Dimension::length);
    c.y_m = quantity(e, "y", Dimension::length);
    c.theta_rad = quantity(e, "theta", Dimension::angle, 0.0);
    for (const Element* p = e->FirstChildElement(); p != nullptr; p = p->NextSiblingElement()) {
      if (std::string(p->Name()) != "path") return unknown(p, "path");
      c.path.speed_m_s = quantity(p, "speed", Dimension::speed, c.path.speed_m_s);
      c.path.turn_rad_s = quantity(p, "turn", Dimension::turn_rate, c.path.turn_rad_s);
      c.path.loop = flag(p, "loop", true);
      if (c.path.speed_m_s <= 0 || c.path.speed_m_s > 1.4) fail(p, "`speed` must lie in (0, 1.4 m/s]", "lower it");
      if (c.path.turn_rad_s <= 0) fail(p, "`turn` must be positive", "correct it");
      for (const Element* w = p->FirstChildElement(); w != nullptr; w = w->NextSiblingElement()) {
        if (std::string(w->Name()) != "waypoint") return unknown(w, "waypoint");
        c.path.waypoints.push_back({quantity(w, "x", Dimension::length), quantity(w, "y", Dimension::length)});
      }
      if (c.path.waypoints.size() < 3) fail(p, "a path needs at least three waypoints", "add <waypoint x=... y=.../>");
    }
    world.clients.push_back(c);
  }

  void object(const Element* e) {
    WorldObject o;
    o.name = word(e, "name");
    o.type = word(e, "type");
    o.position = Vec2(quantity(e, "x", Dimension::length), quantity(e, "y", Dimension::length));
    o.yaw_rad = quantity(e, "yaw", Dimension::angle, 0.0);
    if (named(world.objects, o.name) != world.objects.end())
      fail(e, "object `" + o.name + "` exists already", "choose another name");
    for (const Element* c = e->FirstChildElement("attr"); c != nullptr; c = c->NextSiblingElement("attr"))
      o.attributes[word(c, "name")] = word(c, "value");
    if (o.attributes.size() > kMostAttributes) fail(e, "object `" + o.name + "` has more than 8 attributes", "keep 8");
    for (const Element* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (kind == "look") look(c, o);
      else if (kind != "attr" && !shape(c, o)) unknown(c, "attr, look, " + std::string(kShapes));
    }
    world.objects.push_back(std::move(o));
  }

  static constexpr const char* kShapes = "box, person, board";
  /// False if the element is no part of a shape.
  bool shape(const Element* e, Shape& s) {
    const std::string kind = e->Name();
    if (kind == "box") {
      s.box = Box{quantity(e, "width", Dimension::length), quantity(e, "depth", Dimension::length),
                  quantity(e, "height", Dimension::length), quantity(e, "z", Dimension::length, 0.0),
                  material(e, "material", Material::wood)};
      if (s.box->width_m <= 0 || s.box->depth_m <= 0 || s.box->height_m <= 0)
        fail(e, "a box needs positive sizes", "correct them");
    } else if (kind == "person") {
      s.person = Person{quantity(e, "height", Dimension::length, 1.75), e->Attribute("pointing") != nullptr,
                        quantity(e, "pointing", Dimension::angle, 0.0)};
      if (s.person->height_m < 0.5 || s.person->height_m > 2.5)
        fail(e, "`height` must lie in 0.5..2.5 m", "correct it");
      if (e->Attribute("shirt") != nullptr)
        s.person->shirt = picture(e, "shirt", kShirtEdge * s.person->height_m / 1.75);
    } else if (kind == "board") {
      board(e, s);
    } else {
      return false;
    }
    return true;
  }

  void look(const Element* e, WorldObject& o) {
    Look l;
    std::istringstream conditions(text(e, "when", true));
    for (std::string part; std::getline(conditions >> std::ws, part, ',');) {
      const size_t equals = part.find('=');
      const Condition condition{part.substr(0, equals), equals < part.size() ? part.substr(equals + 1) : ""};
      if (condition.value.empty()) fail(e, "`when` has the part \"" + part + "\"", "write attribute=value, ...");
      else if (o.attributes.count(condition.attribute) == 0)
        fail(e, "object `" + o.name + "` has no attribute `" + condition.attribute + "`",
             "known: " + listed(o.attributes, [](const auto& attribute) { return attribute.first; }));
      l.when.push_back(condition);
    }
    if (l.when.empty()) fail(e, "`when` is empty", "write attribute=value, ...");
    for (const Element* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement())
      if (!shape(c, l.shape)) unknown(c, kShapes);
    o.looks.push_back(std::move(l));
  }

  void board(const Element* e, Shape& s) {
    const double edge = quantity(e, "edge", Dimension::length), z = quantity(e, "z", Dimension::length);
    if (error) return;
    if (edge <= 0) return fail(e, "`edge` must be positive", "correct it");
    s.board = Board{edge, z, picture(e, "picture", edge)};
  }

  /// From the file that an attribute names, relative to the world file; null after an error.
  std::shared_ptr<const Texture> picture(const Element* e, const char* name, double edge_m) {
    const std::string picture_file = text(e, name, true);
    if (error) return nullptr;
    auto read = load_picture(std::filesystem::path(file).parent_path() / picture_file, edge_m);
    if (read) return std::make_shared<const Texture>(std::move(*read));
    fail(e, read.error(), "correct the picture");
    return nullptr;
  }

  void terrain(const Element* e) {
    TerrainPatch t;
    t.name = word(e, "name");
    t.middle = Vec2(quantity(e, "x", Dimension::length), quantity(e, "y", Dimension::length));
    t.width_m = quantity(e, "width", Dimension::length);
    t.depth_m = quantity(e, "depth", Dimension::length);
    t.material = material(e, "material", t.material);
    if (t.width_m <= 0 || t.depth_m <= 0) fail(e, "a terrain needs positive sizes", "correct them");
    world.terrain.push_back(t);
  }

  void line(const Element* e) {
    WorldLine l;
    const double index = quantity(e, "index", Dimension::number);
    if (index < 0 || index > 31 || index != static_cast<double>(static_cast<uint32_t>(index))) {
      return fail(e, "`index` must be an integer in 0..31", "correct it");
    }
    l.index = static_cast<uint32_t>(index);
    l.name = text(e, "name", true);
    l.rest = flag(e, "rest", true);
    for (const Element* p = e->FirstChildElement("pulse"); p != nullptr; p = p->NextSiblingElement("pulse")) {
      l.pulses.push_back({quantity(p, "from", Dimension::time), quantity(p, "until", Dimension::time)});
    }
    world.lines.push_back(l);
  }

  /// Of all objects of a type, each once.
  std::vector<std::string> attributes_of(const std::string& type) const {
    std::vector<std::string> all;
    for (const WorldObject& o : world.objects) {
      if (o.type != type) continue;
      for (const auto& [name, value] : o.attributes)
        if (std::find(all.begin(), all.end(), name) == all.end()) all.push_back(name);
    }
    return all;
  }

  /// The role that an element of an action is about; null after an error.
  const ActionRole* role(const Element* e, const char* name, const WorldAction& a) {
    const std::string wanted = text(e, name, true);
    const auto found = named(a.roles, wanted);
    if (found != a.roles.end()) return &*found;
    fail(e, "action `" + a.name + "` has no role `" + wanted + "`",
         "known: " + names(a.roles) + "; declare others with <role>");
    return nullptr;
  }

  void condition(const Element* e, const WorldAction& a, std::vector<RoleCondition>& into) {
    const RoleCondition c{text(e, "role", true), word(e, "attr"), word(e, "value")};
    const ActionRole* of = role(e, "role", a);
    if (of == nullptr) return;
    const auto known = attributes_of(of->type);
    if (!known.empty() && std::find(known.begin(), known.end(), c.attribute) == known.end())
      fail(e, "no " + of->type + " has an attribute `" + c.attribute + "`",
           "known: " + listed(known, [](const std::string& name) { return name; }));
    into.push_back(c);
  }

  void move(const Element* e, WorldAction& a) {
    const RoleMove m{text(e, "role", true), text(e, "to", true)};
    if (role(e, "role", a) == nullptr) return;
    if (m.to != "robot" && m.to != "away" && (named(a.roles, m.to) == a.roles.end() || m.to == m.role))
      fail(e, "`to` is \"" + m.to + "\"", "use robot, away or another role: " + names(a.roles));
    a.moves.push_back(m);
  }

  void action(const Element* e) {
    WorldAction a;
    a.name = word(e, "name");
    a.cost_s = quantity(e, "cost", Dimension::time);
    if (a.cost_s < 0 || a.cost_s > 1e6) fail(e, "`cost` must lie in 0..1000000 s", "correct it");
    a.reach_m = quantity(e, "reach", Dimension::length, a.reach_m);
    if (a.reach_m <= 0 || a.reach_m > 100) fail(e, "`reach` must lie in (0, 100 m]", "correct it");
    if (named(world.actions, a.name) != world.actions.end())
      fail(e, "action `" + a.name + "` exists already", "choose another name");
    for (const Element* c = e->FirstChildElement("role"); c != nullptr; c = c->NextSiblingElement("role"))
      a.roles.push_back({word(c, "name"), word(c, "type")});
    if (a.roles.empty() || a.roles.size() > kMostRoles)
      fail(e, "action `" + a.name + "` has " + std::to_string(a.roles.size()) + " roles", "give it 1 to 4");
    for (const Element* c = e->FirstChildElement(); c != nullptr && !error; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (kind == "pre") condition(c, a, a.pre);
      else if (kind == "post") condition(c, a, a.post);
      else if (kind == "move") move(c, a);
      else if (kind != "role") unknown(c, "role, pre, post, move");
    }
    for (const RoleMove& m : a.moves)
      if (std::any_of(a.moves.begin(), a.moves.end(), [&](const RoleMove& other) { return other.role == m.to; }))
        fail(e, "action `" + a.name + "` moves `" + m.to + "` and something onto it", "make them two actions");
    world.actions.push_back(std::move(a));
  }

  /// The object that something happens to; null after an error.
  const WorldObject* object_of(const Element* e) {
    const std::string name = text(e, "object", true);
    const auto object = named(world.objects, name);
    if (object != world.objects.end()) return &*object;
    fail(e, "no object `" + name + "`", "known: " + names(world.objects));
    return nullptr;
  }

  /// Along waypoints, looking ahead, as events every 100 ms.
  void walk(const Element* e) {
    constexpr double kStep_s = 0.1;
    WorldEvent v;
    v.at_s = quantity(e, "from", Dimension::time);
    const double speed = quantity(e, "speed", Dimension::speed);
    const WorldObject* object = object_of(e);
    if (v.at_s < 0 || v.at_s > 1e9) fail(e, "`from` must lie in 0..1000000000 s", "count from the begin of the run");
    if (speed <= 0 || speed > 3) fail(e, "`speed` must lie in (0, 3 m/s]", "correct it");
    std::vector<Vec2> corners;
    for (const Element* w = e->FirstChildElement(); w != nullptr && !error; w = w->NextSiblingElement()) {
      if (std::string(w->Name()) != "waypoint") return unknown(w, "waypoint");
      corners.emplace_back(quantity(w, "x", Dimension::length), quantity(w, "y", Dimension::length));
    }
    if (corners.size() < 2) fail(e, "a walk needs at least two waypoints", "add <waypoint x=... y=.../>");
    if (error) return;
    v.object = object->name;
    double along = 0;  // of the present piece
    for (size_t i = 0; i + 1 < corners.size(); ++i) {
      const Vec2 piece = corners[i + 1] - corners[i];
      v.yaw_rad = std::atan2(piece.y(), piece.x());
      for (; along < piece.norm(); along += speed * kStep_s, v.at_s += kStep_s) {
        v.position = corners[i] + along * piece.normalized();
        world.events.push_back(v);
      }
      along -= piece.norm();
    }
    v.position = corners.back();
    world.events.push_back(v);
  }

  void event(const Element* e) {
    WorldEvent v;
    v.at_s = quantity(e, "at", Dimension::time);
    if (v.at_s < 0 || v.at_s > 1e9) fail(e, "`at` must lie in 0..1000000000 s", "count from the begin of the run");
    const WorldObject* object = object_of(e);
    if (object == nullptr) return;
    v.object = object->name;
    const bool sets = e->Attribute("attr") != nullptr, goes = e->Attribute("to") != nullptr,
               moves = e->Attribute("x") != nullptr;
    if (sets + goes + moves != 1)
      return fail(e, "an event is one thing that happens", "give attr and value, x and y, or to=\"away\"");
    if (sets) {
      v.attribute = word(e, "attr");
      v.value = word(e, "value");
      if (object->attributes.count(v.attribute) == 0)
        fail(e, "object `" + v.object + "` has no attribute `" + v.attribute + "`",
             "known: " + listed(object->attributes, [](const auto& attribute) { return attribute.first; }));
    } else if (goes) {
      v.away = true;
      if (text(e, "to", true) != "away") fail(e, "`to` is \"" + text(e, "to", true) + "\"", "use away, or x and y");
    } else {
      v.position = Vec2(quantity(e, "x", Dimension::length), quantity(e, "y", Dimension::length));
      v.yaw_rad = quantity(e, "yaw", Dimension::angle, object->yaw_rad);
    }
    world.events.push_back(v);
  }

  void map(const Element* root, const std::filesystem::path& path) {
    const double cell = quantity(root, "resolution", Dimension::length);
    if (error) return;
    if (cell < 0.005 || cell > 1.0) return fail(root, "`resolution` must lie in 0.005..1 m", "correct it");
    const Element* rows = root->FirstChildElement("rows");
    const std::string name = text(root, "map", rows == nullptr);
    if (error) return;
    auto bitmap = rows != nullptr ? parse_rows(rows->GetText() != nullptr ? rows->GetText() : "", cell)
                                  : load_pgm(path.parent_path() / name, cell);
    if (!bitmap) return fail(rows != nullptr ? rows : root, bitmap.error(), "correct the map");
    world.map = std::move(*bitmap);
  }

  void root(const Element* e, const std::filesystem::path& path) {
    world.name = text(e, "name", false, path.stem().string());
    world.wall_height_m = quantity(e, "wall_height", Dimension::length, 2.8);
    world.floor = material(e, "floor", Material::floor);
    world.wall = material(e, "wall", Material::plaster);
    world.ceiling = material(e, "ceiling", Material::ceiling);
    map(e, path);
    for (const Element* c = e->FirstChildElement(); c != nullptr && !error; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (kind == "client") client(c);
      else if (kind == "object") object(c);
      else if (kind == "line") line(c);
      else if (kind == "terrain") terrain(c);
      else if (kind != "rows" && kind != "action" && kind != "event" && kind != "walk")
        unknown(c, "rows, client, object, terrain, line, action, event, walk");
    }
    // What can happen to objects is read when all are known.
    for (const Element* c = e->FirstChildElement(); c != nullptr && !error; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (kind == "action") action(c);
      else if (kind == "event") event(c);
      else if (kind == "walk") walk(c);
    }
    std::stable_sort(world.events.begin(), world.events.end(),
                     [](const WorldEvent& a, const WorldEvent& b) { return a.at_s < b.at_s; });
    if (!error && world.clients.empty()) fail(e, "no <client>, so no robot", "add <client name=... x=... y=.../>");
    for (const Client& c : world.clients) {
      if (!error && collides(world, Vec2(c.x_m, c.y_m), 0.3))
        fail(e, "client `" + c.name + "` starts inside an obstacle", "move it");
    }
  }
};

}  // namespace

tl::expected<World, DeviceError> load_world(const std::string& device_id, const std::filesystem::path& file) {
  if (const std::string why = why_unreadable(file, kLargestText); !why.empty())
    return device_error(device_id, file.string() + ": the world file " + why, "correct `world:` of the device");
  tinyxml2::XMLDocument document;
  if (document.LoadFile(file.string().c_str()) != tinyxml2::XML_SUCCESS)
    return device_error(device_id,
                        file.string() + ":" + std::to_string(document.ErrorLineNum()) + ": no well-formed XML",
                        "correct the XML");
  Loader loader{device_id, file.string(), {}, {}};
  const Element* root = document.RootElement();
  if (std::string(root->Name()) != "world") loader.fail(root, "the root element is not <world>", "see worlds/lab.xml");
  else loader.root(root, file);
  if (loader.error) return tl::unexpected(*loader.error);
  return std::move(loader.world);
}

}  // namespace takt::sim
