#include "tools/convert/conversion.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/text.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

// Opcodes of MCAP records.
enum class McapOp : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

// Builds the content of one record in order: numbers little-endian, text after its length.
class McapRecord {
 public:
  template <std::unsigned_integral Number>
  McapRecord& Add(Number value) {
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      content_ += static_cast<char>(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    return *this;
  }
  McapRecord& Text(std::string_view text) {
    Add(static_cast<std::uint32_t>(text.size()));
    return Raw(text);
  }
  McapRecord& Raw(std::string_view bytes) {
    content_ += bytes;
    return *this;
  }
  [[nodiscard]] const std::string& content() const { return content_; }

  // Returns the record with its opcode and length.
  [[nodiscard]] std::string As(McapOp op) const {
    McapRecord head;
    head.Add(static_cast<std::uint8_t>(op)).Add(std::uint64_t{content_.size()});
    return head.content_ + content_;
  }

 private:
  std::string content_;
};

constexpr std::string_view kMagic = "\x89MCAP0\r\n";

std::uint32_t Crc32(std::uint32_t crc, std::string_view bytes) {
  // zlib takes at most 32 bits of length; an attachment may be longer.
  constexpr std::size_t kPart = 1U << 30;
  while (!bytes.empty()) {
    const std::size_t size = std::min(bytes.size(), kPart);
    crc = static_cast<std::uint32_t>(
        crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(size)));
    bytes.remove_prefix(size);
  }
  return crc;
}

// Writes an MCAP file (https://mcap.dev/spec, version 0) sequentially: uncompressed chunks, each with its CRC and its
// message index, then a summary with schemas, channels, statistics and the indexes of chunks and attachments.
// Times are ns since 1970.
class McapWriter {
 public:
  static constexpr std::size_t kMaxChannels = 65'535;  // and schemas

  explicit McapWriter(const Output& out) : out_(out) {
    Emit(kMagic);
    Emit(McapRecord().Text("").Text("axlecast").As(McapOp::kHeader));
  }

  // Adds a JSON Schema and returns its id, from 1.
  std::uint16_t AddSchema(std::string_view name, std::string_view schema) {
    const std::string record =
        McapRecord().Add(++schemas_).Text(name).Text("jsonschema").Text(schema).As(McapOp::kSchema);
    chunk_ += record;
    schema_records_ += record;
    return schemas_;
  }
  // Adds a channel and returns its id. `schema` is 0 for none. The caller adds at most kMaxChannels.
  std::uint16_t AddChannel(std::uint16_t schema, std::string_view topic, std::string_view encoding) {
    const std::uint16_t id = channels_++;
    const std::string record =
        McapRecord().Add(id).Add(schema).Text(topic).Text(encoding).Text("").As(McapOp::kChannel);
    chunk_ += record;
    channel_records_ += record;
    return id;
  }

  void WriteMessage(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_ns, std::uint64_t publish_ns,
                    std::string_view data) {
    constexpr std::size_t kChunkBytes = 1U << 20;  // a chunk ends with the message that reaches it
    chunk_index_[channel].emplace_back(log_ns, chunk_.size());
    chunk_ += McapRecord().Add(channel).Add(sequence).Add(log_ns).Add(publish_ns).Raw(data).As(McapOp::kMessage);
    chunk_times_.Add(log_ns);
    times_.Add(log_ns);
    ++counts_[channel];
    if (chunk_.size() >= kChunkBytes) EndChunk();
  }

  void WriteAttachment(std::string_view name, std::string_view media_type, std::uint64_t log_ns,
                       std::string_view data) {
    EndChunk();
    const std::uint64_t start = position_;
    const std::uint64_t size = data.size();
    McapRecord record;
    record.Add(log_ns).Add(log_ns).Text(name).Text(media_type).Add(size).Raw(data);
    record.Add(Crc32(0, record.content()));
    Emit(record.As(McapOp::kAttachment));
    McapRecord index;
    index.Add(start).Add(position_ - start).Add(log_ns).Add(log_ns).Add(size).Text(name).Text(media_type);
    attachment_indexes_ += index.As(McapOp::kAttachmentIndex);
    ++attachments_;
  }

