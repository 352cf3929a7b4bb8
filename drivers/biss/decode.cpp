#include "drivers/biss/family.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/device/operation.h"
#include "drivers/biss/codec.h"
#include "drivers/biss/settings.h"
#include "drivers/kit/clocked_line.h"
#include "drivers/kit/decode.h"

namespace axlecast::biss {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  Format format;
  std::int64_t polynomial = CrcRule().polynomial;  // as given
  bool transfer = false;                           // with what is before the position
  std::optional<std::size_t> bit_count;            // of a frame that was given in bits
};

Result<Options> ReadOptions(const DecodeSettings& settings) {
  Options options;
  Format& format = options.format;
  const std::array<DecodeOption, 8> known = {{NumberOption("bits", format.bits, kMinBits, kMaxBits),
                                              NumberOption("turn_bits", format.turn_bits, 0, kMaxTurnBits),
                                              NumberOption("crc_bits", format.crc.bits, kMinCrcBits, kMaxCrcBits),
                                              NumberOption("crc_poly", options.polynomial, 1, 0x1FFFF),
                                              NumberOption("crc_start", format.crc.start, 0, 0xFFFF),
                                              ChoiceOption("crc_inverted", format.crc.inverted, {"false", "true"}),
                                              ChoiceOption("frame", options.transfer, {"position", "transfer"}),
                                              NumberOption("bit_count", options.bit_count, 0, INT64_MAX)}};
  if (const Result<> applied = ApplySettings("biss", settings, known); !applied) return Failure(applied.error());
  if (format.bits + format.turn_bits > kMaxPositionBits) {
    return Failure(
        Text("turn_bits=%d: with bits=%d more than %d", format.turn_bits, format.bits, kMaxPositionBits));
  }
  format.crc.polynomial = Polynomial(options.polynomial, format.crc.bits);
  if (format.crc.polynomial == 0) {
    return Failure(
        Text("crc_poly=0x%llX: no polynomial of crc_bits=%d that ends with + 1; x^6 + x + 1 is 0x43, or 0x03",
             static_cast<unsigned long long>(options.polynomial), format.crc.bits));
  }
  if (format.crc.start >> static_cast<unsigned>(format.crc.bits) != 0) {
    return Failure(Text("crc_start=%u: more than crc_bits=%d hold", format.crc.start, format.crc.bits));
  }
  return options;
}

// In the order of FrameError.
constexpr std::array<const char*, 7> kErrorWords = {"none",  "line_low", "no_ack",  "no_start",
                                                    "short", "range",    "checksum"};

const char* KindOf(const Options& options) { return options.transfer ? "transfer" : "position_frame"; }

Json Describe(const Reply& reply, const Options& options) {
  Json json = {{"ok", reply.error == FrameError::kNone}, {"kind", KindOf(options)}};
  if (reply.error != FrameError::kNone) {
    json["error"] = kErrorWords.at(static_cast<std::size_t>(reply.error));
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

// Bits that were given, without those that fill the last byte.
std::size_t Given(Bytes frame, const Options& options) {
  return std::min(options.bit_count.value_or(SIZE_MAX), frame.size() * 8);
}

// A frame alone: exactly its bits; in hex, the bits that fill the last byte are 0.
Json DescribeFrame(const FrameReader& reader, Bytes frame, const Options& options) {
  const std::size_t bits = reader.frame_bits();
  const std::size_t size = frame.size() * 8;
  const std::size_t given = Given(frame, options);
  if (given < bits) return BadFrame(KindOf(options), "short");
  if (options.bit_count ? given > bits : size >= bits + 8) return BadFrame(KindOf(options), "long");
  for (std::size_t i = bits; i < size; ++i) {
    if (BitAt(frame, i)) return BadFrame(KindOf(options), "range");
  }
  return Describe(reader.ReadFrame(frame, 0, size), options);
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, Bytes frame) {
  const Result<Options> read = ReadOptions(settings);
  if (!read) return Failure(read.error());
  const Options& options = *read;
  const FrameReader reader(options.format);
  if (!options.transfer) return DescribeFrame(reader, frame, options);
  return Describe(reader.ReadTransfer(frame, Given(frame, options), {}), options);
}

}  // namespace axlecast::biss
