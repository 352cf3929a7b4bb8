#include "core/command/body_digest.h"

#include <sodium.h>

namespace axlecast {

std::int64_t BodyDigest(Bytes body) {
  std::array<std::uint8_t, crypto_generichash_BYTES> hash;  // 32 bytes: BLAKE2b-256
  crypto_generichash(hash.data(), hash.size(), body.data(), body.size(), nullptr, 0);
  std::uint64_t digest = 0;
  for (std::size_t i = 0; i < 8; ++i) digest = digest << 8 | hash[i];
  return static_cast<std::int64_t>(digest);
}

}  // namespace axlecast
