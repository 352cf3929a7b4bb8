// Any bytes as the body of a chunk and as the records of a raw row: decoding must not fail otherwise than by an error. And any
// numbers as a column: what is encoded must come back.
#include <algorithm>
#include <cstdlib>
#include <vector>

#include "tools/fleet/column.h"
#include "tools/fleet/position_chunk.h"
#include "tools/fleet/raw_records.h"
#include "tools/log/log_event.h"

namespace {

using axlecast::Bytes;

void Require(bool holds) {
  if (!holds) std::abort();
}

void Decode(Bytes body, std::size_t n) {
  const auto columns = axlecast::SplitBody(body);
  if (!columns) return;
  for (const axlecast::ColumnView& column : *columns) {
    const auto values = axlecast::DecodeColumn(column, n);
    Require(!values || values->size() == n);
  }
}

void Encode(Bytes data) {
  std::vector<std::int64_t> values;
  for (std::size_t at = 0; at + 8 <= data.size() && values.size() < axlecast::kMaxChunkSamples; at += 8) {
    values.push_back(static_cast<std::int64_t>(axlecast::ReadBigEndian<std::uint64_t>(data, at)));
  }
  if (values.empty()) return;
  std::vector<std::uint8_t> body;
  axlecast::BeginBody(body, 1);
  axlecast::AppendColumn(body, axlecast::ColumnId::kCounts, values);
  const auto columns = axlecast::SplitBody(body);
  Require(columns && columns->size() == 1);
  const auto decoded = axlecast::DecodeColumn(columns->front(), values.size());
  Require(decoded && *decoded == values);
}

void DecodeRow(Bytes body, std::size_t n) {
  axlecast::PositionChunkRow chunk;
  chunk.t0 = 1'790'000'000'000'000;
  chunk.summary.n = static_cast<std::int64_t>(n);
  chunk.body.assign(body.begin(), body.end());
  const axlecast::StreamKey key{
      .device = "a", .boot_id = 1, .datum_epoch = 0, .counts_per_turn = 131'072, .unit = 1, .unit_per_count = 0.5};
  const auto samples = axlecast::DecodePositionChunk(chunk, key);
  Require(!samples || samples->size() == n);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::size_t n = std::size_t{data[0]} + 1;
  const Bytes bytes(data + 1, size - 1);
  Decode(bytes, n);
  DecodeRow(bytes, n);
  Encode(bytes);
  axlecast::RawRow raw;
  raw.n = data[0];
  raw.records.assign(bytes.begin(), bytes.end());
  static_cast<void>(axlecast::DecodeRaw(raw));
  return 0;
}
