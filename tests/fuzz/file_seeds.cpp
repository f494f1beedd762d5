// SPDX-License-Identifier: Apache-2.0
// Small whole files of each form that the readers of files know.
#include <span>

#include "rt/record/mcap/records.hpp"
#include "rt/record/mcap/writer.hpp"
#include "tests/fuzz/seeds.hpp"

namespace takt::fuzz {
namespace {

Bytes of(std::string_view text) { return {text.begin(), text.end()}; }

template <class... Values>
std::string raw(const Values&... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

struct MemorySink final : mcap::Sink {
  std::vector<std::byte> bytes;
  tl::expected<void, std::string> append(std::span<const mcap::Bytes> parts) override {
    for (const mcap::Bytes part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
    return {};
  }
};

void mcap_seeds(Seeds& seeds) {
  const auto add = [&](const std::vector<std::byte>& bytes) {
    const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
    seeds.add_and_spoil({data, data + bytes.size()});
  };
  for (const auto compression : {mcap::Compression::none, mcap::Compression::zstd}) {
    MemorySink sink;
    mcap::Writer writer(sink, {256, compression, 1});
    static_cast<void>(writer.begin("", "seed"));
    writer.add_channel(writer.add_schema("pose", "json", "{}"), "a.b", "takt", {{"fields", "all"}});
    static_cast<void>(writer.metadata("takt", {{"format", "2"}}));
    static_cast<void>(writer.attach({1, 2, "plan.json", "text/plain", mcap::bytes_of("{}")}));
    for (uint32_t i = 0; i < 20; ++i)
      static_cast<void>(writer.write({1, i, i, i, mcap::bytes_of("a message of a port")}));
    static_cast<void>(writer.finish());
    add(sink.bytes);
  }
  // As others write: definitions between loose messages, an lz4 chunk (one stored block), an unknown record.
  std::vector<std::byte> loose;
  mcap::ByteWriter to(loose);
  to.bytes(std::as_bytes(std::span(mcap::kMagic)));
  put(loose, mcap::Channel{0, 0, "a", "json", {}});
  put(loose, mcap::Message{0, 1, 2, 3, mcap::bytes_of("{}")});
  mcap::put_record(loose, static_cast<mcap::Op>(0x90), [](mcap::ByteWriter& fields) { fields.text("private"); });
  std::vector<std::byte> inside;
  put(inside, mcap::Channel{9, 0, "b", "takt", {}});
  put(inside, mcap::Message{9, 1, 2, 3, mcap::bytes_of("data")});
  const std::string frame = raw(uint32_t{0x184D2204}, uint8_t{0x60}, uint8_t{0x40}, uint8_t{0x82},
                                static_cast<uint32_t>(inside.size()) | 0x80000000U) +
                            std::string(reinterpret_cast<const char*>(inside.data()), inside.size()) + raw(uint32_t{0});
  mcap::ChunkIndex chunk;
  chunk.compression = "lz4";
  chunk.uncompressed_size = inside.size();
  chunk.compressed_size = frame.size();
  put_chunk_head(loose, chunk, 0);
  to.bytes(mcap::bytes_of(frame));
  mcap::put_record(loose, mcap::Op::data_end, [](mcap::ByteWriter& fields) { fields.number(uint32_t{0}); });
  add(loose);
}

void cloud_seeds(Seeds& seeds) {
  const std::string xyz = "property float x\nproperty double y\nproperty short z\n";
  const std::string colour = "property ushort red\nproperty ushort green\nproperty ushort blue\n";
  seeds.add_and_spoil(
      of("ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + colour +
         "element face 1\nproperty list uchar int i\nend_header\n1 2 3 4 5 600\n1e-46 5312345.678 3 4 5 6\n3 0 1 1\n"));
  seeds.add(of("ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "end_header\n1 2 3 4\n5 6"));
  for (const char* order : {"little", "big"})
    seeds.add_and_spoil(of("ply\nformat binary_" + std::string(order) + "_endian 1.0\nelement vertex 1\n" + xyz +
                           colour + "end_header\n" + raw(1.f, 2.0, int16_t{3}, uint16_t{4}, uint16_t{5}, uint16_t{6})));
  const std::string pcd =
      "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ";
  seeds.add_and_spoil(of(pcd + "ascii\n1 2 3 4.2e6\nnan nan nan 0\n"));
  seeds.add_and_spoil(of(pcd + "binary\n" + raw(1.f, 2.f, 3.f, 4U, 5.f, 6.f, 7.f, 8U)));
  std::string packed;
  for (const float value : {1.f, 2.f, 3.f, 4.f}) packed += char{3} + raw(value) + std::string{char{0x40}, char{3}};
  seeds.add_and_spoil(
      of(pcd + "binary_compressed\n" + raw(static_cast<uint32_t>(packed.size()), uint32_t{32}) + packed));
}

/// Frames as tests/fuzz/web.cpp reads them.
void web_seeds(Seeds& seeds) {
  const auto frames = [](uint8_t who, const std::vector<std::string>& texts, bool binary = false) {
    std::string all(1, static_cast<char>(who));
    for (const std::string& text : texts)
      all += raw(static_cast<uint8_t>(binary), static_cast<uint16_t>(text.size())) + text;
    return of(all);
  };
  const std::vector<std::string> page{
      R"({"op": "token", "token": "secret"})", R"({"op": "look", "port": "eye.pair", "as": "picture", "most_hz": 15})",
      R"({"op": "ask", "id": 1, "question": {"do": "set", "param": "eye.gain", "value": "0.2 s", "keep": true}})",
      R"({"op": "ask", "id": 2, "question": {"do": "fault", "device": "eye", "fault": "silent", "on": true}})",
      R"({"op": "leave", "port": "eye.pair", "as": "picture"})"};
  const std::vector<std::string> foxglove{
      R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}, {"id": 2, "channelId": 0}]})",
      R"({"op": "getParameters", "parameterNames": [], "id": "a"})",
      R"({"op": "setParameters", "parameters": [{"name": "eye.gain", "value": 0.2}], "id": "b"})",
      R"({"op": "subscribeParameterUpdates", "parameterNames": ["eye.gain"]})",
      R"({"op": "subscribeConnectionGraph"})",
      R"({"op": "unsubscribe", "subscriptionIds": [1]})"};
  seeds.add_and_spoil(frames(0, page));
  seeds.add_and_spoil(frames(4, page));
  for (const uint8_t who : {uint8_t{1}, uint8_t{3}}) {
    seeds.add_and_spoil(frames(who, foxglove));
    seeds.add_and_spoil(
        frames(who, {"\2" + raw(uint32_t{0}, uint32_t{9}, uint32_t{4}) + "json{\"mode\": \"rest\"}"}, true));
  }
}

void carmen_seeds(Seeds& seeds) {
  const std::string odom = "ODOM 1 2 0.5 0 0 0 1.5 host 1.5\n", pose = " 1 2 0.5 1 2 0.5";
  seeds.add_and_spoil(of("# a log\nPARAM robot_frontlaser_offset 0.1 host 0\n" + odom + "FLASER 3 1 inf 2" + pose +
                         " 1.6 host 1.6\n" + odom + "NEFF 1\n"));
  seeds.add_and_spoil(of("RAWLASER1 0 -1.5 3 0.02 25 0.01 0 2 1 1 1 7 1 host 1\n" + odom));
  seeds.add_and_spoil(of("ROBOTLASER1 0 -1.5 3 0.02 25 0.01 0 2 1 1 0" + pose +
                         " 0 0 1 1 1e6 1134864990.5 host 1.13486e+09\n"
                         "ROBOTLASER1 0 -1.5 3 0.02 25 0.01 0 2 1 2 0" +
                         pose + " 0 0 1 1 1e6 1134864990.7 host 1.13486e+09\n"));
}

void calibration_seeds(Seeds& seeds) {
  const auto matrix = [](const std::string& key, int rows, int columns, const std::string& data) {
    return key + ": !!opencv-matrix\n   rows: " + std::to_string(rows) + "\n   cols: " + std::to_string(columns) +
           "\n   dt: d\n   data: [ " + data + " ]\n";
  };
  const std::string k = "410., 0., 322., 0., 411., 241., 0., 0., 1.", d = "0., 0., 0., 0.",
                    one = "1., 0., 0., 0., 1., 0., 0., 0., 1.";
  seeds.add_and_spoil(of("%YAML:1.0\n---\nimage_size: [ 640, 480 ]\n" + matrix("M1", 3, 3, k) + matrix("D1", 1, 4, d) +
                         matrix("M2", 3, 3, k) + matrix("D2", 1, 4, d) + matrix("R", 3, 3, one) +
                         matrix("T", 3, 1, "-0.1, 0., 0.")));
  const std::string camera =
      "  camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n"
      "  intrinsics: [410, 411, 322, 241]\n  resolution: [640, 480]\n";
  seeds.add_and_spoil(of("cam0:\n" + camera + "cam1:\n" + camera +
                         "  T_cn_cnm1:\n  - [1, 0, 0, -0.2]\n  - [0, 1, 0, 0]\n"
                         "  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"));
  seeds.add_and_spoil(
      of("image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, data: [410, 0, 322, 0, 411, 241, 0, "
         "0, 1]}\n"
         "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
         "projection_matrix: {rows: 3, cols: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}\n"));
  seeds.add_and_spoil(
      of("T_BS: {rows: 4, cols: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\nresolution: [640, 480]\n"
         "intrinsics: [1, 2, 3, 4]\n"));
}

void image_seeds(Seeds& seeds) {
  seeds.add_and_spoil(of("P5\n# 10 bits\n2 2\n1023\n" + std::string{0, 1, 2, 3, 3, 127, 0, 9}));
  seeds.add_and_spoil(of("P2\n2 2\n15\n0 5\n10 15\n"));
  seeds.add_and_spoil(of("P6\n1 2\n255\nabcdef"));
  seeds.add(of("P5\n60000 60000\n65535\n"));
  // 1 x 1, 16 bits, sBIT 12.
  const unsigned char png[]{0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A, 0x00, 0x00, 0x00, 0x0D, 0x49, 0x48,
                            0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x10, 0x00, 0x00, 0x00,
                            0x00, 0x6A, 0xEE, 0x47, 0x16, 0x00, 0x00, 0x00, 0x01, 0x73, 0x42, 0x49, 0x54, 0x0C,
                            0xE1, 0x67, 0x9F, 0x80, 0x00, 0x00, 0x00, 0x0B, 0x49, 0x44, 0x41, 0x54, 0x78, 0xDA,
                            0x63, 0xE0, 0xFF, 0x0F, 0x00, 0x01, 0x20, 0x01, 0x0F, 0xEC, 0xF0, 0xFF, 0xC4, 0x00,
                            0x00, 0x00, 0x00, 0x49, 0x45, 0x4E, 0x44, 0xAE, 0x42, 0x60, 0x82};
  seeds.add_and_spoil({std::begin(png), std::end(png)});
}

/// Graph, form feed, schedule.
void graph_seeds(Seeds& seeds) {
  constexpr std::string_view graph =
      "takt: 1\nname: tiny\nconstants: {far: 20m}\ndefault_profile: sim\n"
      "devices:\n  eye: {kind: sensor, rate: 15, mount: {x: 30cm}, in: {wanted: b.out}}\n"
      "profiles:\n  sim: {default: {driver: sim}, set: {a.count: 3}}\n"
      "subsystems:\n  one:\n    exports: [a.out]\n    spare: true\n"
      "    a: {type: relay, in: {in: {from: eye.motion, depth: 3, max_age: 150ms}}, params: {range: '${far}'}}\n"
      "  two:\n    b: {type: relay, in: {in: a.out}, params: {table: x}}\n"
      "chains:\n  c: {from: eye.motion, to: b.out, max_age: 300ms}\n"
      "modes:\n  short: {without: [b]}\n  safe_stop: {lost: [eye]}\n"
      "expect:\n  within: 3s\n  all:\n    - {port: b.out, messages: 3, from: 1s}\n    - {port: a.out, field: yaw_rad, "
      "at_least: 10deg}\n  rates: {a: 14}\n";
  constexpr std::string_view schedule =
      "\ftakt: 1\nname: s\npolicy: deadline\ncores: [0, 1]\n"
      "nodes:\n  eye: {rate: 15, deadline: 20ms, budget: 1ms}\n  a: {rate: 1/3, offset: 2ms, criticality: high, "
      "on_miss: "
      "safe_stop, memory: 2MB}\n  b: {on: a.out, every: 2, min_interval: 1ms, deadline: 30ms, publish: let}\n";
  seeds.add_and_spoil(of(std::string(graph) + std::string(schedule)));
  seeds.add(of(std::string(graph)));
  seeds.add(of("include: [other.yaml]\n" + std::string(graph) + std::string(schedule)));
}

}  // namespace

size_t file_seeds(const std::filesystem::path& folder) {
  size_t count = 0;
  const auto make = [&](const char* name, void (*fill)(Seeds&)) {
    Seeds seeds(folder / name);
    fill(seeds);
    count += seeds.count();
  };
  make("mcap", mcap_seeds);
  make("cloud", cloud_seeds);
  make("web", web_seeds);
  make("carmen", carmen_seeds);
  make("calibration", calibration_seeds);
  make("image", image_seeds);
  make("graph", graph_seeds);
  return count;
}

}  // namespace takt::fuzz