  void Finish() {
    EndChunk();
    Emit(McapRecord().Add(crc_).As(McapOp::kDataEnd));
    const std::string summary = Summary(position_);
    Emit(summary);
    Emit(McapRecord().Add(Crc32(0, summary)).content());
    Emit(kMagic);
  }

  [[nodiscard]] bool good() const { return good_; }  // the output has taken everything

 private:
  struct Times {
    std::uint64_t first = UINT64_MAX;
    std::uint64_t last = 0;
    void Add(std::uint64_t ns) {
      first = std::min(first, ns);
      last = std::max(last, ns);
    }
    [[nodiscard]] std::uint64_t begin() const { return first <= last ? first : 0; }
  };

  void Emit(std::string_view bytes) {
    crc_ = Crc32(crc_, bytes);
    position_ += bytes.size();
    good_ = good_ && out_(bytes);
  }

  void EndChunk() {
    if (chunk_.empty()) return;
    const std::uint64_t start = position_;
    const std::uint64_t size = chunk_.size();
    McapRecord chunk;
    chunk.Add(chunk_times_.begin()).Add(chunk_times_.last).Add(size).Add(Crc32(0, chunk_)).Text("").Add(size);
    Emit(chunk.Raw(chunk_).As(McapOp::kChunk));
    const std::uint64_t chunk_length = position_ - start;

    McapRecord offsets;
    for (const auto& [channel, entries] : chunk_index_) {
      offsets.Add(channel).Add(position_);
      McapRecord records;
      for (const auto& [ns, offset] : entries) records.Add(ns).Add(offset);
      Emit(McapRecord().Add(channel).Text(records.content()).As(McapOp::kMessageIndex));
    }
    McapRecord index;
    index.Add(chunk_times_.begin()).Add(chunk_times_.last).Add(start).Add(chunk_length);
    index.Text(offsets.content()).Add(position_ - start - chunk_length).Text("").Add(size).Add(size);
    chunk_indexes_ += index.As(McapOp::kChunkIndex);
    ++chunks_;
    chunk_.clear();
    chunk_index_.clear();
    chunk_times_ = {};
  }

  [[nodiscard]] std::string StatisticsRecord() const {
    std::uint64_t messages = 0;
    McapRecord counts;
    for (const auto& [channel, count] : counts_) {
      counts.Add(channel).Add(count);
      messages += count;
    }
    constexpr std::uint32_t kNoMetadata = 0;
    McapRecord record;
    record.Add(messages)
        .Add(schemas_)
        .Add(std::uint32_t{channels_})
        .Add(attachments_)
        .Add(kNoMetadata)
        .Add(chunks_);
    return record.Add(times_.begin()).Add(times_.last).Text(counts.content()).As(McapOp::kStatistics);
  }

  // Returns the summary and the footer up to its CRC, which covers both. `start`: offset in the file.
  [[nodiscard]] std::string Summary(std::uint64_t start) const {
    const std::array<std::pair<McapOp, std::string>, 5> groups = {
        {{McapOp::kSchema, schema_records_},
         {McapOp::kChannel, channel_records_},
         {McapOp::kStatistics, StatisticsRecord()},
         {McapOp::kChunkIndex, chunk_indexes_},
         {McapOp::kAttachmentIndex, attachment_indexes_}}};
    std::string summary;
    std::string offsets;
    for (const auto& [op, records] : groups) {
      if (records.empty()) continue;
      McapRecord offset;
      offset.Add(static_cast<std::uint8_t>(op)).Add(start + summary.size()).Add(std::uint64_t{records.size()});
      offsets += offset.As(McapOp::kSummaryOffset);
      summary += records;
    }
    const std::uint64_t offset_start = start + summary.size();
    constexpr std::uint64_t kFooterSize = 8 + 8 + 4;
    McapRecord footer;
    footer.Add(static_cast<std::uint8_t>(McapOp::kFooter)).Add(kFooterSize).Add(start).Add(offset_start);
    return summary + offsets + footer.content();
  }

