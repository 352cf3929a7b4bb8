#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Datagrams as the protocol's description has them, built byte by byte.
class DatagramText {
 public:
  DatagramText& U16(std::uint32_t value) { return Byte(value >> 8).Byte(value); }
  DatagramText& U32(std::uint32_t value) { return U16(value >> 16).U16(value); }
  DatagramText& Text(std::string_view text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    return *this;
  }
  DatagramText& Channel(std::string_view channel) { return Text(channel).Byte(0); }
  DatagramText& Add(Bytes more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }

  std::vector<std::uint8_t> bytes;

 private:
  DatagramText& Byte(std::uint32_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
};

inline std::vector<std::uint8_t> ShortDatagram(std::uint32_t sequence, std::string_view channel,
                                               std::string_view payload) {
  return DatagramText().U32(0x4c433032).U32(sequence).Channel(channel).Text(payload).bytes;
}

struct FragmentFields {
  std::uint32_t sequence = 0;
  std::uint32_t size = 0;
  std::uint32_t offset = 0;
  std::uint32_t number = 0;
  std::uint32_t count = 0;
};

// `channel` is sent with fragment 0 only.
inline std::vector<std::uint8_t> FragmentDatagram(const FragmentFields& fields, std::string_view channel,
                                                  std::string_view payload) {
  DatagramText text;
  text.U32(0x4c433033)
      .U32(fields.sequence)
      .U32(fields.size)
      .U32(fields.offset)
      .U16(fields.number)
      .U16(fields.count);
  if (fields.number == 0) text.Channel(channel);
  return text.Text(payload).bytes;
}

}  // namespace axlecast
