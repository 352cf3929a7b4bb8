#include "tools/mqtt/sparkplug/payload.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>

namespace axlecast {
namespace {

// Protobuf's encoding: a field is a key (number x 8 + wire type) and its content.
enum class Wire : std::uint8_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

// Field numbers of the schema.
namespace payload_field {
constexpr std::uint32_t kTimestamp = 1, kMetrics = 2, kSeq = 3;
}
namespace metric_field {
constexpr std::uint32_t kName = 1, kAlias = 2, kTimestamp = 3, kDatatype = 4, kIsHistorical = 5, kIsTransient = 6,
                        kIsNull = 7, kProperties = 9, kInt = 10, kLong = 11, kFloat = 12, kDouble = 13,
                        kBoolean = 14, kString = 15;
}
namespace property_set_field {
constexpr std::uint32_t kKeys = 1, kValues = 2;
}
namespace property_field {
constexpr std::uint32_t kType = 1, kIsNull = 2, kInt = 3, kLong = 4, kFloat = 5, kDouble = 6, kBoolean = 7,
                        kString = 8;
}

class Writer {
 public:
  void Number(std::uint32_t field, std::uint64_t number) {
    Key(field, Wire::kVarint);
    Varint(number);
  }
  void Text(std::uint32_t field, std::string_view text) {
    Key(field, Wire::kBytes);
    Varint(text.size());
    bytes_ += text;
  }
  void Fixed(std::uint32_t field, double number) {
    Key(field, Wire::kFixed64);
    LittleEndian(std::bit_cast<std::uint64_t>(number));
  }
  void Fixed(std::uint32_t field, float number) {
    Key(field, Wire::kFixed32);
    LittleEndian(std::bit_cast<std::uint32_t>(number));
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  void Key(std::uint32_t field, Wire wire) {
    Varint(std::uint64_t{field} << 3U | static_cast<std::uint64_t>(wire));
  }
  void Varint(std::uint64_t number) {
    for (; number >= 0x80; number >>= 7U) bytes_ += static_cast<char>(static_cast<std::uint8_t>(number | 0x80U));
    bytes_ += static_cast<char>(static_cast<std::uint8_t>(number));
  }
  template <typename Number>
  void LittleEndian(Number number) {
    for (std::size_t i = 0; i < sizeof number; ++i) {
      bytes_ += static_cast<char>(static_cast<std::uint8_t>(number >> (8 * i)));
    }
  }

  std::string bytes_;
};

bool IsNull(const SparkplugValue& value) {
  if (const double* number = std::get_if<double>(&value)) return std::isnan(*number);
  if (const float* number = std::get_if<float>(&value)) return std::isnan(*number);
  return std::holds_alternative<std::monostate>(value);
}

// Numbers of the fields of a value, in a metric or in a property.
struct ValueFields {
  std::uint32_t is_null, int_value, long_value, float_value, double_value, boolean_value, string_value;
};
constexpr ValueFields kMetricFields = {metric_field::kIsNull, metric_field::kInt,    metric_field::kLong,
                                       metric_field::kFloat,  metric_field::kDouble, metric_field::kBoolean,
                                       metric_field::kString};
constexpr ValueFields kPropertyFields = {property_field::kIsNull, property_field::kInt,    property_field::kLong,
                                         property_field::kFloat,  property_field::kDouble, property_field::kBoolean,
                                         property_field::kString};

// Signed numbers are sent as two's complement of their own width, in the schema's unsigned fields.
void WriteValue(Writer& writer, const SparkplugValue& value, const ValueFields& fields) {
  if (IsNull(value)) return writer.Number(fields.is_null, 1);
  std::visit(
      [&](const auto& content) {
        using Content = std::decay_t<decltype(content)>;
        if constexpr (std::is_same_v<Content, bool>) {
          writer.Number(fields.boolean_value, content ? 1 : 0);
        } else if constexpr (std::is_same_v<Content, std::int64_t>) {
          writer.Number(fields.long_value, static_cast<std::uint64_t>(content));
        } else if constexpr (std::is_integral_v<Content>) {
          writer.Number(fields.int_value, static_cast<std::uint32_t>(content));
        } else if constexpr (std::is_same_v<Content, float>) {
          writer.Fixed(fields.float_value, content);
        } else if constexpr (std::is_same_v<Content, double>) {
          writer.Fixed(fields.double_value, content);
        } else if constexpr (std::is_same_v<Content, std::string>) {
          writer.Text(fields.string_value, content);
        }
      },
      value);
}

std::string EncodeProperties(const std::vector<SparkplugProperty>& properties) {
  Writer set;
  for (const SparkplugProperty& property : properties) set.Text(property_set_field::kKeys, property.key);
  for (const SparkplugProperty& property : properties) {
    Writer value;
    value.Number(property_field::kType, static_cast<std::uint32_t>(property.type));
    WriteValue(value, property.value, kPropertyFields);
    set.Text(property_set_field::kValues, value.bytes());
  }
  return set.bytes();
}

std::string EncodeMetric(const SparkplugMetric& metric) {
  Writer writer;
  if (!metric.name.empty()) writer.Text(metric_field::kName, metric.name);
  if (metric.alias) writer.Number(metric_field::kAlias, *metric.alias);
  writer.Number(metric_field::kTimestamp, static_cast<std::uint64_t>(metric.timestamp_ms));
  writer.Number(metric_field::kDatatype, static_cast<std::uint32_t>(metric.type));
  if (metric.is_historical) writer.Number(metric_field::kIsHistorical, 1);
  if (metric.is_transient) writer.Number(metric_field::kIsTransient, 1);
  if (!metric.properties.empty()) writer.Text(metric_field::kProperties, EncodeProperties(metric.properties));
  WriteValue(writer, metric.value, kMetricFields);
  return writer.bytes();
}

// Reads the fields of an encoded message. After an error, Next returns nothing and good() is false.
class Reader {
 public:
  struct Field {
    std::uint64_t number = 0;
    Wire wire = Wire::kVarint;
    std::uint64_t varint = 0;     // kVarint
    std::string_view bytes = {};  // the other types
  };

  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  [[nodiscard]] std::optional<Field> Next() {
    if (!good_ || rest_.empty()) return std::nullopt;
    const std::uint64_t key = Varint();
    Field field{.number = key >> 3U, .wire = static_cast<Wire>(key & 7U)};
    switch (field.wire) {
      case Wire::kVarint:
        field.varint = Varint();
        break;
      case Wire::kFixed64:
        field.bytes = Take(8);
        break;
      case Wire::kFixed32:
        field.bytes = Take(4);
        break;
      case Wire::kBytes:
        field.bytes = Take(Varint());
        break;
      default:  // groups are not in the schema
        good_ = false;
    }
    good_ = good_ && field.number != 0;
    return good_ ? std::optional(field) : std::nullopt;
  }
  [[nodiscard]] bool good() const { return good_; }

