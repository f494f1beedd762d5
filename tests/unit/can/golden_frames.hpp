// SPDX-License-Identifier: Apache-2.0
// Frames of the camera head as bytes: what they say, which of them must be refused and how, and the error frames that
// SocketCAN's drivers make. Bytes as `struct can_frame` has them, in hexadecimal.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/can/end_to_end.hpp"

namespace takt::test {

struct GoldenFrame {
  std::string_view name, message;
  uint32_t id;
  std::string_view data;
  int counter;                                              ///< -1: not protected
  std::vector<std::pair<std::string_view, double>> values;  ///< of its signals; the others are 0
};
inline const std::vector<GoldenFrame>& golden_frames() {
  static const std::vector<GoldenFrame> frames = {
      {"nmt_start", "NMT_Command", 0x000, "0110", -1, {{"NMT_Cmd", 1}, {"NMT_Node", 16}}},
      {"nmt_reset", "NMT_Command", 0x000, "8110", -1, {{"NMT_Cmd", 129}, {"NMT_Node", 16}}},
      {"sync_1", "SYNC", 0x080, "01", -1, {{"SYNC_Counter", 1}}},
      {"hb_boot", "HEAD_Heartbeat", 0x710, "00", -1, {{"HB_HeadState", 0}}},
      {"hb_preop", "HEAD_Heartbeat", 0x710, "7F", -1, {{"HB_HeadState", 127}}},
      {"hb_op", "HEAD_Heartbeat", 0x710, "05", -1, {{"HB_HeadState", 5}}},
      {"host_hb", "HOST_Heartbeat", 0x701, "05", -1, {{"HB_HostState", 5}}},
      {"sp_home",
       "HEAD_Setpoint",
       0x210,
       "0F40000000001E14",
       0,
       {{"SP_Mode", 4}, {"SP_MaxVel", 30}, {"SP_MaxAcc", 200}}},
      {"sp_pos_1",
       "HEAD_Setpoint",
       0x210,
       "EE11B80BE6FB5A32",
       1,
       {{"SP_Mode", 1}, {"SP_PanPos", 30}, {"SP_TiltPos", -10.5}, {"SP_MaxVel", 90}, {"SP_MaxAcc", 500}}},
      {"sp_pos_2",
       "HEAD_Setpoint",
       0x210,
       "4D1220D19411C8C8",
       2,
       {{"SP_Mode", 1}, {"SP_PanPos", -120}, {"SP_TiltPos", 45}, {"SP_MaxVel", 200}, {"SP_MaxAcc", 2000}}},
      {"sp_hold", "HEAD_Setpoint", 0x210, "E43E000000000000", 14, {{"SP_Mode", 3}}},
      {"sp_wrap", "HEAD_Setpoint", 0x210, "E530000000000000", 0, {{"SP_Mode", 3}}},
      {"sp_quick", "HEAD_Setpoint", 0x210, "7DF3000000000000", 3, {{"SP_Mode", 15}}},
      {"sp_fault_reset", "HEAD_Setpoint", 0x210, "4AE4000000000000", 4, {{"SP_Mode", 14}}},
      {"sv_1",
       "HEAD_VelSetpoint",
       0x310,
       "ED053AEEC9040A00",
       5,
       {{"SV_PanVel", -45.5}, {"SV_TiltVel", 12.25}, {"SV_Timeout", 100}}},
      {"el_blink",
       "EYELID_Setpoint",
       0x410,
       "6420C8C878000511",
       0,
       {{"EL_Action", 2},
        {"EL_LeftPos", 100},
        {"EL_RightPos", 100},
        {"EL_MoveTime", 120},
        {"EL_HoldTime", 50},
        {"EL_Repeat", 1},
        {"EL_Token", 1}}},
      {"el_half",
       "EYELID_Setpoint",
       0x410,
       "8611646490010020",
       1,
       {{"EL_Action", 1}, {"EL_LeftPos", 50}, {"EL_RightPos", 50}, {"EL_MoveTime", 400}, {"EL_Token", 2}}},
      {"el_wink",
       "EYELID_Setpoint",
       0x410,
       "CD32C80096001431",
       2,
       {{"EL_Action", 3},
        {"EL_LeftPos", 100},
        {"EL_MoveTime", 150},
        {"EL_HoldTime", 200},
        {"EL_Repeat", 1},
        {"EL_Token", 3}}},
      {"ps_idle",
       "HEAD_PosStatus",
       0x190,
       "6540000000000F02",
       0,
       {{"PS_State", 4},
        {"PS_PanReached", 1},
        {"PS_TiltReached", 1},
        {"PS_PanHomed", 1},
        {"PS_TiltHomed", 1},
        {"PS_ServoPower", 1}}},
      {"ps_move",
       "HEAD_PosStatus",
       0x190,
       "E841B50BE6FB0E02",
       1,
       {{"PS_State", 4},
        {"PS_PanPos", 29.97},
        {"PS_TiltPos", -10.5},
        {"PS_TiltReached", 1},
        {"PS_PanHomed", 1},
        {"PS_TiltHomed", 1},
        {"PS_ServoPower", 1}}},
      {"ps_stale",
       "HEAD_PosStatus",
       0x190,
       "BC52FFFF00000C0A",
       2,
       {{"PS_State", 5},
        {"PS_PanPos", -0.01},
        {"PS_PanHomed", 1},
        {"PS_TiltHomed", 1},
        {"PS_ServoPower", 1},
        {"PS_SetpointStale", 1}}},
      {"ps_estop",
       "HEAD_PosStatus",
       0x190,
       "6213000000000C05",
       3,
       {{"PS_State", 1}, {"PS_EStop", 1}, {"PS_Brake", 1}, {"PS_PanHomed", 1}, {"PS_TiltHomed", 1}}},
      {"ps_fault",
       "HEAD_PosStatus",
       0x190,
       "2C74762F00002CC0",
       4,
       {{"PS_State", 7},
        {"PS_PanPos", 121.5},
        {"PS_PanLimPos", 1},
        {"PS_FollowError", 1},
        {"PS_Fault", 1},
        {"PS_PanHomed", 1},
        {"PS_TiltHomed", 1}}},
      {"vs_1",
       "HEAD_VelStatus",
       0x290,
       "43011E23FFFF3930",
       1,
       {{"VS_PanVel", 89.9}, {"VS_TiltVel", -0.01}, {"VS_SampleTime", 1234.5}}},
      {"es_blink",
       "EYELID_Status",
       0x390,
       "DC30A09F23227801",
       0,
       {{"ES_State", 3},
        {"ES_LeftPos", 80},
        {"ES_RightPos", 79.5},
        {"ES_LeftCurrent", 350},
        {"ES_RightCurrent", 340},
        {"ES_ServoVolt", 6},
        {"ES_BlinkCount", 1}}},
      {"es_off", "EYELID_Status", 0x390, "DC01000000000001", 1, {{"ES_State", 0}, {"ES_BlinkCount", 1}}},
      {"hh_1",
       "HEAD_Health",
       0x490,
       "7500514E7811100E",
       0,
       {{"HH_PanTemp", 41}, {"HH_TiltTemp", 38}, {"HH_SupplyVolt", 24}, {"HH_SupplyCurr", 1.7}, {"HH_Uptime", 3600}}},
      {"hl_0",
       "HEAD_Limits",
       0x4D0,
       "DF0020D1E02EC800",
       0,
       {{"HL_Page", 0}, {"HL_PanMin", -120}, {"HL_PanMax", 120}, {"HL_PanMargin", 2}}},
      {"hl_1",
       "HEAD_Limits",
       0x4D0,
       "2C116CEE9411C800",
       1,
       {{"HL_Page", 1}, {"HL_TiltMin", -45}, {"HL_TiltMax", 45}, {"HL_TiltMargin", 2}}},
      {"hl_2",
       "HEAD_Limits",
       0x4D0,
       "DB22204E983A1027",
       2,
       {{"HL_Page", 2}, {"HL_PanMaxVel", 200}, {"HL_TiltMaxVel", 150}, {"HL_MaxAcc", 1000}}},
      {"em_follow",
       "HEAD_EMCY",
       0x090,
       "11862101762F0000",
       -1,
       {{"EM_Code", 34321}, {"EM_Register", 33}, {"EM_Axis", 1}, {"EM_Data", 12150}}},
      {"em_hbloss",
       "HEAD_EMCY",
       0x090,
       "3081110000000000",
       -1,
       {{"EM_Code", 33072}, {"EM_Register", 17}, {"EM_Axis", 0}}},
      {"em_undervolt",
       "HEAD_EMCY",
       0x090,
       "2031050000000000",
       -1,
       {{"EM_Code", 12576}, {"EM_Register", 5}, {"EM_Axis", 0}}},
      {"em_reset", "HEAD_EMCY", 0x090, "0000000000000000", -1, {{"EM_Code", 0}, {"EM_Register", 0}}},
  };
  return frames;
}

/// PosStatus frames that must not be used, and what finds it.
struct RefusedFrame {
  std::string_view name, data;
  enum Reason { crc, counter_or_length, range } reason;
};
inline constexpr RefusedFrame kRefusedFrames[] = {
    {"bad_bit", "E841B54BE6FB0E02", RefusedFrame::crc},
    {"bad_crc", "E941B50BE6FB0E02", RefusedFrame::crc},
    {"masquerade", "0941B50BE6FB0E02", RefusedFrame::crc},
    {"counter_15", "E94FB50BE6FB0E02", RefusedFrame::counter_or_length},
    {"short_dlc", "E841B50BE6FB0E", RefusedFrame::counter_or_length},
    {"range", "AF45B44600000000", RefusedFrame::range},
};

/// PosStatus frames in a row, and what the receiver says of each.
struct FrameSequence {
  std::string_view name;
  std::vector<std::string_view> frames, verdicts;
};
inline const std::vector<FrameSequence>& frame_sequences() {
  static const std::vector<FrameSequence> sequences = {
      {"counter_ok",
       {"7D4C000000000002", "204D000000000002", "C74E000000000002", "C640000000000002", "9B41000000000002"},
       {"INITIAL", "OK", "OK", "OK", "OK"}},
      {"repeat",
       {"2143000000000002", "AF44000000000002", "AF44000000000002", "F245000000000002"},
       {"INITIAL", "OK", "REPEATED", "OK"}},
      {"lost2", {"2143000000000002", "1546000000000002", "4847000000000002"}, {"INITIAL", "OKSOMELOST", "OK"}},
      {"lost_many", {"2143000000000002", "4949000000000002", "AE4A000000000002"}, {"INITIAL", "WRONGSEQUENCE", "OK"}},
      {"wrap_lost", {"204D000000000002", "9B41000000000002"}, {"INITIAL", "OKSOMELOST"}},
  };
  return sequences;
}

struct ErrorFrame {
  std::string_view name, wire;
};
inline constexpr ErrorFrame kErrorFrames[] = {
    {"tx_warning", "04000020080000000008000000006000"},     {"tx_passive", "04000020080000000020000000008000"},
    {"tx_passive_cnt", "04020020080000000020000000008000"}, {"rx_passive", "04020020080000000010000000000080"},
    {"recovered", "04020020080000000040000000005F00"},      {"rx_overflow", "04000020080000000001000000000000"},
    {"bus_off", "40000020080000000000000000000000"},        {"restarted", "00010020080000000000000000000000"},
    {"no_ack", "20000020080000000000000000000000"},         {"tx_timeout", "01000020080000000000000000000000"},
    {"prot_stuff", "88000020080000000000040A00000000"},     {"lost_arb", "02000020080000000500000000000000"},
};

/// A verdict in the words of the sequences.
inline std::string_view word(can::EndToEndStatus status) {
  switch (status) {
    case can::EndToEndStatus::initial: return "INITIAL";
    case can::EndToEndStatus::ok: return "OK";
    case can::EndToEndStatus::ok_some_lost: return "OKSOMELOST";
    case can::EndToEndStatus::repeated: return "REPEATED";
    case can::EndToEndStatus::wrong_sequence: return "WRONGSEQUENCE";
    case can::EndToEndStatus::wrong_crc: return "WRONGCRC";
    case can::EndToEndStatus::invalid: return "INVALID";
  }
  return "?";
}

inline std::vector<uint8_t> bytes_of(std::string_view hexadecimal) {
  const auto digit = [](char c) { return static_cast<uint8_t>(c <= '9' ? c - '0' : c - 'A' + 10); };
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i + 1 < hexadecimal.size(); i += 2)
    bytes.push_back(static_cast<uint8_t>(digit(hexadecimal[i]) << 4 | digit(hexadecimal[i + 1])));
  return bytes;
}

}  // namespace takt::test
