#include "tools/log/log_seal.h"

#include <array>
#include <bit>
#include <cstring>

#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

constexpr std::size_t kSealSize = 20;
constexpr std::uint32_t kPolynomial = 0x82F63B78;  // 0x1EDC6F41 (RFC 3720, 12.1), its bits reversed
constexpr std::size_t kSlices = 8;

using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

// tables[k][b]: the change of the CRC by byte b if k more bytes follow.
constexpr Tables MakeTables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? kPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < kSlices; ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t crc = tables[k - 1][byte];
      tables[k][byte] = (crc >> 8U) ^ tables[0][crc & 0xFFU];
    }
  }
  return tables;
}

constexpr Tables kTables = MakeTables();

// Reads from `begin` to the end. Returns true if that is enough: a seal was found, or `begin` is the start of the log.
bool ReadTail(Bytes log, std::size_t begin, LogTail& tail) {
  bool sealed = begin == 0;
  LogReader reader(log, begin);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    tail.size = reader.position();
    tail.next_number = event->number < 0 || event->number == INT64_MAX ? 0 : event->number + 1;
    if (event->channel == kSealChannel) {
      tail.open.Reset();
      sealed = true;
    } else {
      tail.open.Add(log.subspan(reader.offset(), EventSize(*event)));
    }
  }
  tail.torn = log.size() - tail.size;
  return sealed;
}

}  // namespace

std::vector<std::uint8_t> EncodeSeal(const LogSeal& seal) {
  std::vector<std::uint8_t> data;
  data.reserve(kSealSize);
  AppendBigEndian(data, seal.bytes);
  AppendBigEndian(data, seal.events);
  AppendBigEndian(data, seal.crc32c);
  return data;
}

std::optional<LogSeal> ParseSeal(Bytes data) {
  if (data.size() != kSealSize) return std::nullopt;
  return LogSeal{.bytes = ReadBigEndian<std::uint64_t>(data, 0),
                 .events = ReadBigEndian<std::uint64_t>(data, 8),
                 .crc32c = ReadBigEndian<std::uint32_t>(data, 16)};
}

std::uint32_t Crc32c(std::uint32_t crc, Bytes data) {
  static_assert(std::endian::native == std::endian::little);
  crc = ~crc;
  while (data.size() >= kSlices) {
    std::uint64_t word = 0;
    std::memcpy(&word, data.data(), kSlices);
    word ^= crc;
    crc = 0;
    for (std::size_t k = 0; k < kSlices; ++k) crc ^= kTables[kSlices - 1 - k][word >> (8 * k) & 0xFFU];
    data = data.subspan(kSlices);
  }
  for (const std::uint8_t byte : data) crc = (crc >> 8U) ^ kTables[0][(crc ^ byte) & 0xFFU];
  return ~crc;
}

void SealCount::Add(Bytes record) {
  seal_.bytes += record.size();
  ++seal_.events;
  seal_.crc32c = Crc32c(seal_.crc32c, record);
}

LogTail FindTail(Bytes log, std::size_t look) {
  LogTail tail;
  if (log.size() > look && ReadTail(log, log.size() - look, tail)) return tail;
  tail = {};
  static_cast<void>(ReadTail(log, 0, tail));
  return tail;
}

}  // namespace axlecast
