#include "drivers/tformat/family.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "drivers/kit/decode.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  Format format;
  std::optional<std::uint8_t> encoder_id;
};

Result<Options> ReadOptions(const DecodeSettings& settings) {
  std::string models = "one of";
  for (const Model& model : Models()) models.append(" ").append(model.name);
  Options options;
  const std::array<DecodeOption, 4> known = {
      {{"model", models,
        [&options](const std::string& value) {
          const Model* model = FindModel(value);
          if (model != nullptr) options = {model->format, model->encoder_id};
          return model != nullptr;
        }},
       NumberOption("bits", options.format.single_turn_bits, 1, 24, "its single-turn bits"),
       NumberOption("turn_bits", options.format.multi_turn_bits, 0, 24,
                    "the multi-turn bits of the encoder (0: it has none)"),
       NumberOption("enid", options.encoder_id, 0, 255, "or 0x00..0xff, the encoder ID that must answer")}};
  const Result<> applied = ApplySettings("tformat", settings, known);
  if (!applied) return Failure(applied.error());
  return options;
}

// Named by what the exchange does, as the operations are; spec Table 1.
std::string Name(DataId id) {
  constexpr std::array<std::pair<DataId, const char*>, kDataIds.size()> kNames = {
      {{DataId::kSingleTurn, "read_single_turn"},
       {DataId::kMultiTurn, "read_multi_turn"},
       {DataId::kEncoderId, "read_encoder_id"},
       {DataId::kAll, "read_all"},
       {DataId::kEepromWrite, "eeprom_write"},
       {DataId::kClearErrors, "clear_errors"},
       {DataId::kZeroSingleTurn, "zero_single_turn"},
       {DataId::kResetTurnsAndErrors, "reset_turns_and_errors"},
       {DataId::kEepromRead, "eeprom_read"}}};
  return std::find_if(kNames.begin(), kNames.end(), [id](const auto& name) { return name.first == id; })->second;
}

Json Good(const std::string& kind, DataId id) {
  return {{"ok", true}, {"kind", kind}, {"id", std::string(1, "0123456789ABCDEF"[static_cast<std::size_t>(id)])}};
}

// The alarms of a frame with a status field. SF's ea0 is ALMC's CE and its ea1 is ALMC's ME, BE or BA (spec 6.3.2
// (3)): what ALMC names is not repeated.
Json Alarms(std::uint8_t status, std::uint8_t alarms) {
  Json names = Json::array();
  if ((status & kSfCountingError) != 0) alarms |= kAlmCountingError;
  for (const DeviceAlarm& alarm : DeviceAlarms()) {
    if ((alarms & alarm.bit) != 0) names.push_back(alarm.spec.name);
  }
  if ((status & kSfMultiTurn) != 0 && (alarms & kEa1Alarms) == 0) names.push_back("multi_turn_or_battery");
  if ((status & kSfParity) != 0) names.push_back("request_parity_error");
  if ((status & kSfDelimiter) != 0) names.push_back("request_delimiter_error");
  return names;
}

void AddPosition(Json& json, const Reply& reply, const Format& format) {
  if (reply.single_turn) json["counts"] = *reply.single_turn;
  if (reply.multi_turn && format.multi_turn_bits > 0) json["turns"] = *reply.multi_turn;
  if (reply.single_turn) {
    json["angle_deg"] =
        360.0 * *reply.single_turn / static_cast<double>(1U << static_cast<unsigned>(format.single_turn_bits));
  }
}

void AddState(Json& json, const Reply& reply) {
  if (reply.status) {
    json["alarms"] = Alarms(*reply.status, reply.alarms.value_or(0));
    json["status"] = HexByte(*reply.status);
  }
  if (reply.encoder_id) json["encoder_id"] = HexByte(*reply.encoder_id);
  if (reply.address) json["address"] = *reply.address;
  if (reply.busy) json["busy"] = *reply.busy;
  if (reply.data) json["data"] = HexByte(*reply.data);
}