  const Output& out_;
  bool good_ = true;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  // of everything so far
  std::string chunk_;
  Times chunk_times_;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> chunk_index_;

  std::uint16_t schemas_ = 0;
  std::uint16_t channels_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint32_t attachments_ = 0;
  std::string schema_records_;
  std::string channel_records_;
  std::string chunk_indexes_;
  std::string attachment_indexes_;
  Times times_;
  std::map<std::uint16_t, std::uint64_t> counts_;  // messages of each channel
};

// Returns the time in ns. Times of wrong clocks, before 1970 or beyond 63 bits, are clamped.
std::uint64_t Nanoseconds(std::int64_t utime) {
  constexpr std::int64_t kNsPerUs = 1'000;
  if (utime < 0) return 0;
  return static_cast<std::uint64_t>(std::min(utime, INT64_MAX / kNsPerUs) * kNsPerUs);
}

// Converts events; see WriteMcap.
class McapConverter {
 public:
  explicit McapConverter(const Output& out) : writer_(out) {}

  bool On(const LogEvent& event) {
    if (IsLogChannel(event.channel)) {
      Attach(event);
      return writer_.good();
    }
    const MessageType* type = FindMessageType(event.data);
    auto message = type == nullptr ? std::nullopt : type->decode(event.data);
    if (!message) type = nullptr;
    const std::optional<std::uint16_t> channel = Channel(event.channel, type);
    if (!channel) {
      ++done_.left_out;
      return true;
    }
    const std::string json = message ? JsonLine(*message) : "";
    const std::int64_t sequence = message ? message->value("seq", std::int64_t{0}) : event.number;
    writer_.WriteMessage(*channel, static_cast<std::uint32_t>(sequence & 0xFFFF'FFFF), Nanoseconds(event.utime),
                         Nanoseconds(type == nullptr ? event.utime : SampleTime(event)),
                         type == nullptr ? AsText(event.data) : std::string_view(json));
    ++done_.written;
    return writer_.good();
  }
  Conversion Finish() {
    writer_.Finish();
    return done_;
  }

 private:
  void Attach(const LogEvent& event) {
    if (event.channel == kSealChannel) return;
    const char* const type = event.channel == kMachineChannel    ? "application/yaml"
                             : event.channel == kRecorderChannel ? "application/json"
                                                                 : "text/plain";
    writer_.WriteAttachment(MendedUtf8(event.channel), type, Nanoseconds(event.utime), AsText(event.data));
  }

  // Returns the id of the channel; nothing if there are too many. `type` is null for raw messages.
  std::optional<std::uint16_t> Channel(std::string_view name, const MessageType* type) {
    const auto key = std::pair(std::string(name), type);
    const auto known = channels_.find(key);
    if (known != channels_.end()) return known->second;
    if (channels_.size() >= McapWriter::kMaxChannels) return std::nullopt;
    std::uint16_t schema = 0;
    if (type != nullptr) {
      const auto [place, fresh] = schemas_.try_emplace(type, 0);
      if (fresh) place->second = writer_.AddSchema("axlecast." + std::string(type->name), type->schema);
      schema = place->second;
    }
    return channels_[key] = writer_.AddChannel(schema, MendedUtf8(name), type == nullptr ? "lcm" : "json");
  }

  McapWriter writer_;
  std::map<std::pair<std::string, const MessageType*>, std::uint16_t> channels_;
  std::map<const MessageType*, std::uint16_t> schemas_;
  Conversion done_;
};

}  // namespace

Conversion WriteMcap(const EventRange& events, const Output& out) {
  McapConverter mcap(out);
  events([&mcap](const LogEvent& event) { return mcap.On(event); });
  return mcap.Finish();
}

}  // namespace axlecast