 private:
  std::uint64_t Varint() {
    std::uint64_t number = 0;
    for (unsigned shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const auto byte = static_cast<std::uint8_t>(rest_.front());
      rest_.remove_prefix(1);
      number |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte < 0x80) return number;
    }
    good_ = false;
    return 0;
  }
  std::string_view Take(std::uint64_t size) {
    good_ = good_ && size <= rest_.size();
    if (!good_) return {};
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  std::string_view rest_;
  bool good_ = true;
};

std::optional<ReceivedMetric> DecodeMetric(std::string_view bytes) {
  Reader reader(bytes);
  ReceivedMetric metric;
  while (const auto field = reader.Next()) {
    if (field->number == metric_field::kName && field->wire == Wire::kBytes) metric.name = field->bytes;
    if (field->number == metric_field::kBoolean && field->wire == Wire::kVarint)
      metric.boolean = field->varint != 0;
  }
  return reader.good() ? std::optional(std::move(metric)) : std::nullopt;
}

}  // namespace

std::string EncodePayload(const SparkplugPayload& payload) {
  Writer writer;
  writer.Number(payload_field::kTimestamp, static_cast<std::uint64_t>(payload.timestamp_ms));
  for (const SparkplugMetric& metric : payload.metrics) writer.Text(payload_field::kMetrics, EncodeMetric(metric));
  if (payload.seq) writer.Number(payload_field::kSeq, *payload.seq);
  return writer.bytes();
}

std::optional<std::vector<ReceivedMetric>> DecodePayload(std::string_view bytes) {
  Reader reader(bytes);
  std::vector<ReceivedMetric> metrics;
  while (const auto field = reader.Next()) {
    if (field->number != payload_field::kMetrics) continue;
    if (field->wire != Wire::kBytes) return std::nullopt;
    std::optional<ReceivedMetric> metric = DecodeMetric(field->bytes);
    if (!metric) return std::nullopt;
    metrics.push_back(std::move(*metric));
  }
  if (!reader.good()) return std::nullopt;
  return metrics;
}

}  // namespace axlecast
