#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace axlecast {

// Payloads of Sparkplug B, specification 3.0.0, chapter 6 (protobuf schema org.eclipse.tahu.protobuf.Payload): the part that
// an edge node without data sets and templates needs.

// Numbers of the specification's data types.
enum class SparkplugType : std::uint32_t {
  kInt32 = 3,
  kInt64 = 4,
  kUInt32 = 7,
  kFloat = 9,
  kDouble = 10,
  kBoolean = 11,
  kString = 12
};

// A value of one of these types; std::monostate: null. A NaN is sent as null.
using SparkplugValue =
    std::variant<std::monostate, bool, std::int32_t, std::int64_t, std::uint32_t, float, double, std::string>;

struct SparkplugProperty {
  std::string key;
  SparkplugType type = SparkplugType::kInt32;
  SparkplugValue value;
};

struct SparkplugMetric {
  std::string name = {};                              // empty: left out
  std::optional<std::uint64_t> alias = std::nullopt;  // none: left out
  std::int64_t timestamp_ms = 0;                      // ms, UNIX time
  SparkplugType type = SparkplugType::kInt32;
  bool is_historical = false;
  bool is_transient = false;
  std::vector<SparkplugProperty> properties = {};
  SparkplugValue value = {};
};

struct SparkplugPayload {
  std::int64_t timestamp_ms = 0;    // ms, UNIX time of the publication
  std::optional<std::uint8_t> seq;  // none: left out, in NDEATH
  std::vector<SparkplugMetric> metrics = {};
};

[[nodiscard]] std::string EncodePayload(const SparkplugPayload& payload);

// A metric of a received payload. Only the fields that a command needs are read; the others are skipped.
struct ReceivedMetric {
  std::string name;
  std::optional<bool> boolean;  // boolean_value; none: another value, or null
};

// Returns the metrics of a payload from outside; nothing if the bytes are no payload. Invalid bytes never cause more work
// than their number.
[[nodiscard]] std::optional<std::vector<ReceivedMetric>> DecodePayload(std::string_view bytes);

}  // namespace axlecast
