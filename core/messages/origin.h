#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace axlecast {

// The identity of a message's publisher: fields that every published type has after its times (lcmtypes/).
struct Origin {
  std::int64_t boot_id = 0;     // random per start of the process
  std::int64_t machine_id = 0;  // NameHash of the machine's name; 0: not stated
  std::int64_t clock_id = 0;    // NameHash of the boot of the host; equal ids: one CLOCK_MONOTONIC. 0: not stated
  std::string machine = {};     // its name, <= 24 bytes; only some types contain it

  template <typename Message>
  void Set(Message& message) const {
    message.boot_id = boot_id;
    message.machine_id = machine_id;
    message.clock_id = clock_id;
    if constexpr (requires { message.machine; }) message.machine = machine;
  }

  friend bool operator==(const Origin&, const Origin&) = default;
};

// Returns FNV-1a, 64 bits, of the UTF-8 bytes of `name` (draft-eastlake-fnv, section 2); never 0.
[[nodiscard]] constexpr std::int64_t NameHash(std::string_view name) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char character : name) {
    hash ^= static_cast<std::uint8_t>(character);
    hash *= 0x100000001B3;
  }
  return hash == 0 ? 1 : static_cast<std::int64_t>(hash);
}

}  // namespace axlecast