Json DescribeRequest(const RequestFields& request) {
  // Spec Table 4: the reply that accepts a write repeats the request byte for byte.
  const bool either = request.id == DataId::kEepromWrite;
  Json json = Good(Name(request.id) + (either ? "_request_or_reply" : "_request"), request.id);
  if (request.address) json["address"] = *request.address;
  if (request.data) json["data"] = HexByte(*request.data);
  return json;
}

// The reply that is no reading, with the alarms it may hold.
Json DescribeFailure(const std::string& kind, const Reply& reply) {
  Json json = BadFrame(kind, ReplyErrorName(reply.error));
  AddState(json, reply);
  return json;
}

// ID 3's data under a wrong control field, or one that belongs to another ID.
constexpr const char* kAbnormalKind = "abnormal_request_reply";

Json DescribeUnknown(Bytes frame, const Format& format) {
  const Reply reply = ParseReply({}, frame, format);
  const bool answered = reply.error == ReplyError::kAbnormalReply || reply.error == ReplyError::kCommunicationAlarm;
  return answered ? DescribeFailure(kAbnormalKind, reply) : BadFrame("unknown", "control_field");
}

Json DescribeReadout(DataId id, Bytes frame, const Options& options) {
  const Reply reply = ParseReply(Request(id), frame, options.format);
  const std::string kind =
      id != DataId::kAll && frame.size() == kLongestReply && reply.status ? kAbnormalKind : Name(id) + "_reply";
  if (reply.error != ReplyError::kNone) return DescribeFailure(kind, reply);
  if (options.encoder_id && reply.encoder_id && *reply.encoder_id != *options.encoder_id) {
    Json json = BadFrame(kind, "wrong_identity");
    AddState(json, reply);
    return json;
  }
  Json json = Good(kind, id);
  AddPosition(json, reply, options.format);
  AddState(json, reply);
  return json;
}

std::string EepromKind(DataId id, Bytes frame) {
  const bool busy = frame.size() > 1 && (frame[1] & kBusy) != 0;  // only a reply is
  if (id == DataId::kEepromWrite) return busy ? "eeprom_write_reply" : "eeprom_write_request_or_reply";
  return frame.size() < ReplySize(id) ? "eeprom_read_request" : "eeprom_read_reply";
}

// An EEPROM frame that is no good request: a damaged one, or a reply.
Json DescribeEeprom(DataId id, Bytes frame, const Format& format) {
  const std::string kind = EepromKind(id, frame);
  if (frame.size() < RequestSize(id)) return BadFrame(kind, "short");
  if (frame.size() < ReplySize(id)) return BadFrame(kind, Crc(frame) == 0 ? "range" : "checksum");
  const auto address = static_cast<std::uint8_t>(frame[1] & ~kBusy);
  const std::uint8_t cell = address < kEepromCells ? address : 0;
  const Frame request = id == DataId::kEepromRead ? EepromReadRequest(cell) : EepromWriteRequest(cell, frame[2]);
  const Reply reply = ParseReply(request, frame, format);
  if (reply.error == ReplyError::kWrongEcho) return BadFrame(kind, "range");  // the address is above 79
  if (reply.error != ReplyError::kNone) return DescribeFailure(reply.status ? kAbnormalKind : kind, reply);
  Json json = Good(kind, id);
  AddState(json, reply);
  return json;
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, Bytes frame) {
  const Result<Options> read = ReadOptions(settings);
  if (!read) return Failure(read.error());
  const Options& options = *read;
  if (frame.empty()) return BadFrame("unknown", "short");
  if (const std::optional<RequestFields> request = ParseRequest(frame)) return DescribeRequest(*request);
  const std::optional<DataId> id = ParseControlField(frame[0]);
  if (!id) return DescribeUnknown(frame, options.format);
  return IsEeprom(*id) ? DescribeEeprom(*id, frame, options.format) : DescribeReadout(*id, frame, options);
}

}  // namespace axlecast::tformat
