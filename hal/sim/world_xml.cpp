// SPDX-License-Identifier: Apache-2.0
#include <tinyxml2.h>

#include "hal/settings/units.hpp"
#include "hal/sim/world.hpp"

namespace takt::sim {
namespace {

using Element = tinyxml2::XMLElement;

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
    o.name = text(e, "name", true);
    o.type = text(e, "type", true);
    o.position = Vec2(quantity(e, "x", Dimension::length), quantity(e, "y", Dimension::length));
    o.yaw_rad = quantity(e, "yaw", Dimension::angle, 0.0);
    for (const WorldObject& other : world.objects) {
      if (other.name == o.name) fail(e, "object `" + o.name + "` exists already", "choose another name");
    }
    for (const Element* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (kind == "attr") {
        o.attributes[text(c, "name", true)] = text(c, "value", true);
      } else if (kind == "box") {
        o.box = Box{quantity(c, "width", Dimension::length), quantity(c, "depth", Dimension::length),
                    quantity(c, "height", Dimension::length), quantity(c, "z", Dimension::length, 0.0),
                    material(c, "material", Material::wood)};
        if (o.box->width_m <= 0 || o.box->depth_m <= 0 || o.box->height_m <= 0)
          fail(c, "a box needs positive sizes", "correct them");
      } else if (kind == "person") {
        o.person = Person{quantity(c, "height", Dimension::length, 1.75), c->Attribute("pointing") != nullptr,
                          quantity(c, "pointing", Dimension::angle, 0.0)};
        if (o.person->height_m < 0.5 || o.person->height_m > 2.5)
          fail(c, "`height` must lie in 0.5..2.5 m", "correct it");
      } else if (kind == "board") {
        board(c, o);
      } else {
        unknown(c, "attr, box, person, board");
      }
    }
    world.objects.push_back(o);
  }

  void board(const Element* e, WorldObject& o) {
    const double edge = quantity(e, "edge", Dimension::length), z = quantity(e, "z", Dimension::length);
    const std::string name = text(e, "picture", true);
    if (error) return;
    if (edge <= 0) return fail(e, "`edge` must be positive", "correct it");
    auto picture = load_picture(std::filesystem::path(file).parent_path() / name, edge);
    if (!picture) return fail(e, picture.error(), "correct the picture");
    o.board = Board{edge, z, std::make_shared<const Texture>(std::move(*picture))};
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

  void action(const Element* e) {
    WorldAction a;
    a.name = text(e, "name", true);
    a.cost_s = quantity(e, "cost", Dimension::time);
    for (const Element* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (kind == "role") a.roles[text(c, "name", true)] = text(c, "type", true);
      else if (kind == "pre") a.pre.push_back({text(c, "role", true), text(c, "attr", true), text(c, "value", true)});
      else if (kind == "post") a.post.push_back({text(c, "role", true), text(c, "attr", true), text(c, "value", true)});
      else unknown(c, "role, pre, post");
    }
    for (const auto* list : {&a.pre, &a.post}) {
      for (const RoleCondition& condition : *list) {
        if (a.roles.count(condition.role) == 0)
          fail(e, "action `" + a.name + "` has no role `" + condition.role + "`", "declare it with <role>");
      }
    }
    world.actions.push_back(a);
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
      else if (kind == "action") action(c);
      else if (kind != "rows") unknown(c, "rows, client, object, line, action");
    }
    if (!error && world.clients.empty()) fail(e, "no <client>, so no robot", "add <client name=... x=... y=.../>");
    for (const Client& c : world.clients) {
      if (!error && collides(world, Vec2(c.x_m, c.y_m), 0.3))
        fail(e, "client `" + c.name + "` starts inside an obstacle", "move it");
    }
  }
};

}  // namespace

tl::expected<World, DeviceError> load_world(const std::string& device_id, const std::filesystem::path& file) {
  tinyxml2::XMLDocument document;
  if (document.LoadFile(file.string().c_str()) != tinyxml2::XML_SUCCESS) {
    const bool missing = document.ErrorID() == tinyxml2::XML_ERROR_FILE_NOT_FOUND;
    return device_error(device_id,
                        file.string() + (missing ? ": the world file cannot be opened"
                                                 : std::string(":").append(std::to_string(document.ErrorLineNum())) +
                                                       ": no well-formed XML"),
                        missing ? "correct `world:` of the device" : "correct the XML");
  }
  Loader loader{device_id, file.string(), {}, {}};
  const Element* root = document.RootElement();
  if (std::string(root->Name()) != "world") loader.fail(root, "the root element is not <world>", "see worlds/lab.xml");
  else loader.root(root, file);
  if (loader.error) return tl::unexpected(*loader.error);
  return std::move(loader.world);
}

}  // namespace takt::sim
