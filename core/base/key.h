#pragma once

#include <array>
#include <cstdint>

namespace axlecast {

// Ed25519 (RFC 8032), as libsodium has it.
using PublicKey = std::array<std::uint8_t, 32>;
using Signature = std::array<std::uint8_t, 64>;

}  // namespace axlecast
