#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/decode.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kNodeMask = 0x7F;
constexpr std::uint32_t kFunctionMask = 0x780;

struct Options {
  int bits = 0;  // 0: not given
  int turn_bits = 0;
  std::optional<std::uint32_t> cob_id;
  std::optional<std::uint32_t> node;
};

Result<Options> ReadOptions(const DecodeSettings& settings) {
  Options options;
  const std::array<DecodeOption, 5> known = {
      {NumberOption("bits", options.bits, 8, 28),
       NumberOption("turn_bits", options.turn_bits, 0, 16),
       NumberOption("cob_id", options.cob_id, 0, 0x7FF, "TPDO1's identifier, 0x181..0x57f"),
       NumberOption("node", options.node, kMinNode, kMaxNode),
       {"model", "cia406", [](const std::string&) { return true; }}}};
  if (const Result<> applied = ApplySettings("saa_can", settings, known); !applied) return Failure(applied.error());
  return options;
}

Json Good(const char* kind) { return {{"ok", true}, {"kind", kind}}; }

std::string Hex(std::uint32_t value, int digits) { return Text("0x%0*x", digits, value); }

Json OfObject(const char* kind, ObjectId object) {
  return {{"ok", true}, {"kind", kind}, {"index", Hex(object.index, 4)}, {"sub", object.sub}};
}

constexpr std::array<std::pair<NmtCommand, const char*>, 5> kCommands = {
    {{NmtCommand::kStart, "start"},
     {NmtCommand::kStop, "stop"},
     {NmtCommand::kEnterPreOperational, "enter_pre_operational"},
     {NmtCommand::kResetNode, "reset_node"},
     {NmtCommand::kResetCommunication, "reset_communication"}}};

Json DescribeNmt(Bytes data) {
  if (data.size() != 2) return BadFrame("nmt", data.size() < 2 ? "short" : "long");
  const auto* const command = std::find_if(kCommands.begin(), kCommands.end(), [&](const auto& known) {
    return known.first == static_cast<NmtCommand>(data[0]);
  });
  if (command == kCommands.end() || data[1] > kMaxNode) return BadFrame("nmt", "range");
  Json json = Good("nmt");
  json["command"] = command->second;
  json["node"] = data[1];
  return json;
}

Json DescribePosition(Bytes data, const Options& options) {
  if (data.size() < kPositionSize) return BadFrame("position", "short");
  const std::uint32_t position = LittleEndian(data, 0, kPositionSize);
  const int total = options.bits + options.turn_bits;
  if (options.bits != 0 && std::uint64_t{position} >> total != 0) return BadFrame("position", "range");
  Json json = Good("position");
  json["position"] = position;
  if (options.bits != 0) {
    const std::uint32_t counts = position & ((1U << options.bits) - 1);
    if (options.turn_bits > 0) json["turns"] = position >> options.bits;
    json["counts"] = counts;
    json["angle_deg"] = Degrees(counts, options.bits);
  }
  if (data.size() >= kPositionSize + 2) json["status"] = Hex(LittleEndian(data, kPositionSize, 2), 4);
  return json;
}

Json DescribeEmergency(Bytes data) {
  const std::optional<Emergency> emergency = ParseEmergency(data);
  if (!emergency) return BadFrame("emergency", data.size() < 8 ? "short" : "long");
  Json json = Good("emergency");
  json["code"] = Hex(emergency->code, 4);
  json["class"] = EmergencyClass(emergency->code);
  json["register"] = ErrorRegisterText(emergency->error_register);
  json["specific"] = HexText(emergency->specific);
  return json;
}

Json DescribeHeartbeat(Bytes data) {
  const std::optional<NmtState> state = ParseHeartbeat(data);
  if (!state) return BadFrame("heartbeat", data.empty() ? "short" : data.size() > 1 ? "long" : "range");
  if (*state == NmtState::kBootUp) return Good("boot_up");
  Json json = Good("heartbeat");
  json["state"] = NmtStateName(*state);
  return json;
}

Json DescribeRequest(Bytes data) {
  if (data.size() != 8) return BadFrame("sdo_request", data.size() < 8 ? "short" : "long");
  // An abort has the same form from either side.
  const SdoAnswer other = ParseAnswer(data);
  if (other.kind == SdoAnswer::Kind::kAborted) {
    Json json = OfObject("sdo_abort", other.object);
    json["code"] = Hex(other.value, 8);
    json["reason"] = AbortText(other.value);
    return json;
  }
  const std::optional<SdoRequest> request = ParseRequest(data);
  if (!request) return BadFrame("sdo_request", "function");
  Json json = OfObject(request->write ? "sdo_write_request" : "sdo_read_request", request->object);
  if (request->write) json["value"] = *request->write;
  return json;
}

Json DescribeAnswer(Bytes data) {
  const SdoAnswer answer = ParseAnswer(data);
  Json json = OfObject("sdo_read_answer", answer.object);
  switch (answer.kind) {
    case SdoAnswer::Kind::kMalformed:
      return BadFrame("sdo_answer", data.size() < 8 ? "short" : "function");
    case SdoAnswer::Kind::kAborted:
      return DescribeRequest(data);
    case SdoAnswer::Kind::kWritten:
      json["kind"] = "sdo_write_answer";
      break;
    case SdoAnswer::Kind::kSegmented:
      json["kind"] = "sdo_segmented_answer";
      json["length"] = answer.value;
      break;
    case SdoAnswer::Kind::kValue:
      json["value"] = answer.value;
      break;
  }
  return json;
}

Json Describe(const CanFrame& frame, const Options& options) {
  const Bytes data = frame.data;
  if ((frame.id & (kCanExtended | kCanRemote | kCanError)) != 0) return BadFrame("unknown", "function");
  const std::uint32_t id = frame.id & kCanStandardMask;
  if (id == options.cob_id) return DescribePosition(data, options);
  if (id == kNmtId) return DescribeNmt(data);
  if (id == kSyncId) return data.size() > 1 ? BadFrame("sync", "long") : Good("sync");
  const std::uint32_t function = id & kFunctionMask;
  const std::uint32_t node = id & kNodeMask;
  if (node == 0 || (options.node && node != *options.node)) return BadFrame("unknown", "wrong_identity");
  if (function == kEmergencyId) return DescribeEmergency(data);
  if (function == kTpdo1Id && !options.cob_id) return DescribePosition(data, options);
  if (function == kSdoAnswerId) return DescribeAnswer(data);
  if (function == kSdoRequestId) return DescribeRequest(data);
  if (function == kHeartbeatId) return DescribeHeartbeat(data);
  return BadFrame("unknown", "function");
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, const CanFrame& frame) {
  const Result<Options> options = ReadOptions(settings);
  if (!options) return Failure(options.error());
  Json json = Describe(frame, *options);
  const std::uint32_t node = frame.id & kNodeMask;
  const bool of_node =
      json["ok"] == true && (frame.id & kFunctionMask) != 0 && frame.id != kSyncId && frame.id != options->cob_id;
  if (of_node) json["node"] = node;
  return json;
}

}  // namespace axlecast::cia406
