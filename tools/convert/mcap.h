#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/convert/conversion.h"

namespace axlecast {

// Writes an MCAP file (https://mcap.dev/spec, version 0) sequentially: uncompressed chunks, each with its CRC and its
// message index, then a summary with schemas, channels, statistics and the indexes of chunks and attachments.
// Times are ns since 1970.
class McapWriter {
 public:
  struct Message {
    std::uint16_t channel = 0;
    std::uint32_t sequence = 0;
    std::uint64_t log_ns = 0;
    std::uint64_t publish_ns = 0;
    std::string_view data;
  };
  struct Attachment {
    std::string name;
    std::string media_type;
    std::uint64_t log_ns = 0;
    std::string_view data;
  };
  static constexpr std::size_t kMaxChannels = 65'535;   // and schemas
  static constexpr std::size_t kChunkBytes = 1U << 20;  // a chunk ends with the message that reaches it

  explicit McapWriter(Output out);

  // Adds a JSON Schema and returns its id, from 1.
  std::uint16_t AddSchema(std::string_view name, std::string_view schema);
  // Adds a channel and returns its id. `schema` is 0 for none. The caller adds at most kMaxChannels.
  std::uint16_t AddChannel(std::uint16_t schema, std::string_view topic, std::string_view encoding);
  void Write(const Message& message);
  void Write(const Attachment& attachment);
  void Finish();

  [[nodiscard]] bool good() const { return good_; }  // the output has taken everything

 private:
  struct Times {
    std::uint64_t first = UINT64_MAX;
    std::uint64_t last = 0;
    void Add(std::uint64_t ns);
    [[nodiscard]] std::uint64_t begin() const { return first <= last ? first : 0; }
  };

  void Emit(std::string_view bytes);
  void EndChunk();
  [[nodiscard]] std::string StatisticsRecord() const;
  [[nodiscard]] std::string Summary(std::uint64_t start) const;

  Output out_;
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

// Writes the events as an MCAP file, with the name of the channel as topic:
// - Messages of axlecast are JSON with a JSON Schema ("axlecast.position_t").
// - Malformed messages and messages of other programs are copied, with message encoding "lcm" and without a schema.
// - log_time is the time of reception, publish_time the message's `utime`.
// - The log's own texts (tools/log/log_header.h) become attachments. Its seals refer to bytes of the log: left out.
[[nodiscard]] Conversion WriteMcap(const EventRange& events, const Output& out);

}  // namespace axlecast
