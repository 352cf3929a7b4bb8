#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "drivers/saa_serial/stream_parser.h"

namespace axlecast::saa_serial {

using ByteList = std::vector<std::uint8_t>;

// A frame as the tables (2) of SAA manual 5.1.1 give it, written down here once more on its own.
inline ByteList StreamFrame(std::uint32_t counts, int bits) {
  ByteList frame = {0xFF, 0x81};
  const int data = bits <= 16 ? 2 : bits <= 24 ? 3 : 4;
  for (int byte = data - 1; byte >= 0; --byte) frame.push_back(static_cast<std::uint8_t>(counts >> (8 * byte)));
  unsigned sum = 0;
  for (const std::uint8_t byte : frame) sum += byte;
  frame.push_back(static_cast<std::uint8_t>(sum % 256));
  return frame;
}

// All places of a stream at which a frame is possible, found by trial.
inline std::set<std::int64_t> NaiveFrames(const ByteList& stream, int bits) {
  std::set<std::int64_t> places;
  const std::size_t size = bits <= 16 ? 5 : bits <= 24 ? 6 : 7;
  for (std::size_t at = 0; at + size <= stream.size(); ++at) {
    std::uint64_t counts = 0;
    unsigned sum = 0;
    for (std::size_t i = 0; i + 1 < size; ++i) sum += stream[at + i];
    for (std::size_t i = 2; i + 1 < size; ++i) counts = counts * 256 + stream[at + i];
    const bool frame = stream[at] == 0xFF && stream[at + 1] == 0x81 && sum % 256 == stream[at + size - 1] &&
                       counts < std::uint64_t{1} << bits;
    if (frame) places.insert(static_cast<std::int64_t>(at));
  }
  return places;
}

inline void Append(ByteList& stream, const ByteList& bytes) {
  stream.insert(stream.end(), bytes.begin(), bytes.end());
}

// Everything that the parser finds, errors included, in reads of `chunk` bytes, 1 us apart.
inline std::vector<StreamParser::Found> ParseAll(StreamParser& parser, const ByteList& stream, std::size_t chunk) {
  std::vector<StreamParser::Found> found;
  MonoNs now = kSecond;
  for (std::size_t at = 0; at < stream.size(); at += chunk) {
    const std::size_t count = std::min(chunk, stream.size() - at);
    parser.Append(Bytes(stream).subspan(at, count), {now, now + kMicrosecond});
    now += kMicrosecond;
    while (const auto next = parser.Next()) found.push_back(*next);
  }
  return found;
}

inline std::vector<std::int64_t> FramePlaces(const std::vector<StreamParser::Found>& found) {
  std::vector<std::int64_t> places;
  for (const auto& each : found) {
    if (!each.error) places.push_back(each.position);
  }
  return places;
}

}  // namespace axlecast::saa_serial
