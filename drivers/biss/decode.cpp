#include "drivers/biss/family.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/device/operation.h"
#include "drivers/biss/codec.h"
#include "drivers/biss/settings.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/clocked_line.h"

namespace axlecast::biss {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  Format format;
  std::int64_t polynomial = CrcRule().polynomial;  // as given
  bool transfer = false;                           // with what is before the position
  std::optional<std::size_t> bit_count;            // of a frame that was given in bits
};

std::string ReadNumber(std::string_view key, std::string_view value, std::int64_t min, std::int64_t max,
                       std::int64_t& into) {
  const std::optional<std::int64_t> number = ParseWhole(value, min, max);
  if (number) into = *number;
  return number ? ""
                : std::string(key) + "=" + std::string(value) + ": expected " + std::to_string(min) + ".." +
                      std::to_string(max);
}

template <typename Number>
std::string ReadInto(std::string_view key, std::string_view value, std::int64_t min, std::int64_t max,
                     Number& into) {
  std::int64_t number = 0;
  std::string problem = ReadNumber(key, value, min, max, number);
  if (problem.empty()) into = static_cast<Number>(number);
  return problem;
}

std::string ReadChoice(std::string_view key, std::string_view value, std::string_view no, std::string_view yes,
                       bool& into) {
  into = value == yes;
  if (value == no || value == yes) return "";
  return std::string(key) + "=" + std::string(value) + ": expected " + std::string(no) + " or " + std::string(yes);
}

std::string ReadOption(const std::string& key, const std::string& value, Options& options) {
  Format& format = options.format;
  if (key == "bits") return ReadInto(key, value, kMinBits, kMaxBits, format.bits);
  if (key == "turn_bits") return ReadInto(key, value, 0, kMaxTurnBits, format.turn_bits);
  if (key == "crc_bits") return ReadInto(key, value, kMinCrcBits, kMaxCrcBits, format.crc.bits);
  if (key == "crc_poly") return ReadNumber(key, value, 1, 0x1FFFF, options.polynomial);
  if (key == "crc_start") return ReadInto(key, value, 0, 0xFFFF, format.crc.start);
  if (key == "crc_inverted") return ReadChoice(key, value, "false", "true", format.crc.inverted);
  if (key == "frame") return ReadChoice(key, value, "position", "transfer", options.transfer);
  if (key == "bit_count") {
    std::size_t count = 0;
    std::string problem = ReadInto(key, value, 0, INT64_MAX, count);
    options.bit_count = count;
    return problem;
  }
  return "unknown key '" + key +
         "': biss knows bits, turn_bits, crc_bits, crc_poly, crc_start, crc_inverted and frame";
}

// What is wrong with the settings; empty when nothing is.
std::string ReadOptions(const DecodeSettings& settings, Options& options) {
  for (const auto& [key, value] : settings) {
    std::string problem = ReadOption(key, value, options);
    if (!problem.empty()) return problem;
  }
  Format& format = options.format;
  if (format.bits + format.turn_bits > kMaxPositionBits) {
    return Text("turn_bits=%d: with bits=%d more than %d", format.turn_bits, format.bits, kMaxPositionBits);
  }
  format.crc.polynomial = Polynomial(options.polynomial, format.crc.bits);
  if (format.crc.polynomial == 0) {
    return Text("crc_poly=0x%llX: no polynomial of crc_bits=%d that ends with + 1; x^6 + x + 1 is 0x43, or 0x03",
                static_cast<unsigned long long>(options.polynomial), format.crc.bits);
  }
  if (format.crc.start >> static_cast<unsigned>(format.crc.bits) != 0) {
    return Text("crc_start=%u: more than crc_bits=%d hold", format.crc.start, format.crc.bits);
  }
  return "";
}

const char* ErrorWord(FrameError error) {
  switch (error) {
    case FrameError::kLow:
      return "line_low";
    case FrameError::kNoAck:
      return "no_ack";
    case FrameError::kNoStart:
      return "no_start";
    case FrameError::kShort:
      return "short";
    case FrameError::kCds:
      return "range";
    default:
      return "checksum";
  }
}

Json Describe(const Reply& reply, const Options& options) {
  Json json = {{"ok", reply.error == FrameError::kNone},
               {"kind", options.transfer ? "transfer" : "position_frame"}};
  if (reply.error != FrameError::kNone) {
    json["error"] = ErrorWord(reply.error);
  } else {
    json["counts"] = reply.counts;
    if (options.format.turn_bits > 0) json["turns"] = reply.turns;
    json["angle_deg"] = Degrees(reply.counts, options.format.bits);
    json["alarms"] = Json::array();
    if (reply.failed) json["alarms"].push_back("error");
    if (reply.warned) json["alarms"].push_back("warning");
  }
  if (reply.start > 0 && reply.error != FrameError::kNoStart) {
    json["ack_at"] = reply.ack;
    json["start_at"] = reply.start;
  }
  return json;
}

Json Bad(const Options& options, std::string_view error) {
  return {{"ok", false}, {"kind", options.transfer ? "transfer" : "position_frame"}, {"error", error}};
}

// Bits that were given, without those that fill the last byte.
std::size_t Given(Bytes frame, const Options& options) {
  return std::min(options.bit_count.value_or(SIZE_MAX), frame.size() * 8);
}

// A frame alone: exactly its bits; in hex, the bits that fill the last byte are 0.
Json DescribeFrame(const FrameReader& reader, Bytes frame, const Options& options) {
  const std::size_t bits = reader.frame_bits();
  const std::size_t size = frame.size() * 8;
  const std::size_t given = Given(frame, options);
  if (given < bits) return Bad(options, "short");
  if (options.bit_count ? given > bits : size >= bits + 8) return Bad(options, "long");
  for (std::size_t i = bits; i < size; ++i) {
    if (BitAt(frame, i)) return Bad(options, "range");
  }
  return Describe(reader.ReadFrame(frame, 0, size), options);
}

}  // namespace

Json Decode(const DecodeSettings& settings, Bytes frame, bool* usable) {
  Options options;
  const std::string problem = ReadOptions(settings, options);
  *usable = problem.empty();
  if (!*usable) return {{"error", problem}};
  const FrameReader reader(options.format);
  if (!options.transfer) return DescribeFrame(reader, frame, options);
  return Describe(reader.ReadTransfer(frame, Given(frame, options), {}), options);
}

}  // namespace axlecast::biss
