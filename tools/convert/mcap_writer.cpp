#include "tools/convert/mcap_writer.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tools/convert/mcap_record.h"

namespace axlecast {
namespace {

constexpr std::string_view kMagic = "\x89MCAP0\r\n";

std::uint32_t Crc32(std::uint32_t crc, std::string_view bytes) {
  // zlib counts in 32 bits here; an attachment may be longer.
  constexpr std::size_t kPart = 1U << 30;
  while (!bytes.empty()) {
    const std::size_t size = std::min(bytes.size(), kPart);
    crc = static_cast<std::uint32_t>(
        crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(size)));
    bytes.remove_prefix(size);
  }
  return crc;
}

}  // namespace

void McapWriter::Times::Add(std::uint64_t ns) {
  first = std::min(first, ns);
  last = std::max(last, ns);
}

McapWriter::McapWriter(Output out) : out_(std::move(out)) {
  Emit(kMagic);
  Emit(McapRecord().Text("").Text("axlecast").As(McapOp::kHeader));
}

void McapWriter::Emit(std::string_view bytes) {
  crc_ = Crc32(crc_, bytes);
  position_ += bytes.size();
  good_ = good_ && out_(bytes);
}

std::uint16_t McapWriter::AddSchema(std::string_view name, std::string_view schema) {
  const std::string record =
      McapRecord().Add(++schemas_).Text(name).Text("jsonschema").Text(schema).As(McapOp::kSchema);
  chunk_ += record;
  schema_records_ += record;
  return schemas_;
}

std::uint16_t McapWriter::AddChannel(std::uint16_t schema, std::string_view topic, std::string_view encoding) {
  const std::uint16_t id = channels_++;
  const std::string record =
      McapRecord().Add(id).Add(schema).Text(topic).Text(encoding).Text("").As(McapOp::kChannel);
  chunk_ += record;
  channel_records_ += record;
  return id;
}

void McapWriter::Write(const Message& message) {
  chunk_index_[message.channel].emplace_back(message.log_ns, chunk_.size());
  McapRecord record;
  record.Add(message.channel).Add(message.sequence).Add(message.log_ns).Add(message.publish_ns).Raw(message.data);
  chunk_ += record.As(McapOp::kMessage);
  chunk_times_.Add(message.log_ns);
  times_.Add(message.log_ns);
  ++counts_[message.channel];
  if (chunk_.size() >= kChunkBytes) EndChunk();
}

void McapWriter::Write(const Attachment& attachment) {
  EndChunk();
  const std::uint64_t start = position_;
  McapRecord record;
  record.Add(attachment.log_ns).Add(attachment.log_ns).Text(attachment.name).Text(attachment.media_type);
  record.Add(std::uint64_t{attachment.data.size()}).Raw(attachment.data);
  record.Add(Crc32(0, record.content()));
  Emit(record.As(McapOp::kAttachment));
  McapRecord index;
  index.Add(start).Add(position_ - start).Add(attachment.log_ns).Add(attachment.log_ns);
  index.Add(std::uint64_t{attachment.data.size()}).Text(attachment.name).Text(attachment.media_type);
  attachment_indexes_ += index.As(McapOp::kAttachmentIndex);
  ++attachments_;
}

void McapWriter::EndChunk() {
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

std::string McapWriter::StatisticsRecord() const {
  std::uint64_t messages = 0;
  McapRecord counts;
  for (const auto& [channel, count] : counts_) {
    counts.Add(channel).Add(count);
    messages += count;
  }
  constexpr std::uint32_t kNoMetadata = 0;
  McapRecord record;
  record.Add(messages).Add(schemas_).Add(std::uint32_t{channels_}).Add(attachments_).Add(kNoMetadata).Add(chunks_);
  return record.Add(times_.begin()).Add(times_.last).Text(counts.content()).As(McapOp::kStatistics);
}

// `start`: where in the file. Up to the footer's CRC, which covers it.
std::string McapWriter::Summary(std::uint64_t start) const {
  const std::array<std::pair<McapOp, std::string>, 5> groups = {{{McapOp::kSchema, schema_records_},
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

void McapWriter::Finish() {
  EndChunk();
  Emit(McapRecord().Add(crc_).As(McapOp::kDataEnd));
  const std::string summary = Summary(position_);
  Emit(summary);
  Emit(McapRecord().Add(Crc32(0, summary)).content());
  Emit(kMagic);
}

}  // namespace axlecast
