#pragma once

#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "tools/fleet/position_chunk.h"
#include "tools/fleet/roll_ups.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// The newest 64 numbers of one publisher: finds messages that were received twice, but not those that come late.
class SeqWindow {
 public:
  // Returns false if the message was seen. A new boot_id begins again. Older numbers than the newest 64 count as new.
  bool IsNew(std::int64_t boot_id, std::int64_t seq);

 private:
  std::optional<std::int64_t> boot_id_;
  std::int64_t newest_ = 0;
  std::uint64_t seen_ = 0;  // bit i: newest_ - i
};

// What the machine's file states about the scale of an axis.
struct AxisScale {
  std::int64_t counts_per_turn = 0;
  std::int8_t unit = 0;
  double unit_per_count = 0;
};

// Makes the rows of the positions of one device: chunks, seconds and minutes. Each belongs to one stream.
class PositionRows {
 public:
  // Without a scale, or if a message has another unit or resolution, the unit_per_count of POSITION messages is unknown.
  PositionRows(std::string device, std::optional<AxisScale> scale, const ChannelDetail& detail);

  // Add the samples of one event of the log, which was received at `received` (us), to the rows of `batch`.
  void Add(const position_t& message, std::int64_t event, std::int64_t received, BatchRows& batch);
  void Add(const position_block_t& message, std::int64_t event, std::int64_t received, BatchRows& batch);

  [[nodiscard]] bool empty() const { return events_ == 0; }  // since the last End

  // Ends the chunk, the second and the minutes, and counts the events since the last call.
  void End(BatchRows& batch);

 private:
  // The fields of StreamKey that messages have.
  struct Fields {
    std::int64_t boot_id;
    std::int32_t datum_epoch;
    std::int64_t counts_per_turn;
    std::int8_t unit;
    std::optional<double> unit_per_count;
    friend bool operator==(const Fields&, const Fields&) = default;
  };

  [[nodiscard]] Fields FieldsOf(const position_t& message) const;
  [[nodiscard]] static Fields FieldsOf(const position_block_t& message);
  [[nodiscard]] StreamKey KeyOf(const Fields& fields) const;
  // Ends the chunk of the current stream if the fields are of another one.
  void GoToStream(const Fields& fields, ChunkBuilder::Source source, BatchRows& batch);
  void AddSample(const PositionSample& sample, BatchRows& batch);
  void EndChunk(BatchRows& batch);

  std::string device_;
  std::optional<AxisScale> scale_;
  ChannelDetail detail_;
  std::int64_t events_ = 0;  // since the last End
  std::int64_t stored_ = 0;  // of them, in chunks
  RollUps roll_ups_;

  // The stream of the last message.
  std::optional<Fields> fields_;
  StreamKey key_;
  std::optional<ChunkBuilder> chunk_;  // nothing with Detail::kRollup
};

// Returns the time of sample `i` of the block, in us; the block has more than `i` samples.
[[nodiscard]] std::int64_t BlockSampleUtime(const position_block_t& block, std::size_t i);

}  // namespace axlecast
